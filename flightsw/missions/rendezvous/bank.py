"""A bank of Gaussian components over the receiver's lateral position: the ring a single range leaves, kept as a sum.

m [M,8], P [M,8,8], lw [M] log weights (largest zero), wk [M,8] scratch: rows of the measurement (H_*). M = 1 is the plain
seven- or eight-state filter. With 14 states instead of 8 the errors of a bearing and a data link are estimated too
(aid_errors.py). Alspach and Sorenson (1972); components as in missions/rendezvous/full_order.py.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.aid_errors import (
    BC,
    LXC,
    LYC,
    NONE,
    aided_fuse,
    aided_variance,
    errors_predict,
    errors_start,
)
from flightsw.missions.rendezvous.frame import E_SIZE, E_VX, E_VY, E_X, E_Y
from flightsw.missions.rendezvous.full_order import (
    E8_R,
    E8_U,
    H_MEAN,
    H_SIZE,
    H_VAR,
    H_X,
    H_Y,
    N8,
    VC,
    VF,
    VY,
    X,
    Y,
    discretise,
    eight_fuse,
    eight_predict,
    eight_start,
    innovation_variance,
    quadrature,
    range_ekf,
    range_quadrature,
)
from flightsw.missions.rendezvous.range_filter import NU, NU_VAR, wrap

DEAD, GONE = -40.0, -1e9  # log weight below which a component is left out for good; its weight from then on
ONLY = 0  # the component of a plain filter
OVERLAP = 0.9  # sigma of a component per grid spacing


@jit
def bank_start(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, d: float, x_t: float, y_t: float, y_hat: float, sigma_y: float,
    span: float, shift: float, e: np.ndarray,
) -> None:  # fmt: skip
    """Components from the first slant range d [m] at own position, lateral prior y_hat +- sigma_y [m]; e [13].

    M > 1: grid of +-span sigma, component sigma 0.9 of the spacing, prior weight exp(-dy^2/2 sigma^2).
    """
    M = m.shape[0]
    if M == 1:
        eight_start(m[ONLY], P[ONLY], d, x_t, y_t, y_hat, sigma_y, shift, e)
        errors_start(P[ONLY], e)
        lw[ONLY] = 0.0
        return
    step = 2.0 * span / (M - 1)
    for i in range(M):
        z = -span + step * i
        eight_start(m[i], P[i], d, x_t, y_t, y_hat + z * sigma_y, OVERLAP * step * sigma_y, shift, e)
        errors_start(P[i], e)
        lw[i] = -0.5 * z * z


@jit
def bank_predict(m: np.ndarray, P: np.ndarray, lw: np.ndarray, dt: float, e: np.ndarray, D: np.ndarray) -> None:
    """Propagate every living component by dt [s]; D [8] scratch."""
    discretise(dt, e, D)
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            eight_predict(m[i], P[i], dt, e[E8_U], D)
            errors_predict(m[i], P[i], dt, e)


@jit
def _fuse_all(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, z: float, angle: bool, gate: float, wk: np.ndarray, k: np.ndarray,
    nu: np.ndarray, at: int,
) -> bool:  # fmt: skip
    """Second half of an update: mixture innovation nu [2] <- (value, variance), gate, correction and weights; `at`: the
    measurement's errors among the states (NONE: they are not)."""
    M = m.shape[0]
    sw, sz, szz = 0.0, 0.0, 0.0
    for i in range(M):
        if lw[i] > DEAD:
            w = math.exp(lw[i])
            r = wrap(z - wk[i, H_MEAN]) if angle else z - wk[i, H_MEAN]
            sw += w
            sz += w * r
            szz += w * (r * r + wk[i, H_VAR])
    nu[NU] = sz / sw
    nu[NU_VAR] = szz / sw - nu[NU] * nu[NU]
    if gate > 0.0 and nu[NU] * nu[NU] > gate * nu[NU_VAR]:
        return False
    top = -math.inf
    for i in range(M):
        if lw[i] > DEAD:
            r = wrap(z - wk[i, H_MEAN]) if angle else z - wk[i, H_MEAN]
            S = wk[i, H_VAR]
            lw[i] -= 0.5 * (r * r / S + math.log(S))
            if at == NONE:
                eight_fuse(m[i], P[i], wk[i], r, S, k)
            else:
                aided_fuse(m[i], P[i], wk[i], r, S, k, at)
            if lw[i] > top:
                top = lw[i]
    for i in range(M):
        lw[i] = lw[i] - top if lw[i] > GONE else GONE
        if lw[i] <= DEAD:
            lw[i] = GONE
    return True


