"""Iterated extended Kalman filter of the position in a tanker's wake: expected readings and correction.

State as in state.py. Source: sevil.md 8.4; iteration as Gauss-Newton on the posterior with halved steps (Bell and
Cathey 1993), covariance in Joseph's form.
"""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import backward_sub_t, forward_sub
from flightsw.missions.receiver.airdata.expected import G_X, M_READ, chol, expected
from flightsw.missions.receiver.airdata.state import X_X, X_Y, X_Z, N, linearise, point_of

OK, GATED, BROKEN = 0, 1, 2


@jit
def common_noise(i: int, j: int, r_att: float) -> float:
    """Covariance of readings i and j from attitude noise r_att [rad], the same at all probes: psi in beta, theta in alpha."""
    return r_att * r_att if i // 3 == j // 3 and i >= 3 else 0.0


@jit
def spread(
    P: np.ndarray,
    H: np.ndarray,
    idx: np.ndarray,
    m: int,
    sig: np.ndarray,
    r_att: float,
    PH: np.ndarray,
    R: np.ndarray,
    S: np.ndarray,
) -> None:
    """PH [16,9] <- P H^T, R [9,9] <- noise, S [9,9] <- H P H^T + R of the m readings idx [m]; sig [3] of V, beta, alpha."""
    for i in range(N):
        for j in range(m):
            s = 0.0
            for k in range(N):
                s += P[i, k] * H[idx[j], k]
            PH[i, j] = s
    for i in range(m):
        for j in range(i + 1):
            r = common_noise(idx[i], idx[j], r_att)
            if i == j:
                r += sig[idx[i] // 3] * sig[idx[i] // 3]
            s = r
            for k in range(N):
                s += H[idx[i], k] * PH[k, j]
            R[i, j] = r
            R[j, i] = r
            S[i, j] = s
            S[j, i] = s


@jit
def foresee(
    x: np.ndarray,
    P: np.ndarray,
    g: np.ndarray,
    r_att: float,
    probes: np.ndarray,
    wk: np.ndarray,
    e: np.ndarray,
    S: np.ndarray,
) -> None:
    """e [9] <- expected readings at x [16]; S [9,9] <- H P H^T + common_noise (sensor noise not included)."""
    H = np.empty((M_READ, N))
    linearise(x, g, probes, wk, e, H)
    spread(P, H, np.arange(M_READ), M_READ, np.zeros(3), r_att, np.empty((N, M_READ)), np.empty((M_READ, M_READ)), S)


@jit
def norm_by(L: np.ndarray, m: int, v: np.ndarray) -> float:
    """|L^-1 v|^2 with L [m,m] lower triangular; v [m] <- L^-1 v."""
    forward_sub(L, m, v)
    s = 0.0
    for i in range(m):
        s += v[i] * v[i]
    return s


@jit
def joseph(P: np.ndarray, H: np.ndarray, idx: np.ndarray, m: int, L: np.ndarray, R: np.ndarray, K: np.ndarray) -> None:
    """P <- (I - K H) P (I - K H)^T + K R K^T; K [16,9] holds P H^T on entry, the gain after; L [m,m] factor of S."""
    A = np.empty((N, N))
    B = np.empty((N, N))
    KR = np.empty((N, M_READ))
    for i in range(N):
        forward_sub(L, m, K[i])
        backward_sub_t(L, m, K[i])
        for k in range(N):
            s = 1.0 if i == k else 0.0
            for j in range(m):
                s -= K[i, j] * H[idx[j], k]
            A[i, k] = s
    for i in range(N):
        for k in range(N):
            s = 0.0
            for j in range(N):
                s += A[i, j] * P[j, k]
            B[i, k] = s
        for k in range(m):
            s = 0.0
            for j in range(m):
                s += K[i, j] * R[j, k]
            KR[i, k] = s
    for i in range(N):
        for k in range(i + 1):
            s = 0.0
            for j in range(N):
                s += B[i, j] * A[k, j]
            for j in range(m):
                s += KR[i, j] * K[k, j]
            P[i, k] = s
            P[k, i] = s


@jit
def correct(
    x: np.ndarray,
    P: np.ndarray,
    y: np.ndarray,
    ok: np.ndarray,
    sig: np.ndarray,
    g: np.ndarray,
    r_att: float,
    probes: np.ndarray,
    wk: np.ndarray,
    iters: int,
    again: float,
    gate: float,
    out: np.ndarray,
) -> int:
    """Correct state x [16] and covariance P [16,16] in place by the readings y [9] whose ok [9] is not zero.

    sig [3] noise of V [m/s], beta, alpha [rad]; g [11] frame, r_att attitude noise [rad]; at most `iters` linearisations,
    another one only after a step of more than `again` [m] in y and z; an update whose NIS exceeds `gate` per reading is
    refused. out [2] <- NIS at the prior, number of readings. Returns OK, GATED (nothing changed) or BROKEN (a covariance is
    not positive: nothing changed). The maximum of the posterior density is searched by Gauss-Newton steps from the prior,
    each halved until the density does not fall.
    """
    idx = np.empty(M_READ, dtype=np.int64)
    m = 0
    for j in range(M_READ):
        if ok[j] != 0:
            idx[m] = j
            m += 1
    out[0] = 0.0
    out[1] = float(m)
    if m == 0:
        return OK
    h = np.empty(M_READ)
    H = np.empty((M_READ, N))
    PH = np.empty((N, M_READ))
    R = np.empty((M_READ, M_READ))
    LR = np.empty((M_READ, M_READ))
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
        spread(P, H, idx, m, sig, r_att, PH, R, S)
        if not chol(S, m):
            return BROKEN
        if it == iters:
            break  # the last pass only gives the gain
        for i in range(m):
            d[i] = y[idx[i]] - h[idx[i]]
        if it == 0:
            LR[:] = R
            if not chol(LR, m):
                return BROKEN
            cost = norm_by(LR, m, d.copy())
        for i in range(m):
            for k in range(N):
                d[i] += H[idx[i], k] * (xi[k] - x0[k])
        nis = norm_by(S, m, d)
        if it == 0:
            out[0] = nis
            if not nis <= gate * m:
                return GATED
        backward_sub_t(S, m, d)
        for k in range(N):
            s = 0.0
            for i in range(m):
                s += H[idx[i], k] * d[i]
            mn[k] = s
        step = 0.0
        t = 1.0
        for _ in range(5):
            c = 0.0
            for k in range(N):
                mt[k] = (1.0 - t) * mu[k] + t * mn[k]
            for k in range(N):
                s = 0.0
                for j in range(N):
                    s += P[k, j] * mt[j]
                xn[k] = x0[k] + s
                c += s * mt[k]
            point_of(xn, p)
            gx[G_X] = g[G_X] + xn[X_X]
            expected(p, gx, probes, wk, False, h, none)
            for i in range(m):
                d[i] = y[idx[i]] - h[idx[i]]
            c += norm_by(LR, m, d)
            if c <= cost * (1.0 + 1e-9) + 1e-9:
                step = abs(xn[X_Y] - xi[X_Y]) + abs(xn[X_Z] - xi[X_Z])
                mu[:] = mt
                xi[:] = xn
                cost = c
                break
            t *= 0.5
        if step < again and it + 1 < iters:
            break  # a slope taken where this very noise has led would be correlated with it
    joseph(P, H, idx, m, S, R, PH)
    x[:] = xi
    return OK


@jit
def correct_scalar(x: np.ndarray, P: np.ndarray, i: int, value: float, r: float, gate: float) -> float:
    """Correct x [16], P [16,16] in place by a direct measurement `value` of state i with variance r; returns its NIS.

    Nothing changes when the NIS exceeds `gate`. Joseph's form.
    """
    s = P[i, i] + r
    d = value - x[i]
    nis = d * d / s
    if not nis <= gate:
        return nis
    K = np.empty(N)
    row = np.empty(N)
    for k in range(N):
        K[k] = P[k, i] / s
        row[k] = P[i, k]
    for k in range(N):
        x[k] += K[k] * d
    for a in range(N):
        for b in range(a + 1):
            P[a, b] = P[a, b] - K[a] * row[b] - row[a] * K[b] + K[a] * K[b] * s
            P[b, a] = P[a, b]
    return nis
