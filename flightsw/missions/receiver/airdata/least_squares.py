"""Position in the wake by weighted least squares: weighted residuals, cost, Fisher information and a descent.

Readings and frame as in expected.py. Source: sevil.md 8.2 to 8.4.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.linalg import backward_sub_t, cholesky, forward_sub
from flightsw.missions.receiver.airdata.expected import J_Y, M_READ, P_KT, P_KW, P_Y, P_Z, expected

(B_Y, B_Z, B_KW, B_KT, B_N) = range(5)  # unknowns: y, z [m], circulation factors of wing and tail [-]


@jit
def weigh(r: np.ndarray, ok: np.ndarray, sig: np.ndarray, com: np.ndarray) -> None:
    """r [9] <- R^-1/2 r, R = sig^2 I + com^2 1 1^T per variable over its usable channels; channels not usable become zero.

    sig, com [3] per variable V, beta, alpha (in their units); com infinite: a free common offset, which leaves the
    differences (sevil.md 8.2). R^-1/2 = (I - c 1 1^T / k) / sig with c = 1 - sig / sqrt(sig^2 + k com^2).
    """
    for v in range(3):
        k = 0
        s = 0.0
        for i in range(3):
            if ok[3 * v + i] != 0:
                k += 1
                s += r[3 * v + i]
        if k > 0:
            c = 1.0
            if com[v] < math.inf:
                c = 1.0 - sig[v] / math.sqrt(sig[v] * sig[v] + k * com[v] * com[v])
            s *= c / k
        for i in range(3):
            j = 3 * v + i
            r[j] = (r[j] - s) / sig[v] if ok[j] != 0 else 0.0


@jit_own
def weighted_cost(
    p: np.ndarray, y: np.ndarray, ok: np.ndarray, sig: np.ndarray, com: np.ndarray, g: np.ndarray, probes: np.ndarray,
    wk: np.ndarray, r: np.ndarray,
) -> float:  # fmt: skip
    """|R^-1/2 (y - h(p))|^2 [-] of readings y [9]; r [9] <- the weighted residual. Other arguments as `weigh`, `expected`."""
    none = np.empty((0, 0))
    expected(p, g, probes, wk, False, r, none)
    for j in range(M_READ):
        r[j] = y[j] - r[j]
    weigh(r, ok, sig, com)
    s = 0.0
    for j in range(M_READ):
        s += r[j] * r[j]
    return s


@jit_own
def scan(
    p: np.ndarray, y: np.ndarray, ok: np.ndarray, sig: np.ndarray, com: np.ndarray, g: np.ndarray, probes: np.ndarray,
    wk: np.ndarray, ys: np.ndarray, zs: np.ndarray, first: int, last: int, cost: np.ndarray,
) -> None:  # fmt: skip
    """cost [ny*nz] <- weighted_cost at the grid nodes first..last-1 (node = iy nz + iz) of ys [ny], zs [nz] [m]."""
    n = zs.shape[0]
    q = p.copy()
    r = np.empty(M_READ)
    for k in range(first, last):
        q[P_Y] = ys[k // n]
        q[P_Z] = zs[k % n]
        cost[k] = weighted_cost(q, y, ok, sig, com, g, probes, wk, r)


@jit_own
def information(
    p: np.ndarray, ok: np.ndarray, sig: np.ndarray, com: np.ndarray, g: np.ndarray, probes: np.ndarray, wk: np.ndarray,
    inf0: np.ndarray, h: np.ndarray, A: np.ndarray, B: np.ndarray,
) -> None:  # fmt: skip
    """A [4,4] <- B^T B + diag(inf0), the Fisher information of (y, z, wing, tail factor); B [9,4] <- R^-1/2 J; h [9].

    inf0 [4]: information of a prior (1/variance).
    """
    J = np.empty((M_READ, 9))
    c9 = np.empty(M_READ)
    expected(p, g, probes, wk, True, h, J)
    for c in range(4):
        for j in range(M_READ):
            c9[j] = J[j, J_Y + c]
        weigh(c9, ok, sig, com)
        for j in range(M_READ):
            B[j, c] = c9[j]
    for a in range(4):
        for c in range(4):
            s = inf0[a] if a == c else 0.0
            for j in range(M_READ):
                s += B[j, a] * B[j, c]
            A[a, c] = s


@jit_own
def descend(
    p: np.ndarray, y: np.ndarray, ok: np.ndarray, sig: np.ndarray, com: np.ndarray, g: np.ndarray, probes: np.ndarray,
    wk: np.ndarray, mean0: np.ndarray, inf0: np.ndarray, free: int, iters: int,
) -> float:  # fmt: skip
    """Levenberg-Marquardt from p [10], in place, over its first `free` of (y, z, wing factor, tail factor); returns the cost.

    Cost = weighted_cost + sum inf0 (value - mean0)^2, mean0, inf0 [4] a prior (information 0: none). Stops after `iters`
    steps, or when a step is below 1e-7 m (or 1e-9 of a factor) or none lowers the cost.
    """
    at = (P_Y, P_Z, P_KW, P_KT)
    A = np.empty((4, 4))
    M = np.empty((4, 4))
    B = np.empty((M_READ, 4))
    h = np.empty(M_READ)
    r = np.empty(M_READ)
    b = np.empty(4)
    q = p.copy()
    lam = 1e-3
    best = weighted_cost(p, y, ok, sig, com, g, probes, wk, r)
    for i in range(free):
        best += inf0[i] * (p[at[i]] - mean0[i]) ** 2
    for _ in range(iters):
        information(p, ok, sig, com, g, probes, wk, inf0, h, A, B)
        for j in range(M_READ):
            r[j] = y[j] - h[j]
        weigh(r, ok, sig, com)
        moved = False
        done = False
        while lam < 1e8:
            for a in range(free):
                s = -inf0[a] * (p[at[a]] - mean0[a])
                for j in range(M_READ):
                    s += B[j, a] * r[j]
                b[a] = s
                for c in range(free):
                    M[a, c] = A[a, c]
                M[a, a] = A[a, a] * (1.0 + lam) + 1e-12
            if not cholesky(M, free):
                lam *= 10.0
                continue
            forward_sub(M, free, b)
            backward_sub_t(M, free, b)
            size = math.sqrt(b[B_Y] * b[B_Y] + b[B_Z] * b[B_Z])
            cut = 3.0 / size if size > 3.0 else 1.0  # a step of more than 3 m leaves the region the slope speaks for
            cost = 0.0
            for i in range(free):
                q[at[i]] = p[at[i]] + cut * b[i]
                cost += inf0[i] * (q[at[i]] - mean0[i]) ** 2
            cost += weighted_cost(q, y, ok, sig, com, g, probes, wk, h)
            if cost <= best:
                done = size < 1e-7 and (free < B_N or abs(b[B_KW]) + abs(b[B_KT]) < 1e-9)
                for i in range(free):
                    p[at[i]] = q[at[i]]
                best = cost
                lam = max(lam * 0.1, 1e-12)
                moved = True
                break
            lam *= 10.0
        if done or not moved:
            break
    return best