@jit
def bank_range(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, z: float, x_t: float, y_t: float, hermite: bool, gate: float,
    e: np.ndarray, wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> bool:  # fmt: skip
    """Fuse slant range z [m] taken at own position; by Gauss-Hermite quadrature or linearised. False: refused by the gate.

    gate > 0 bounds the NIS of the mixture; k [8] scratch; nu [2] <- innovation [m] and variance [m^2] of the mixture.
    """
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            if hermite:
                range_quadrature(m[i], P[i], x_t, y_t, e, wk[i])
            else:
                range_ekf(m[i], P[i], x_t, y_t, e, wk[i])
            wk[i, H_VAR] = innovation_variance(P[i], wk[i], e[E8_R])
    return _fuse_all(m, P, lw, z, False, gate, wk, k, nu, NONE)


@jit
def bank_bearing(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, z: float, x_t: float, y_t: float, R: float, gate: float,
    wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> bool:  # fmt: skip
    """Fuse the line-of-sight angle z [rad], counter-clockwise from +x at own position, variance R [rad^2] of what is white."""
    at = BC if m.shape[1] > N8 else NONE
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            quadrature(m[i], P[i], x_t, y_t, True, 0.0, 1.0, wk[i])
            wk[i, H_VAR] = aided_variance(m[i], P[i], wk[i], R, at)
    return _fuse_all(m, P, lw, z, True, gate, wk, k, nu, at)


@jit
def bank_axis(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, along: bool, z: float, R: float, wk: np.ndarray, k: np.ndarray,
    nu: np.ndarray,
) -> None:  # fmt: skip
    """Fuse x (along) or y [m] of the receiver's own position from the data link, variance R [m^2] of what is white."""
    at = NONE if m.shape[1] == N8 else (LXC if along else LYC)
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            for j in range(H_SIZE):
                wk[i, j] = 0.0
            wk[i, H_X if along else H_Y] = 1.0
            wk[i, H_MEAN] = m[i, X] if along else m[i, Y]
            wk[i, H_VAR] = aided_variance(m[i], P[i], wk[i], R, at)
    _fuse_all(m, P, lw, z, False, 0.0, wk, k, nu, at)


@jit
def bank_position(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, x: float, y: float, R: float, wk: np.ndarray, k: np.ndarray,
    nu: np.ndarray,
) -> None:  # fmt: skip
    """Fuse the receiver's own position (x, y) [m] from the data link, variance R [m^2] per axis of what is white."""
    bank_axis(m, P, lw, True, x, R, wk, k, nu)
    bank_axis(m, P, lw, False, y, R, wk, k, nu)


@jit
def bank_mean(m: np.ndarray, lw: np.ndarray, mean: np.ndarray) -> float:
    """mean [8+] <- mean of the mixture; returns the sum of the weights."""
    sw, n = 0.0, m.shape[1]
    for j in range(n):
        mean[j] = 0.0
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            w = math.exp(lw[i])
            sw += w
            for j in range(n):
                mean[j] += w * m[i, j]
    for j in range(n):
        mean[j] /= sw
    return sw


@jit
def bank_match(m: np.ndarray, P: np.ndarray, lw: np.ndarray, mean: np.ndarray, C: np.ndarray) -> None:
    """mean [8+], C [8+,8+] <- first two moments of the mixture."""
    sw, n = bank_mean(m, lw, mean), m.shape[1]
    for j in range(n):
        for c in range(n):
            C[j, c] = 0.0
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            w = math.exp(lw[i]) / sw
            for j in range(n):
                for c in range(j + 1):
                    C[j, c] += w * (P[i, j, c] + (m[i, j] - mean[j]) * (m[i, c] - mean[c]))
    for j in range(n):
        for c in range(j):
            C[c, j] = C[j, c]


@jit
def reduce_four(mean: np.ndarray, C: np.ndarray, u: float, out: np.ndarray, P4: np.ndarray) -> None:
    """out [4], P4 [4,4] <- (x, v_x, y, v_y) over ground [m, m/s] of an eight-state mean [8] and covariance [8,8]."""
    out[E_X], out[E_VX], out[E_Y], out[E_VY] = mean[X], u + mean[VC] + mean[VF], mean[Y], mean[VY]
    for i in range(E_SIZE):
        for j in range(i + 1):
            a = X if i == E_X else (VC if i == E_VX else (Y if i == E_Y else VY))
            b = X if j == E_X else (VC if j == E_VX else (Y if j == E_Y else VY))
            s = C[a, b]
            if i == E_VX:
                s += C[VF, b]
            if j == E_VX:
                s += C[a, VF]
                if i == E_VX:
                    s += C[VF, VF]
            P4[i, j] = s
            P4[j, i] = s
