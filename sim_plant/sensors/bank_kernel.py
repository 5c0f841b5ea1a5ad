"""Readings of all sensors of an aircraft that are due at a tick and as they should be, in one compiled call."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.jit import jit
from sim_plant.sensors.shape_kernel import (
    HEAD,
    K_AT,
    K_FORM,
    K_HOW,
    K_NEXT,
    K_WIDTH,
    LEVER,
    NODE_US,
    W_SIGN,
    entry,
    told,
)

Arr = NDArray[np.float64]
Ints = NDArray[np.int64]
# forms of a reading: none, the sensor is read by itself; truth and errors column by column; the same of the boom, without errors
# and with; a height, and the pressure there [Pa]; a quaternion turned by the errors; not below zero
APART, PLAIN, AT_BOOM_EXACT, AT_BOOM, HEIGHT, ATTITUDE, POSITIVE = -1, 0, 1, 2, 3, 4, 5
EXTRA = {HEIGHT: 1, ATTITUDE: 1}  # entries of a reading beyond its columns


@jit
def turn(
    q0: float, q1: float, q2: float, q3: float, e0: float, e1: float, e2: float
) -> tuple[float, float, float, float]:
    """Quaternion q followed by the rotation vector e [rad] about the body axes."""
    a = math.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
    f = 0.5 if a < 1e-9 else math.sin(0.5 * a) / a
    w, x, y, z = math.cos(0.5 * a), f * e0, f * e1, f * e2
    return (
        q0 * w - q1 * x - q2 * y - q3 * z,
        q0 * x + q1 * w + q2 * z - q3 * y,
        q0 * y - q1 * z + q2 * w + q3 * x,
        q0 * z + q1 * y - q2 * x + q3 * w,
    )


@jit
def readings(s: Arr, o: Arr, rel: Arr, boom: Arr, which: Ints, f: Arr, k: Ints, t_us: int, out: Arr) -> bool:
    """Readings of the sensors `which` of a store (`f`, `k`: rows.Store) into `out`, one behind the other.

    State `s` [NS], observation `o` [NO], motion relative to the leader and of whoever is at the boom, `rel` and `boom` [NR];
    t_us: time of now. False, and nothing done, when error rows have to be drawn first.
    """
    for j in which:
        if k[j, K_NEXT] >= f.shape[1] - HEAD and k[j, K_FORM] != AT_BOOM_EXACT:
            return False
    at, past = 0, t_us % NODE_US / NODE_US
    for j in which:
        form, m, i = k[j, K_FORM], k[j, K_WIDTH], k[j, K_NEXT]
        columns, row = k[j, K_AT : K_AT + m], out[at : at + m]
        at += m
        r = boom if form in (AT_BOOM, AT_BOOM_EXACT) else rel
        if form == AT_BOOM_EXACT:
            for c in range(m):
                row[c] = entry(s, o, r, columns[c])
            continue
        k[j, K_NEXT] = i + 1
        told(s, o, r, f[j, HEAD:], i, columns, f[j, :LEVER], f[j, LEVER], k[j, K_HOW], past, row)
        if form == ATTITUDE:
            out[at - 3], out[at - 2], out[at - 1], out[at] = turn(s[0], s[1], s[2], s[3], row[0], row[1], row[2])
            at += 1
            continue
        for c in range(m):
            row[c] += f[j, W_SIGN, c] * entry(s, o, r, columns[c])
        if form == HEIGHT:
            out[at] = isa(row[0])[1]
            at += 1
        elif form == POSITIVE:
            row[0] = row[0] if row[0] > 0.0 else 0.0
    return True
