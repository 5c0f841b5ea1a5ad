"""What the position estimators of the wake compute: expected probe readings with their Jacobian, weighted residuals, and a
search for the position by weighted least squares.

Frame F and the reading order (V of each probe, then beta, then alpha) as in wake_kernel.py; three probes. The
filter's kernels are in wake_filter.py. Source: sevil.md sections 3.2 and 8.2 to 8.4.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.missions.receiver.airdata.wake_kernel import horseshoe

# point `p` [10] at which readings are expected: position and velocity across the tanker's path [m, m/s], circulation
# factors of wing and tail [-], vortices below the model [m], uniform wind [m/s, F]
P_Y, P_Z, P_VY, P_VZ, P_KW, P_KT, P_H, P_W = 0, 1, 2, 3, 4, 5, 6, 7
# frame `g` [11]: x and its rate [m, m/s], psi, theta, phi of the own body relative to F [rad], own body rates [rad/s],
# tanker airspeed [m/s], density [kg/m^3], share of the height P_H that the tail's vortices take part in [-]
G_X, G_XDOT, G_E, G_OMEGA, G_V, G_RHO, G_SHARE = 0, 1, 2, 5, 8, 9, 10
G_SIZE = 11
# columns of the Jacobian [9, 9] of the readings
J_X, J_Y, J_Z, J_KW, J_KT, J_H, J_W = 0, 1, 2, 3, 4, 5, 6
STEP_M = 1e-3  # [m] of the central differences: error (step / core)^2, rounding 1e-13 / step
M_READ = 9


@jit
def surface_wind(
    x: float, y: float, z: float, wk: np.ndarray, at: int, gamma: float, V: float
) -> tuple[float, float, float]:
    """Wind [m/s, F] of one surface of the wake vector wk [13] (at = 0 wing, 6 tail) of circulation gamma [m^2/s]."""
    return horseshoe(x - wk[at], y - wk[at + 1], z - wk[at + 2], 0.5 * wk[at + 3], wk[at + 4], gamma, wk[12], V)


@jit
def expected(
    p: np.ndarray, g: np.ndarray, probes: np.ndarray, wk: np.ndarray, jac: bool, h: np.ndarray, J: np.ndarray
) -> None:
    """h [9] <- expected readings (m/s, rad, rad) at the point p [10] in the frame g [11]; J [9,9] <- their Jacobian.

    probes [3,3] positions [m, body]; wk [13] wake vector (wake_kernel.py). With jac false J is left alone. Columns of J:
    x, y, z [per m], circulation factors of wing and tail [per 1], height [per m], wind x, y, z [per m/s]; velocity acts as
    the opposite wind. V = |u|, beta = asin(v/V), alpha = atan2(w, u), u = C (v_F - W(P_i) - w) + omega x rho_i
    (sevil.md 3.2). Derivatives of the field are central differences, the rest is exact. A height P_H moves the vortices
    down, the tail's by G_SHARE of it.
    """
    C = np.empty(9)
    d = np.empty((9, 3))
    dcm_from_euler(g[G_E], g[G_E + 1], g[G_E + 2], C)
    V, hw, ht = g[G_V], p[P_H], p[P_H] * g[G_SHARE]
    q = 1.0 / (g[G_RHO] * V)
    gw = q * wk[5] / wk[3]
    gt = q * wk[11] / wk[9]
    for i in range(3):
        bx, by, bz = probes[i, 0], probes[i, 1], probes[i, 2]
        px = g[G_X] + (C[0] * bx + C[3] * by + C[6] * bz)
        py = p[P_Y] + (C[1] * bx + C[4] * by + C[7] * bz)
        pz = p[P_Z] + (C[2] * bx + C[5] * by + C[8] * bz)
        a0, a1, a2 = surface_wind(px, py, pz - hw, wk, 0, gw, V)
        b0, b1, b2 = surface_wind(px, py, pz - ht, wk, 6, gt, V)
        kw, kt = p[P_KW], p[P_KT]
        fx = V + g[G_XDOT] - (kw * a0 + kt * b0) - p[P_W]
        fy = p[P_VY] - (kw * a1 + kt * b1) - p[P_W + 1]
        fz = p[P_VZ] - (kw * a2 + kt * b2) - p[P_W + 2]
        ux = C[0] * fx + C[1] * fy + C[2] * fz + (g[G_OMEGA + 1] * bz - g[G_OMEGA + 2] * by)
        uy = C[3] * fx + C[4] * fy + C[5] * fz + (g[G_OMEGA + 2] * bx - g[G_OMEGA] * bz)
        uz = C[6] * fx + C[7] * fy + C[8] * fz + (g[G_OMEGA] * by - g[G_OMEGA + 1] * bx)
        s2 = max(ux * ux + uz * uz, 1e-12)
        s = math.sqrt(s2)
        V2 = s2 + uy * uy
        Va = math.sqrt(V2)
        h[i] = Va
        h[3 + i] = math.atan2(uy, s)
        h[6 + i] = math.atan2(uz, ux)
        if not jac:
            continue
        # d row 0..5: wind changed by each column, minus its sign in u
        for c in range(3):
            dx = STEP_M if c == 0 else 0.0
            dy = STEP_M if c == 1 else 0.0
            dz = STEP_M if c == 2 else 0.0
            m0, m1, m2 = surface_wind(px + dx, py + dy, pz + dz - hw, wk, 0, gw, V)
            n0, n1, n2 = surface_wind(px - dx, py - dy, pz - dz - hw, wk, 0, gw, V)
            r0, r1, r2 = surface_wind(px + dx, py + dy, pz + dz - ht, wk, 6, gt, V)
            s0, s1, t2 = surface_wind(px - dx, py - dy, pz - dz - ht, wk, 6, gt, V)
            f = 0.5 / STEP_M
            m0, m1, m2 = f * kw * (m0 - n0), f * kw * (m1 - n1), f * kw * (m2 - n2)
            r0, r1, r2 = f * kt * (r0 - s0), f * kt * (r1 - s1), f * kt * (r2 - t2)
            d[c, 0], d[c, 1], d[c, 2] = m0 + r0, m1 + r1, m2 + r2
            if c == 2:
                share = g[G_SHARE]
                d[J_H, 0], d[J_H, 1], d[J_H, 2] = -m0 - share * r0, -m1 - share * r1, -m2 - share * r2
        d[J_KW, 0], d[J_KW, 1], d[J_KW, 2] = a0, a1, a2
        d[J_KT, 0], d[J_KT, 1], d[J_KT, 2] = b0, b1, b2
        for c in range(3):
            for k in range(3):
                d[J_W + c, k] = 1.0 if c == k else 0.0
        for c in range(9):
            e0 = -(C[0] * d[c, 0] + C[1] * d[c, 1] + C[2] * d[c, 2])
            e1 = -(C[3] * d[c, 0] + C[4] * d[c, 1] + C[5] * d[c, 2])
            e2 = -(C[6] * d[c, 0] + C[7] * d[c, 1] + C[8] * d[c, 2])
            J[i, c] = (ux * e0 + uy * e1 + uz * e2) / Va
            J[3 + i, c] = (s2 * e1 - uy * (ux * e0 + uz * e2)) / (V2 * s)
            J[6 + i, c] = (ux * e2 - uz * e0) / s2


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


@jit
def weighted_cost(
    p: np.ndarray,
    y: np.ndarray,
    ok: np.ndarray,
    sig: np.ndarray,
    com: np.ndarray,
    g: np.ndarray,
    probes: np.ndarray,
    wk: np.ndarray,
    r: np.ndarray,
) -> float:
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


@jit
def scan(
    p: np.ndarray,
    y: np.ndarray,
    ok: np.ndarray,
    sig: np.ndarray,
    com: np.ndarray,
    g: np.ndarray,
    probes: np.ndarray,
    wk: np.ndarray,
    ys: np.ndarray,
    zs: np.ndarray,
    first: int,
    last: int,
    cost: np.ndarray,
) -> None:
    """cost [ny*nz] <- weighted_cost at the grid nodes first..last-1 (node = iy nz + iz) of ys [ny], zs [nz] [m]."""
    n = zs.shape[0]
    q = p.copy()
    r = np.empty(M_READ)
    for k in range(first, last):
        q[P_Y] = ys[k // n]
        q[P_Z] = zs[k % n]
        cost[k] = weighted_cost(q, y, ok, sig, com, g, probes, wk, r)


@jit
def chol(A: np.ndarray, n: int) -> bool:
    """Lower Cholesky factor of A [>=n, >=n] in place (the upper part is left as it is); False if A is not positive."""
    for j in range(n):
        s = A[j, j]
        for k in range(j):
            s -= A[j, k] * A[j, k]
        if not s > 0.0:
            return False
        A[j, j] = math.sqrt(s)
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / A[j, j]
    return True


@jit
def information(
    p: np.ndarray,
    ok: np.ndarray,
    sig: np.ndarray,
    com: np.ndarray,
    g: np.ndarray,
    probes: np.ndarray,
    wk: np.ndarray,
    inf0: np.ndarray,
    h: np.ndarray,
    A: np.ndarray,
    B: np.ndarray,
) -> None:
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


@jit
def descend(
    p: np.ndarray,
    y: np.ndarray,
    ok: np.ndarray,
    sig: np.ndarray,
    com: np.ndarray,
    g: np.ndarray,
    probes: np.ndarray,
    wk: np.ndarray,
    mean0: np.ndarray,
    inf0: np.ndarray,
    free: int,
    iters: int,
) -> float:
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
            if not chol(M, free):
                lam *= 10.0
                continue
            for i in range(free):
                for j in range(i):
                    b[i] -= M[i, j] * b[j]
                b[i] /= M[i, i]
            for i in range(free - 1, -1, -1):
                for j in range(i + 1, free):
                    b[i] -= M[j, i] * b[j]
                b[i] /= M[i, i]
            size = math.sqrt(b[0] * b[0] + b[1] * b[1])
            cut = 3.0 / size if size > 3.0 else 1.0  # a step of more than 3 m leaves the region the slope speaks for
            cost = 0.0
            for i in range(free):
                q[at[i]] = p[at[i]] + cut * b[i]
                cost += inf0[i] * (q[at[i]] - mean0[i]) ** 2
            cost += weighted_cost(q, y, ok, sig, com, g, probes, wk, h)
            if cost <= best:
                done = size < 1e-7 and (free < 4 or abs(b[2]) + abs(b[3]) < 1e-9)
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
