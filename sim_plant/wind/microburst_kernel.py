"""Steady axisymmetric downburst over flat ground, in a vertical plane at a lateral distance from its axis.

Oseguera and Bowles, NASA TM-100632 (1988): velocity shaped in radius by a Gaussian downdraft and in height by two exponentials;
it satisfies continuity and vanishes at the ground. Positive along x: tail wind for flight along x; positive up.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit

Arr = NDArray[np.float64]
# parameters: axis position [m], lateral distance of the flight plane [m], radius [m], strength [1/s], heights [m]
M_X, M_Y, M_R, M_RATE, M_OUT, M_LAYER, NM = 0, 1, 2, 3, 4, 5, 6
SMALL = 1e-4  # [-] squared radius ratio below which the radial shape is summed as a series: it is regular on the axis


@jit
def radial(s: float) -> tuple[float, float]:
    """(1 - exp(-s))/s and its derivative at s = (r/R)^2 >= 0."""
    if s < SMALL:
        return 1.0 + s * (-0.5 + s / 6.0), -0.5 + s * (1.0 / 3.0 - s / 8.0)
    fall = math.exp(-s)
    return (1.0 - fall) / s, (fall * (1.0 + s) - 1.0) / (s * s)


@jit
def wind(x: float, h: float, m: Arr, out: Arr) -> None:
    """out [6] <- wind along x and up [m/s] at x, h [m], then its slopes [1/s]: along/dx, along/dh, up/dx, up/dh.

    m [NM]. Below the ground the air of the ground is given.
    """
    if m[M_RATE] == 0.0:
        for i in range(6):
            out[i] = 0.0
        return
    z = max(h, 0.0)
    dx, radius = x - m[M_X], m[M_R]
    s = (dx * dx + m[M_Y] * m[M_Y]) / (radius * radius)
    shape, slope = radial(s)
    core = math.exp(-s)
    upper, lower = math.exp(-z / m[M_OUT]), math.exp(-z / m[M_LAYER])
    profile = upper - lower
    bend = lower / m[M_LAYER] - upper / m[M_OUT]
    depth = m[M_OUT] * (1.0 - upper) - m[M_LAYER] * (1.0 - lower)
    half = 0.5 * m[M_RATE]
    out[0] = half * dx * shape * profile
    out[1] = -m[M_RATE] * core * depth
    out[2] = half * profile * (shape + 2.0 * dx * dx / (radius * radius) * slope)
    out[3] = half * dx * shape * bend
    out[4] = 2.0 * m[M_RATE] * core * dx / (radius * radius) * depth
    out[5] = -m[M_RATE] * core * profile
