"""Kernels of extent.py: gusts read at the places of an airframe, and their slopes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm
from sim_plant.wind.vortex import feel

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]
N_WING, N_FRAME = 3, 6


@jit
def met(ring: Arr, k: int, lag: float) -> V3:
    """Gust [m/s, NED] laid `lag` ticks before tick k, linear between ticks, within what the ring [m, 3] holds; lag < 0: ahead."""
    size = ring.shape[0]
    lag = min(float(size - 2), lag)
    i = math.floor(lag)
    f = lag - i
    a, b = (k - i) % size, (k - i - 1) % size
    return (
        ring[a, 0] + f * (ring[b, 0] - ring[a, 0]),
        ring[a, 1] + f * (ring[b, 1] - ring[a, 1]),
        ring[a, 2] + f * (ring[b, 2] - ring[a, 2]),
    )


@jit
def field_gusts(
    q: Arr, rings: Arr, k: int, lag: float, line: NDArray[np.int64], late: Arr, weight: Arr, wind: Arr, probe: Arr
) -> None:
    """Add to the effective wind [NW] the places' weighted gusts less the centre's, and their slopes; to probe [m, 3] the same
    difference at every probe.

    q attitude [4]; rings [lines, m, 3]; place i is on line[i], late[i] ticks behind the centre, which is `lag` behind tick k.
    weight [6, 3] as in extent.places: p = dWz/dy, q = -dWz/dx, r = dWy/dx, one slope per surface (lee.md E23).
    """
    _, c01, c02, _, c11, c12, _, c21, c22 = quat_dcm(q[0], q[1], q[2], q[3])
    g0, g1, g2 = met(rings[0], k, lag)
    for i in range(line.shape[0]):
        a, b, c = met(rings[line[i]], k, lag + late[i])
        a, b, c = a - g0, b - g1, c - g2
        if i >= N_FRAME:
            probe[i - N_FRAME, 0] += a
            probe[i - N_FRAME, 1] += b
            probe[i - N_FRAME, 2] += c
            continue
        wy = c01 * a + c11 * b + c21 * c
        wz = c02 * a + c12 * b + c22 * c
        feel(i, N_WING, weight, a, b, c, wy, wz, wind)


@jit
def filtered_gusts(q: Arr, ring: Arr, k: int, lag: float, p: float, c: Arr, slow: Arr, wind: Arr) -> None:
    """Add p [rad/s], and q and r by the lagged slopes of w and v, to the effective wind [NW].

    c [2, 4]: of q and of r: the lag's decay per tick, its weights of the last and the present value (exact for straight lines
    between ticks), 1/(tau V); slow [3, 3]: gust last met, and behind the lags of q and of r, NED, started on it: a turning
    airframe sees no slope in air that has none. In frozen air the rate met is V times the slope along x:
    q = -dWz/dx = -(w - slow)/(tau V), r = dWy/dx = (v - slow)/(tau V).
    """
    _, c01, c02, _, c11, c12, _, c21, c22 = quat_dcm(q[0], q[1], q[2], q[3])
    a, b, d = met(ring, k, lag)
    if math.isnan(slow[0, 0]):
        slow[:, 0], slow[:, 1], slow[:, 2] = a, b, d
    for i in range(2):
        e, last, now = c[i, 0], c[i, 1], c[i, 2]
        slow[1 + i, 0] = e * slow[1 + i, 0] + last * slow[0, 0] + now * a
        slow[1 + i, 1] = e * slow[1 + i, 1] + last * slow[0, 1] + now * b
        slow[1 + i, 2] = e * slow[1 + i, 2] + last * slow[0, 2] + now * d
    slow[0, 0], slow[0, 1], slow[0, 2] = a, b, d
    wind[n.W_ROT] += p
    wind[n.W_ROT + 1] -= (c02 * (a - slow[1, 0]) + c12 * (b - slow[1, 1]) + c22 * (d - slow[1, 2])) * c[0, 3]
    wind[n.W_ROT + 2] += (c01 * (a - slow[2, 0]) + c11 * (b - slow[2, 1]) + c21 * (d - slow[2, 2])) * c[1, 3]
