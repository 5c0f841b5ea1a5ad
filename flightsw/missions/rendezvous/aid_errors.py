"""Errors of a bearing and of a data link as states behind the eight of full_order.py, for sets that give them at a rate of
their own: a constant one, and one that is correlated in time (first-order Gauss-Markov).

Bearings ten seconds apart may be taken as independent; one every second may not, and their mean is no better than the constant
error lets it be. With both errors among the states neither is averaged away: what a bearing adds is what the filter does not
have from the last one already. Bryson and Henrikson (1968); Schmidt (1966) where a constant cannot be observed.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.correction import scalar_update
from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.full_order import (
    E8_BC,
    E8_BS,
    E8_BT,
    E8_LC,
    E8_LS,
    E8_LT,
    H_MEAN,
    H_X,
    H_Y,
    N8,
    X,
    Y,
    innovation_variance,
)

# constant and correlated error of a bearing [rad], of the linked x and y [m]; a measurement names its constant one
BC, BN, LXC, LXN, LYC, LYN, N14 = range(N8, N8 + 7)
NONE = 0  # no errors among the states


@jit
def errors_start(P: np.ndarray, e: np.ndarray) -> None:
    """Variances of the errors in P [14,14], zero elsewhere there; P [8,8] has none. e [19]."""
    if P.shape[0] == N8:
        return
    P[BC, BC], P[BN, BN] = e[E8_BC] * e[E8_BC], e[E8_BS] * e[E8_BS]
    for c in (LXC, LYC):
        P[c, c], P[c + 1, c + 1] = e[E8_LC] * e[E8_LC], e[E8_LS] * e[E8_LS]


@jit
def errors_predict(m: np.ndarray, P: np.ndarray, dt: float, e: np.ndarray) -> None:
    """Let the correlated errors of m [14], P [14,14] fade over dt [s]; of eight states nothing. e [19]."""
    if m.shape[0] == N8:
        return
    for c in (BN, LXN, LYN):
        tau, s = (e[E8_BT], e[E8_BS]) if c == BN else (e[E8_LT], e[E8_LS])
        a = math.exp(-dt / tau)
        m[c] *= a
        for j in range(m.shape[0]):
            P[c, j] *= a
        for j in range(m.shape[0]):
            P[j, c] *= a
        P[c, c] -= s * s * math.expm1(-2.0 * dt / tau)


@jit
def aided_variance(m: np.ndarray, P: np.ndarray, h: np.ndarray, R: float, at: int) -> float:
    """Innovation variance of a row h [8] in x and y whose errors are the states `at` and the next; R what is white besides.

    h[H_MEAN] takes their estimates. `at` NONE: R is all of the error.
    """
    S = innovation_variance(P, h, R)
    if at == NONE:
        return S
    h[H_MEAN] += m[at] + m[at + 1]
    for c in (at, at + 1):
        S += 2.0 * (h[H_X] * P[X, c] + h[H_Y] * P[Y, c]) + P[c, c]
    return S + 2.0 * P[at, at + 1]


@jit
def aided_fuse(m: np.ndarray, P: np.ndarray, h: np.ndarray, nu: float, S: float, k: np.ndarray, at: int) -> None:
    """Correct m [14], P [14,14] with innovation nu of variance S of the row h [8] in x and y, errors `at`; k [14] scratch."""
    for i in range(m.shape[0]):
        k[i] = h[H_X] * P[i, X] + h[H_Y] * P[i, Y] + P[i, at] + P[i, at + 1]
    scalar_update(m, P, k, nu, S)
