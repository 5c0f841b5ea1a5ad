"""State of the wake-position filter: layout, motion over a step, and expected readings with their Jacobian.

State [28] (X_*), covariance [28,28]; a state that is not there has a zero row and column and no process noise. One that is
considered (fixed [28] not zero) keeps its value while its uncertainty and what depends on it are carried on (Schmidt 1966).
Source: sevil.md 8.4, 8.5; probe-offsets.md 1, 2.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.covariance import chol_psd
from flightsw.kernels.jit import jit, jit_own
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
# in y and z [m/s^2], true less given x [m], offsets of the nine readings [m/s, rad], slow error of a position sensor that aids
# in y and z [m], passing error of the wing's lift [-]
X_Y, X_Z, X_VY, X_VZ, X_KW, X_KT, X_H, X_TURB, X_SLOW, X_ACC, X_X = 0, 1, 2, 3, 4, 5, 6, 7, 10, 13, 15
X_OFF, X_AID, X_LIFT = 16, 25, 27
N = 28
PLACE, SPEED, LEARNT = slice(X_Y, X_VY), slice(X_VY, X_KW), slice(X_KW, X_TURB)
TURB, SLOW, OFFSETS, AID = slice(X_TURB, X_SLOW), slice(X_SLOW, X_ACC), slice(X_OFF, X_AID), slice(X_AID, X_LIFT)
# what one filter learns and another goes by: circulations, height, offsets
N_TAUGHT = X_TURB - X_KW + M_READ
TAUGHT = np.array([*range(X_KW, X_TURB), *range(X_OFF, X_AID)])
# Gauss-Markov processes `tau`, `sigma` [6]: turbulence, slow wind, bias of the acceleration, error of x, of the aid, of the lift;
# noises `q` [7]: acceleration, the random walks of LEARNT, of the offsets of V, beta, alpha
M_TURB, M_SLOW, M_ACC, M_X, M_AID, M_LIFT = 0, 1, 2, 3, 4, 5
GM_FIRST, GM_END = (X_TURB, X_SLOW, X_ACC, X_X, X_AID, X_LIFT), (X_SLOW, X_ACC, X_X, X_OFF, X_LIFT, N)
Q_ACC, Q_KW, Q_OFF = 0, 1, 4


@jit
def propagate(
    x: np.ndarray, P: np.ndarray, ay: float, az: float, dt: float, q: np.ndarray, tau: np.ndarray, sigma: np.ndarray
) -> None:
    """State x [28] and covariance P [28,28] carried over dt [s], in place (exact discretisation).

    ay, az [m/s^2, F] own acceleration relative to the tanker; q [7]: its error as white noise [m/s per sqrt(s)], random
    walk of the circulation errors (wing, tail) [per sqrt(s)], of the height [m per sqrt(s)], of the offsets of V, beta, alpha
    [m/s, rad per sqrt(s)]; tau, sigma [6]: correlation time [s] and stationary standard deviation of turbulence, slow wind
    [m/s], acceleration bias [m/s^2], error of x and of an aiding position [m], of the lift [-] (first-order Gauss-Markov).
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
    for w in range(6):
        phi = math.exp(-dt / tau[w])
        s2 = -math.expm1(-2.0 * dt / tau[w]) * sigma[w] * sigma[w]
        for i in range(GM_FIRST[w], GM_END[w]):
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
    for j in range(M_READ):
        if P[X_OFF + j, X_OFF + j] > 0.0:
            P[X_OFF + j, X_OFF + j] += q[Q_OFF + j // 3] * q[Q_OFF + j // 3] * dt


@jit
def point_of(x: np.ndarray, p: np.ndarray) -> None:
    """p [10] <- point (P_*) of the state x [28]: circulation factors 1 + error, wind = turbulence + slow wind."""
    p[P_Y], p[P_Z], p[P_VY], p[P_VZ] = x[X_Y], x[X_Z], x[X_VY], x[X_VZ]
    p[P_KW], p[P_KT], p[P_H] = 1.0 + x[X_KW] + x[X_LIFT], 1.0 + x[X_KT], x[X_H]
    for a in range(3):
        p[P_W + a] = x[X_TURB + a] + x[X_SLOW + a]


@jit_own
def linearise(x: np.ndarray, g: np.ndarray, probes: np.ndarray, wk: np.ndarray, h: np.ndarray, H: np.ndarray) -> None:
    """h [9] <- expected readings (missions/receiver/airdata/expected.py) at state x [28]; H [9,28] <- their Jacobian."""
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
        for i in range(X_OFF, N):
            H[j, i] = 0.0
        H[j, X_OFF + j] = 1.0
        H[j, X_LIFT] = J[j, J_KW]
        h[j] += x[X_OFF + j]


@jit_own
def be_taught(x: np.ndarray, P: np.ndarray, what: np.ndarray, covariance: np.ndarray) -> None:
    """State x [28], P [28,28], whose states TAUGHT are considered, take over what another filter has made of these since: values
    what [12], their covariance [12,12].

    The rest follows by how it depends on them, X = P_ra A^-1 with A the covariance so far: x_r += X (what - a), P_rr += X
    (covariance - A) X^T, P_ra = X covariance. Exact where the other has only learnt more (probe-offsets.md 2).
    """
    m = N_TAUGHT
    A, L, X, D, w = np.empty((m, m)), np.zeros((m, m)), np.zeros((N, m)), np.empty((N, m)), np.empty(m)
    taught = np.zeros(N, dtype=np.int64)
    for a in range(m):
        taught[TAUGHT[a]] = 1
        for b in range(m):
            A[a, b] = P[TAUGHT[a], TAUGHT[b]]
    chol_psd(A, m, L)
    for r in range(N):
        if taught[r] != 0:
            continue
        for a in range(m):  # forward, then back; what is known exactly has no part in it
            v = P[r, TAUGHT[a]]
            for b in range(a):
                v -= L[a, b] * w[b]
            w[a] = v / L[a, a] if L[a, a] > 0.0 else 0.0
        for a in range(m - 1, -1, -1):
            v = w[a]
            for b in range(a + 1, m):
                v -= L[b, a] * X[r, b]
            X[r, a] = v / L[a, a] if L[a, a] > 0.0 else 0.0
        for a in range(m):
            x[r] += X[r, a] * (what[a] - x[TAUGHT[a]])
    for r in range(N):
        for a in range(m):
            v = 0.0
            for b in range(m):
                v += X[r, b] * (covariance[b, a] - A[b, a])
            D[r, a] = v
    for r in range(N):
        if taught[r] != 0:
            continue
        for c in range(r + 1):
            if taught[c] != 0:
                continue
            v = 0.0
            for a in range(m):
                v += D[r, a] * X[c, a]
            P[r, c] += v
            P[c, r] = P[r, c]
        for a in range(m):
            v = 0.0
            for b in range(m):
                v += X[r, b] * covariance[b, a]
            P[r, TAUGHT[a]] = v
            P[TAUGHT[a], r] = v
    for a in range(m):
        x[TAUGHT[a]] = what[a]
        for b in range(m):
            P[TAUGHT[a], TAUGHT[b]] = covariance[a, b]
