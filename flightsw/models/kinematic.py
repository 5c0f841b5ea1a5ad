"""Kinematics of air-relative velocity, wind and specific force, without an aerodynamic model (kernels).

State [12]: u (air-relative velocity, body axes) [m/s], wind NED [m/s], specific force in body axes [m/s^2], probe errors
(airspeed scale [-], beta and alpha offset [rad]). `flightsw.nav.kinematic` says why in this form.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit

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
