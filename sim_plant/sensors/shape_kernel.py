"""What a sensor makes of the quantity it measures: lag, scale, misalignment, quantisation, place. Compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit

Arr = NDArray[np.float64]


@jit
def shaped(t: Arr, e: Arr, mat: Arr, lag: Arr, quantum: Arr, mem: Arr, fresh: Arr, out: Arr) -> None:
    """Write into `out` [m] what must be added to the true row `t` [m] so that the reading is Q(mat y + e).

    y: t through the lag y' = a y + b0 t' + b1 t with `lag` [m, 3] = (a, b0, b1); mat [m, m]: scale and misalignment;
    e [m]: additive errors; Q rounds to multiples of `quantum` [m] (0: not). mem [2, m] keeps y and t; fresh [1] = 1 before the
    first sample, which finds the lag settled.
    """
    m = t.shape[0]
    for i in range(m):
        if fresh[0] > 0.0:
            mem[0, i] = t[i]
        else:
            mem[0, i] = lag[i, 0] * mem[0, i] + lag[i, 1] * t[i] + lag[i, 2] * mem[1, i]
        mem[1, i] = t[i]
    fresh[0] = 0.0
    for i in range(m):
        x = e[i]
        for j in range(m):
            x += mat[i, j] * mem[0, j]
        if quantum[i] > 0.0:
            x = quantum[i] * math.floor(x / quantum[i] + 0.5)
        out[i] = x - t[i]


@jit
def lever_acc(w: Arr, last: Arr, period: float, r: Arr, row: Arr) -> None:
    """Add to row[3:6] the specific force at r [3, m] from the cg over that at it: w' x r + w x (w x r) [m/s^2].

    w [3, rad/s] of this sample, `last` [3] of the one before (NaN: none), replaced; w' is their difference over `period` [s].
    """
    d0 = d1 = d2 = 0.0
    if not math.isnan(last[0]):
        d0, d1, d2 = (w[0] - last[0]) / period, (w[1] - last[1]) / period, (w[2] - last[2]) / period
    last[0], last[1], last[2] = w[0], w[1], w[2]
    u0, u1, u2 = w[1] * r[2] - w[2] * r[1], w[2] * r[0] - w[0] * r[2], w[0] * r[1] - w[1] * r[0]
    row[3] += d1 * r[2] - d2 * r[1] + w[1] * u2 - w[2] * u1
    row[4] += d2 * r[0] - d0 * r[2] + w[2] * u0 - w[0] * u2
    row[5] += d0 * r[1] - d1 * r[0] + w[0] * u1 - w[1] * u0


@jit
def lever_gnss(s: Arr, r: Arr, row: Arr) -> None:
    """Add position C r [m] and velocity C (w x r) [m/s] of an antenna at r [3, m], body axes, to row[0:3] and row[3:6].

    s [7]: quaternion q_nb and body rates [rad/s]; C turns body to NED.
    """
    q0, q1, q2, q3 = s[0], s[1], s[2], s[3]
    for k in range(2):
        x, y, z = r[0], r[1], r[2]
        if k == 1:
            x, y, z = s[5] * r[2] - s[6] * r[1], s[6] * r[0] - s[4] * r[2], s[4] * r[1] - s[5] * r[0]
        row[3 * k] += (
            (1.0 - 2.0 * (q2 * q2 + q3 * q3)) * x + 2.0 * (q1 * q2 - q0 * q3) * y + 2.0 * (q1 * q3 + q0 * q2) * z
        )
        row[3 * k + 1] += (
            2.0 * (q1 * q2 + q0 * q3) * x + (1.0 - 2.0 * (q1 * q1 + q3 * q3)) * y + 2.0 * (q2 * q3 - q0 * q1) * z
        )
        row[3 * k + 2] += (
            2.0 * (q1 * q3 - q0 * q2) * x + 2.0 * (q2 * q3 + q0 * q1) * y + (1.0 - 2.0 * (q1 * q1 + q2 * q2)) * z
        )
