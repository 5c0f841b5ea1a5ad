"""Kinematics of air-relative velocity, wind and specific force, without an aerodynamic model (kernels).

State [12]: u (air-relative velocity, body axes) [m/s], wind NED [m/s], specific force in body axes [m/s^2], probe errors
(airspeed scale [-], beta and alpha offset [rad]). `hil_scripts.estimate.kinematic` says why in this form.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.linalg import solve

G0 = 9.80665  # [m/s^2]


@jit
def propagate(X: np.ndarray, E: np.ndarray, R0: np.ndarray, R1: np.ndarray, dt: float) -> None:
    """Points X [k,12] <- dt [s] later. E [9] turn of the body axes, R0, R1 [9] NED to body before and after.

    Half the acceleration, the exact turn of the axes, the other half (second order in dt).
    """
    h = 0.5 * dt
    g = G0 * h
    for s in range(X.shape[0]):
        x = X[s]
        f0, f1, f2 = x[6] * h, x[7] * h, x[8] * h
        u0, u1, u2 = x[0] + f0 + R0[2] * g, x[1] + f1 + R0[5] * g, x[2] + f2 + R0[8] * g
        x[0] = E[0] * u0 + E[1] * u1 + E[2] * u2 + f0 + R1[2] * g
        x[1] = E[3] * u0 + E[4] * u1 + E[5] * u2 + f1 + R1[5] * g
        x[2] = E[6] * u0 + E[7] * u1 + E[8] * u2 + f2 + R1[8] * g


@jit
def probe_matrix(u: np.ndarray, C: np.ndarray) -> None:
    """C [9] <- velocity error in body axes per unit airspeed scale, beta and alpha offset, at air velocity u [3] (body)."""
    h = max(math.sqrt(u[0] * u[0] + u[2] * u[2]), 1e-6)  # V cos(beta)
    t = u[1] / h
    C[0], C[3], C[6] = u[0], u[1], u[2]
    C[1], C[4], C[7] = -u[0] * t, h, -u[2] * t
    C[2], C[5], C[8] = -u[2], 0.0, u[0]


@jit
def measure(X: np.ndarray, R: np.ndarray, C: np.ndarray, codes: np.ndarray, m: int, Y: np.ndarray) -> None:
    """Y [k,:m] <- what the sensors `codes` [m] (0..2 air data, 3..5 ground velocity NED) read at points X [k,12].

    R [9] NED to body; C [9] probe-error matrix (`probe_matrix`).
    """
    for s in range(X.shape[0]):
        x = X[s]
        a0 = x[0] + C[0] * x[9] + C[1] * x[10] + C[2] * x[11]
        a1 = x[1] + C[3] * x[9] + C[4] * x[10] + C[5] * x[11]
        a2 = x[2] + C[6] * x[9] + C[7] * x[10] + C[8] * x[11]
        V = max(math.sqrt(a0 * a0 + a1 * a1 + a2 * a2), 1e-6)
        for j in range(m):
            c = codes[j]
            if c == 0:
                Y[s, j] = V
            elif c == 1:
                Y[s, j] = math.asin(max(-1.0, min(1.0, a1 / V)))
            elif c == 2:
                Y[s, j] = math.atan2(a2, a0)
            else:
                i = c - 3
                Y[s, j] = R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2] + x[c]


@jit_own
def published(
    x: np.ndarray, S: np.ndarray, prior: np.ndarray, share: np.ndarray, shown: np.ndarray, seen: np.ndarray, z: np.ndarray,
    P: np.ndarray,
) -> None:  # fmt: skip
    """z [9], P [9,9] <- mean and covariance of (u, wind, probe errors) where only probe errors the flight has shown are used.

    x [12], S [12,12] state and its factor; prior [3] start 1-sigma of the probe errors (0: not a state). shown [3] <- share of
    the prior's variance that is gone; seen [3] <- 1 for one that has reached share [3], and for good. The others are put back
    to N(0, prior^2): y given theta is y - G theta, G = P_yt P_tt^-1, so the rest is y - G theta_hat with the covariance
    P_yy - G P_ty + G prior^2 G^T. It is what a filter says that carries them as consider states (Bierman 1977, chapter VIII).
    """
    for i in range(9):
        a = i if i < 6 else i + 3
        z[i] = x[a]
        for j in range(i + 1):
            b = j if j < 6 else j + 3
            s = 0.0
            for k in range(min(a, b) + 1):
                s += S[a, k] * S[b, k]
            P[i, j] = s
            P[j, i] = s
    held = np.zeros(3, dtype=np.int64)
    m = 0
    for c in range(3):
        if prior[c] > 0.0:
            shown[c] = 1.0 - P[6 + c, 6 + c] / (prior[c] * prior[c])
            if shown[c] >= share[c]:
                seen[c] = 1
            if seen[c] == 0:
                held[m] = 6 + c
                m += 1
    if m == 0:
        return
    A, G = np.zeros((m, m)), np.zeros((m, 9))  # G^T = P_tt^-1 P_ty
    for a in range(m):
        for b in range(m):
            A[a, b] = P[held[a], held[b]]
        for j in range(9):
            G[a, j] = P[held[a], j]
    if not solve(A, G):
        return
    was = P.copy()
    for i in range(9):
        for a in range(m):
            z[i] -= G[a, i] * x[held[a] + 3]
        for j in range(9):
            for a in range(m):
                q = prior[held[a] - 6]
                P[i, j] += G[a, i] * (q * q * G[a, j] - was[held[a], j])
    for a in range(m):
        z[held[a]] = 0.0  # G is the unit matrix there, and what rounding leaves of it must not show
