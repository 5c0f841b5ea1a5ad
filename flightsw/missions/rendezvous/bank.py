"""A bank of Gaussian components over the receiver's lateral position: the ring a single range leaves, kept as a sum.

m [M,8], P [M,8,8], lw [M] log weights (largest zero), wk [M,9] scratch: row of the measurement, predicted value, residual
variance, innovation variance. M = 1 is the plain seven- or eight-state filter. Alspach and Sorenson (1972); components as in
missions/rendezvous/full_order.py.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.full_order import (
    E8_R,
    E8_U,
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
from flightsw.missions.rendezvous.range_filter import wrap

DEAD, GONE = -40.0, -1e9  # log weight below which a component is left out for good; its weight from then on
OVERLAP = 0.9  # sigma of a component per grid spacing


@jit
def bank_start(
    m: np.ndarray,
    P: np.ndarray,
    lw: np.ndarray,
    d: float,
    x_t: float,
    y_t: float,
    y_hat: float,
    sigma_y: float,
    span: float,
    shift: float,
    e: np.ndarray,
) -> None:
    """Components from the first slant range d [m] at own position, lateral prior y_hat +- sigma_y [m]; e [13].

    M > 1: grid of +-span sigma, component sigma 0.9 of the spacing, prior weight exp(-dy^2/2 sigma^2).
    """
    M = m.shape[0]
    if M == 1:
        eight_start(m[0], P[0], d, x_t, y_t, y_hat, sigma_y, shift, e)
        lw[0] = 0.0
        return
    step = 2.0 * span / (M - 1)
    for i in range(M):
        z = -span + step * i
        eight_start(m[i], P[i], d, x_t, y_t, y_hat + z * sigma_y, OVERLAP * step * sigma_y, shift, e)
        lw[i] = -0.5 * z * z


@jit
def bank_predict(m: np.ndarray, P: np.ndarray, lw: np.ndarray, dt: float, e: np.ndarray, D: np.ndarray) -> None:
    """Propagate every living component by dt [s]; D [8] scratch."""
    discretise(dt, e, D)
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            eight_predict(m[i], P[i], dt, e[E8_U], D)


@jit
def _fuse_all(
    m: np.ndarray,
    P: np.ndarray,
    lw: np.ndarray,
    z: float,
    angle: bool,
    gate: float,
    wk: np.ndarray,
    k: np.ndarray,
    nu: np.ndarray,
) -> bool:
    """Second half of an update: mixture innovation nu [2] <- (value, variance), gate, correction and weights."""
    M = m.shape[0]
    sw, sz, szz = 0.0, 0.0, 0.0
    for i in range(M):
        if lw[i] > DEAD:
            w = math.exp(lw[i])
            r = wrap(z - wk[i, 5]) if angle else z - wk[i, 5]
            sw += w
            sz += w * r
            szz += w * (r * r + wk[i, 7])
    nu[0] = sz / sw
    nu[1] = szz / sw - nu[0] * nu[0]
    if gate > 0.0 and nu[0] * nu[0] > gate * nu[1]:
        return False
    top = -math.inf
    for i in range(M):
        if lw[i] > DEAD:
            r = wrap(z - wk[i, 5]) if angle else z - wk[i, 5]
            S = wk[i, 7]
            lw[i] -= 0.5 * (r * r / S + math.log(S))
            eight_fuse(m[i], P[i], wk[i], r, S, k)
            if lw[i] > top:
                top = lw[i]
    for i in range(M):
        lw[i] = lw[i] - top if lw[i] > GONE else GONE
        if lw[i] <= DEAD:
            lw[i] = GONE
    return True


@jit
def bank_range(
    m: np.ndarray,
    P: np.ndarray,
    lw: np.ndarray,
    z: float,
    x_t: float,
    y_t: float,
    hermite: bool,
    gate: float,
    e: np.ndarray,
    wk: np.ndarray,
    k: np.ndarray,
    nu: np.ndarray,
) -> bool:
    """Fuse slant range z [m] taken at own position; by Gauss-Hermite quadrature or linearised. False: refused by the gate.

    gate > 0 bounds the NIS of the mixture; k [8] scratch; nu [2] <- innovation [m] and variance [m^2] of the mixture.
    """
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            if hermite:
                range_quadrature(m[i], P[i], x_t, y_t, e, wk[i])
            else:
                range_ekf(m[i], P[i], x_t, y_t, e, wk[i])
            wk[i, 7] = innovation_variance(P[i], wk[i], e[E8_R])
    return _fuse_all(m, P, lw, z, False, gate, wk, k, nu)


@jit
def bank_bearing(
    m: np.ndarray,
    P: np.ndarray,
    lw: np.ndarray,
    z: float,
    x_t: float,
    y_t: float,
    R: float,
    gate: float,
    wk: np.ndarray,
    k: np.ndarray,
    nu: np.ndarray,
) -> bool:
    """Fuse the line-of-sight angle z [rad], counter-clockwise from +x at own position, variance R [rad^2]."""
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            quadrature(m[i], P[i], x_t, y_t, True, 0.0, 1.0, wk[i])
            wk[i, 7] = innovation_variance(P[i], wk[i], R)
    return _fuse_all(m, P, lw, z, True, gate, wk, k, nu)


@jit
def bank_position(
    m: np.ndarray,
    P: np.ndarray,
    lw: np.ndarray,
    x: float,
    y: float,
    R: float,
    wk: np.ndarray,
    k: np.ndarray,
    nu: np.ndarray,
) -> None:
    """Fuse the receiver's own position (x, y) [m] from the data link, variance R [m^2] per axis."""
    for axis in range(2):
        for i in range(m.shape[0]):
            if lw[i] > DEAD:
                for j in range(9):
                    wk[i, j] = 0.0
                wk[i, axis] = 1.0
                wk[i, 5] = m[i, X] if axis == 0 else m[i, Y]
                wk[i, 7] = innovation_variance(P[i], wk[i], R)
        _fuse_all(m, P, lw, x if axis == 0 else y, False, 0.0, wk, k, nu)


