"""Wind along the flight path from kinematics alone: measured accelerations and pitch rate are inputs, no forces are modelled.

State x [10]: h [m], velocity along x and up [m/s], theta [rad], w_x, w_h [m/s], their first and second rates. Input a [3]:
accelerations along x and up [m/s^2], pitch rate [rad/s].
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit

(K_H, K_VX, K_VH, K_TH, K_WX, K_WH, K_WXD, K_WHD, K_WXDD, K_WHDD, NK) = range(11)
MOTION = slice(K_H, K_WX)  # what the inputs drive
(A_X, A_H, A_Q) = range(3)
(Z_H, Z_VG, Z_VA, Z_AL, Z_TH, Z_HD, NZ) = range(7)


@jit
def propagate_kinematic(XX: np.ndarray, a: np.ndarray, dt: float) -> None:
    """Advance every row of XX [k,10] by dt [s] in place; exact for constant input a [3] and constant second rates of the wind."""
    for r in range(XX.shape[0]):
        x = XX[r]
        x[K_H] += dt * (x[K_VH] + 0.5 * dt * a[A_H])
        x[K_VX] += dt * a[A_X]
        x[K_VH] += dt * a[A_H]
        x[K_TH] += dt * a[A_Q]
        for i in range(2):
            x[K_WX + i] += dt * (x[K_WXD + i] + 0.5 * dt * x[K_WXDD + i])
            x[K_WXD + i] += dt * x[K_WXDD + i]


@jit
def measure_kinematic(XX: np.ndarray, codes: np.ndarray, m: int, Y: np.ndarray) -> None:
    """Y [k,>=m] <- the m channels `codes` (Z_H ..) of every row of XX [k,10]: h, ground speed, Va, alpha, theta, h'."""
    for r in range(XX.shape[0]):
        x = XX[r]
        vx, vh = x[K_VX] - x[K_WX], x[K_VH] - x[K_WH]
        for j in range(m):
            c = codes[j]
            v = x[K_VH]
            if c == Z_H:
                v = x[K_H]
            elif c == Z_VG:
                v = x[K_VX]
            elif c == Z_VA:
                v = math.sqrt(vx * vx + vh * vh)
            elif c == Z_AL:
                v = x[K_TH] - math.atan2(vh, vx)
            elif c == Z_TH:
                v = x[K_TH]
            Y[r, j] = v
