"""Readings of all sensors of an aircraft that are due at a tick and as they should be, in one compiled call."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
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
    told,
)

Arr = NDArray[np.float64]
Ints = NDArray[np.int64]
# forms of a reading: none, the sensor is read by itself; truth and errors column by column; the same of the boom, without errors
# and with; a height, and the pressure there [Pa]; a quaternion turned by the errors; not below zero
APART, PLAIN, AT_BOOM_EXACT, AT_BOOM, HEIGHT, ATTITUDE, POSITIVE = -1, 0, 1, 2, 3, 4, 5
PAIR = n.NS + n.NO  # where relative motion lies in what a column is read from (shape_kernel.entry)
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
def reading(s: Arr, o: Arr, rel: Arr, boom: Arr, j: int, f: Arr, k: Ints, past: float, out: Arr, at: int) -> int:
    """Reading of sensor j of a store (`f`, `k`: rows.Store) into `out` from `at` on; where the next one begins.

    State `s` [NS], observation `o` [NO], motion relative to the leader and of whoever is at the boom, `rel` and `boom` [NR];
    past: share of the way from the sky before to the one after. Its next error row is used up.
    """
    form, m, i, end = k[j, K_FORM], k[j, K_WIDTH], k[j, K_NEXT], at + k[j, K_WIDTH]
    if form == AT_BOOM_EXACT:
        for c in range(m):
            out[at + c] = boom[k[j, K_AT + c] - PAIR]
        return end
    k[j, K_NEXT] = i + 1
    if k[j, K_HOW]:
        columns, r = k[j, K_AT : K_AT + m], boom if form == AT_BOOM else rel
        told(s, o, r, f[j, HEAD:], i, columns, f[j, :LEVER], f[j, LEVER], k[j, K_HOW], past, out[at:end])
    else:  # `told` without its doings
        for c in range(m):
            out[at + c] = f[j, HEAD + i, c]
    if form == ATTITUDE:
        out[at], out[at + 1], out[at + 2], out[end] = turn(s[0], s[1], s[2], s[3], out[at], out[at + 1], out[at + 2])
        return end + 1
    for c in range(m):
        a, x = k[j, K_AT + c], 0.0  # `entry`, whose call takes longer than what it does
        if a >= PAIR:
            x = boom[a - PAIR] if form == AT_BOOM else rel[a - PAIR]
        elif a >= n.NS:
            x = o[a - n.NS]
        elif a >= 0:
            x = s[a]
        out[at + c] += f[j, W_SIGN, c] * x
    if form == HEIGHT:
        out[end] = isa(out[at])[1]
        return end + 1
    if form == POSITIVE:
        out[at] = out[at] if out[at] > 0.0 else 0.0
    return end


@jit
def used_up(which: Ints, f: Arr, k: Ints) -> bool:
    """Whether one of the sensors `which` of a store needs error rows drawn before it can be read."""
    some = False
    for j in which:
        some |= k[j, K_NEXT] >= f.shape[1] - HEAD and k[j, K_FORM] != AT_BOOM_EXACT
    return some


@jit
def readings(s: Arr, o: Arr, rel: Arr, boom: Arr, which: Ints, f: Arr, k: Ints, t_us: int, out: Arr) -> bool:
    """`reading` of the sensors `which` at t_us, one behind the other. False, and nothing done, when error rows have to be drawn
    first."""
    if used_up(which, f, k):
        return False
    past = t_us % NODE_US / NODE_US
    at: int = np.int64(0)  # type: ignore[assignment]  # a plain 0 is a constant to be compiled for
    for j in which:
        at = reading(s, o, rel, boom, j, f, k, past, out, at)
    return True