@jit
def bank_match(m: np.ndarray, P: np.ndarray, lw: np.ndarray, mean: np.ndarray, C: np.ndarray) -> None:
    """mean [8], C [8,8] <- first two moments of the mixture."""
    sw = 0.0
    for j in range(8):
        mean[j] = 0.0
        for c in range(8):
            C[j, c] = 0.0
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            w = math.exp(lw[i])
            sw += w
            for j in range(8):
                mean[j] += w * m[i, j]
    for j in range(8):
        mean[j] /= sw
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            w = math.exp(lw[i]) / sw
            for j in range(8):
                for c in range(j + 1):
                    C[j, c] += w * (P[i, j, c] + (m[i, j] - mean[j]) * (m[i, c] - mean[c]))
    for j in range(8):
        for c in range(j):
            C[c, j] = C[j, c]


@jit
def bank_mean(m: np.ndarray, lw: np.ndarray, mean: np.ndarray) -> None:
    """mean [8] <- mean of the mixture."""
    sw = 0.0
    for j in range(8):
        mean[j] = 0.0
    for i in range(m.shape[0]):
        if lw[i] > DEAD:
            w = math.exp(lw[i])
            sw += w
            for j in range(8):
                mean[j] += w * m[i, j]
    for j in range(8):
        mean[j] /= sw


@jit
def reduce_four(mean: np.ndarray, C: np.ndarray, u: float, out: np.ndarray, P4: np.ndarray) -> None:
    """out [4], P4 [4,4] <- (x, v_x, y, v_y) over ground [m, m/s] of an eight-state mean [8] and covariance [8,8]."""
    out[0], out[1], out[2], out[3] = mean[X], u + mean[VC] + mean[VF], mean[Y], mean[VY]
    for i in range(4):
        for j in range(i + 1):
            a = X if i == 0 else (VC if i == 1 else (Y if i == 2 else VY))
            b = X if j == 0 else (VC if j == 1 else (Y if j == 2 else VY))
            s = C[a, b]
            if i == 1:
                s += C[VF, b]
            if j == 1:
                s += C[a, VF]
                if i == 1:
                    s += C[VF, VF]
            P4[i, j] = s
            P4[j, i] = s
