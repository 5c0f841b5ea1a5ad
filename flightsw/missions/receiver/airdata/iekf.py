"""Iterated extended Kalman filter of the position in a tanker's wake: expected readings and correction.

State as in state.py. Source: sevil.md 8.4; iteration as Gauss-Newton on the posterior with halved steps (Bell and
Cathey 1993), covariance in Joseph's form.
"""

from __future__ import annotations

import numpy as np

from flightsw.filters.correction import cross_covariance, innovation_covariance, joseph
from flightsw.filters.covariance import gain, norm_by
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.linalg import backward_sub_t, cholesky, matvec, product
from flightsw.missions.receiver.airdata.expected import G_X, M_READ, expected
from flightsw.missions.receiver.airdata.state import X_OFF, X_X, X_Y, X_Z, N, linearise, point_of

OK, GATED, BROKEN = 0, 1, 2
OUT_NIS, OUT_COUNT = 0, 1  # entries of the result out [2]


@jit
def common_noise(i: int, j: int, r_att: float) -> float:
    """Covariance of readings i and j from attitude noise r_att [rad], the same at all probes: psi in beta, theta in alpha."""
    return r_att * r_att if i // 3 == j // 3 and i >= 3 else 0.0


@jit
def spread(
    P: np.ndarray, H: np.ndarray, idx: np.ndarray, m: int, sig: np.ndarray, r_att: float, own: np.ndarray,
    PH: np.ndarray, R: np.ndarray, S: np.ndarray,
) -> None:  # fmt: skip
    """PH [28,9] <- P H^T, R [9,9] <- noise, S [9,9] <- H P H^T + R of m readings; sig [3] of V, beta, alpha, own [9,9] covariance
    of what each probe's own air adds.

    Row i of H [9,28] is that of reading idx[i].
    """
    cross_covariance(P, H, m, PH)
    for i in range(m):
        for j in range(i + 1):
            r = common_noise(idx[i], idx[j], r_att) + own[idx[i], idx[j]]
            if i == j:
                r += sig[idx[i] // 3] * sig[idx[i] // 3]
            R[i, j] = r
            R[j, i] = r
            S[i, j] = r
    innovation_covariance(H, PH, m, S)


@jit
def heard(ok: np.ndarray, idx: np.ndarray) -> int:
    """idx [>=n] <- the n places where ok [9] is not zero, in order; returns n. A count begun in the caller would
    have all it hands the count to compiled once more, for the number 0."""
    n = 0
    for j in range(ok.shape[0]):
        if ok[j] != 0:
            idx[n] = j
            n += 1
    return n


@jit_own
def foresee(
    x: np.ndarray, P: np.ndarray, g: np.ndarray, r_att: float, probes: np.ndarray, wk: np.ndarray, e: np.ndarray,
    S: np.ndarray,
) -> None:  # fmt: skip
    """e [9] <- expected readings at x [28]; S [9,9] <- H P H^T + common_noise (sensor noise not included)."""
    H = np.empty((M_READ, N))
    linearise(x, g, probes, wk, e, H)
    idx = np.empty(M_READ, dtype=np.int64)
    for j in range(M_READ):
        idx[j] = j
    none = np.zeros((M_READ, M_READ))
    spread(P, H, idx, len(idx), np.zeros(3), r_att, none, np.empty((N, M_READ)), np.empty((M_READ, M_READ)), S)


@jit_own
def correct(
    x: np.ndarray, P: np.ndarray, y: np.ndarray, ok: np.ndarray, sig: np.ndarray, g: np.ndarray, r_att: float,
    probes: np.ndarray, wk: np.ndarray, iters: int, again: float, gate: float, fixed: np.ndarray, own: np.ndarray,
    out: np.ndarray,
) -> int:  # fmt: skip
    """Correct state x [28] and covariance P [28,28] in place by the readings y [9] whose ok [9] is not zero.

    sig [3] noise of V [m/s], beta, alpha [rad], own [9,9] covariance of each probe's own air; g [11] frame, r_att attitude noise
    [rad]; states with fixed [28] not zero are considered: they keep their values; at most `iters` linearisations,
    another one only after a step of more than `again` [m] in y and z; an update whose NIS exceeds `gate` per reading is
    refused. out [2] (OUT_*) <- NIS at the prior, number of readings. Returns OK, GATED (nothing changed) or BROKEN (a
    covariance is not positive: nothing changed). The maximum of the posterior density is searched by Gauss-Newton steps from
    the prior, each halved until the density does not fall.
    """
    idx = np.empty(M_READ, dtype=np.int64)
    m = heard(ok, idx)
    out[OUT_NIS] = 0.0
    out[OUT_COUNT] = float(m)
    if m == 0:
        return OK
    h = np.empty(M_READ)
    H = np.empty((M_READ, N))
    PH = np.empty((N, M_READ))
    R = np.empty((M_READ, M_READ))
    LR = np.empty((M_READ, M_READ))
    KR = np.empty((N, M_READ))
    S = np.empty((M_READ, M_READ))
    d = np.empty(M_READ)
    p = np.empty(10)
    none = np.empty((0, 0))
    gx = g.copy()
    x0 = x.copy()
    xi = x.copy()
    xn = x.copy()
    mu = np.zeros(N)  # xi - x0 = P mu, so its share of the density is mu^T (xi - x0)
    mn = np.empty(N)
    mt = np.empty(N)
    cost = 0.0
    for it in range(iters + 1):
        linearise(xi, g, probes, wk, h, H)
        for i in range(m):  # idx[i] >= i: no row is written over before it is read
            for k in range(N):
                H[i, k] = H[idx[i], k]
        spread(P, H, idx, m, sig, r_att, own, PH, R, S)
        if not cholesky(S, m):
            return BROKEN
        if it == iters:
            break  # the last pass only gives the gain
        for i in range(m):
            d[i] = y[idx[i]] - h[idx[i]]
        if it == 0:
            for i in range(m):
                for j in range(m):
                    LR[i, j] = R[i, j]
            if not cholesky(LR, m):
                return BROKEN
            cost = norm_by(LR, m, d.copy())
        for i in range(m):
            for k in range(N):
                d[i] += H[i, k] * (xi[k] - x0[k])
        nis = norm_by(S, m, d)
        if it == 0:
            out[OUT_NIS] = nis
            if not nis <= gate * m:
                return GATED
        backward_sub_t(S, m, d)
        for k in range(N):
            s = 0.0
            for i in range(m):
                s += H[i, k] * d[i]
            mn[k] = s
        step = 0.0
        t = 1.0
        for _ in range(5):
            c = 0.0
            for k in range(N):
                mt[k] = (1.0 - t) * mu[k] + t * mn[k]
            matvec(P, mt, xn)
            for k in range(N):
                c += xn[k] * mt[k]
                xn[k] += x0[k]
            point_of(xn, p)
            gx[G_X] = g[G_X] + xn[X_X]
            expected(p, gx, probes, wk, False, h, none)
            for i in range(m):
                d[i] = y[idx[i]] - h[idx[i]] - xn[X_OFF + idx[i]]
            c += norm_by(LR, m, d)
            if c <= cost * (1.0 + 1e-9) + 1e-9:
                step = abs(xn[X_Y] - xi[X_Y]) + abs(xn[X_Z] - xi[X_Z])
                for k in range(N):
                    mu[k] = mt[k]
                    xi[k] = xn[k]
                cost = c
                break
            t *= 0.5
        if step < again and it + 1 < iters:
            break  # a slope taken where this very noise has led would be correlated with it
    gain(PH, N, S, m)
    for k in range(N):
        if fixed[k] != 0:
            for i in range(m):
                PH[k, i] = 0.0
    product(PH[:, :m], R[:m, :m], KR)
    joseph(P, H, m, PH, KR, np.empty((N, N)), np.empty((N, N)))
    for k in range(N):
        if fixed[k] == 0:
            x[k] = xi[k]
    return OK
