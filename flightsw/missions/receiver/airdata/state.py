"""State of the wake-position filter: layout, motion over a step, and expected readings with their Jacobian.

State [16] (X_*), covariance [16,16]; a state that is not estimated has a zero row and column and no process noise.
Source: sevil.md 8.4, 8.5.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.airdata.expected import (
    G_X,
    J_H,
    J_KT,
    J_KW,
    J_W,
    J_X,
    J_Y,
    J_Z,
    M_READ,
    P_H,
    P_KT,
    P_KW,
    P_VY,
    P_VZ,
    P_W,
    P_Y,
    P_Z,
    expected,
)

# state: position and velocity across the path [m, m/s, F], circulation errors of wing and tail [-], height of the
# vortices below the model [m], turbulence and slow wind common to the probes [m/s, F], bias of the relative acceleration
# in y and z [m/s^2], true less given x [m]
X_Y, X_Z, X_VY, X_VZ, X_KW, X_KT, X_H, X_TURB, X_SLOW, X_ACC, X_X = 0, 1, 2, 3, 4, 5, 6, 7, 10, 13, 15
N = 16
PLACE, SPEED, LEARNT = slice(X_Y, X_VY), slice(X_VY, X_KW), slice(X_KW, X_TURB)
TURB, SLOW = slice(X_TURB, X_SLOW), slice(X_SLOW, X_ACC)
# Gauss-Markov processes `tau`, `sigma` [4]: turbulence, slow wind, bias of the acceleration, error of x; noises `q` [4]:
# acceleration, then the random walks of LEARNT
M_TURB, M_SLOW, M_ACC, M_X = 0, 1, 2, 3
Q_ACC, Q_KW = 0, 1


@jit
def propagate(
    x: np.ndarray, P: np.ndarray, ay: float, az: float, dt: float, q: np.ndarray, tau: np.ndarray, sigma: np.ndarray
) -> None:
    """State x [16] and covariance P [16,16] carried over dt [s], in place (exact discretisation).

    ay, az [m/s^2, F] own acceleration relative to the tanker; q [4]: its error as white noise [m/s per sqrt(s)], random
    walk of the circulation errors (wing, tail) [per sqrt(s)] and of the height [m per sqrt(s)]; tau, sigma [4]: correlation
    time [s] and stationary standard deviation of turbulence, slow wind [m/s], acceleration bias [m/s^2] and error of x [m]
    (first-order Gauss-Markov).
    """
    half = 0.5 * dt * dt
    for a in range(2):
        acc = (ay if a == 0 else az) - x[X_ACC + a]
        x[X_Y + a] += dt * x[X_VY + a] + half * acc
        x[X_VY + a] += dt * acc
        for j in range(N):
            P[X_Y + a, j] += dt * P[X_VY + a, j] - half * P[X_ACC + a, j]
            P[X_VY + a, j] -= dt * P[X_ACC + a, j]
        for i in range(N):
            P[i, X_Y + a] += dt * P[i, X_VY + a] - half * P[i, X_ACC + a]
            P[i, X_VY + a] -= dt * P[i, X_ACC + a]
    for w in range(4):
        phi = math.exp(-dt / tau[w])
        s2 = -math.expm1(-2.0 * dt / tau[w]) * sigma[w] * sigma[w]
        first = X_X if w == M_X else X_TURB + 3 * w
        for i in range(first, min(first + 3, N if w == M_X else X_X)):
            x[i] *= phi
            for j in range(N):
                P[i, j] *= phi
            for j in range(N):
                P[j, i] *= phi
            P[i, i] += s2
    qa = q[Q_ACC] * q[Q_ACC]
    for a in range(2):
        P[X_Y + a, X_Y + a] += qa * dt * dt * dt / 3.0
        P[X_Y + a, X_VY + a] += qa * dt * dt / 2.0
        P[X_VY + a, X_Y + a] += qa * dt * dt / 2.0
        P[X_VY + a, X_VY + a] += qa * dt
    for a in range(3):
        if P[X_KW + a, X_KW + a] > 0.0:
            P[X_KW + a, X_KW + a] += q[Q_KW + a] * q[Q_KW + a] * dt


@jit
def point_of(x: np.ndarray, p: np.ndarray) -> None:
    """p [10] <- point (P_*) of the state x [16]: circulation factors 1 + error, wind = turbulence + slow wind."""
    p[P_Y], p[P_Z], p[P_VY], p[P_VZ] = x[X_Y], x[X_Z], x[X_VY], x[X_VZ]
    p[P_KW], p[P_KT], p[P_H] = 1.0 + x[X_KW], 1.0 + x[X_KT], x[X_H]
    for a in range(3):
        p[P_W + a] = x[X_TURB + a] + x[X_SLOW + a]


@jit
def linearise(x: np.ndarray, g: np.ndarray, probes: np.ndarray, wk: np.ndarray, h: np.ndarray, H: np.ndarray) -> None:
    """h [9] <- expected readings (missions/receiver/airdata/expected.py) at state x [16]; H [9,16] <- their Jacobian."""
    p = np.empty(10)
    gx = g.copy()
    gx[G_X] += x[X_X]
    J = np.empty((M_READ, 9))
    point_of(x, p)
    expected(p, gx, probes, wk, True, h, J)
    for j in range(M_READ):
        H[j, X_X] = J[j, J_X]
        H[j, X_ACC] = H[j, X_ACC + 1] = 0.0
        H[j, X_Y], H[j, X_Z] = J[j, J_Y], J[j, J_Z]
        H[j, X_VY], H[j, X_VZ] = -J[j, J_W + 1], -J[j, J_W + 2]
        H[j, X_KW], H[j, X_KT], H[j, X_H] = J[j, J_KW], J[j, J_KT], J[j, J_H]
        for a in range(3):
            H[j, X_TURB + a] = J[j, J_W + a]
            H[j, X_SLOW + a] = J[j, J_W + a]
