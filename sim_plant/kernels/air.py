"""The air at a height as the plant's aircraft meet it: the standard's, or with the temperature of an ascent."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import GAMMA, R_AIR, isa
from sim_plant.kernels.jit import jit


@jit
def air(h: float, par: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Temperature [K], pressure [Pa], density [kg/m^3], speed of sound [m/s] at geopotential height h [m].

    With an ascent in `par` (P_WARM heights [m], ascending, then as many degrees [K] warmer than the standard; linear between, the
    ends held) temperature is the ascent's at the standard's pressure: density p/(R T). docs/air.md 6.
    """
    t, p, rho, a = isa(h)
    m = int(par[n.P_WARM])
    if m == 0:
        return t, p, rho, a
    at = int(par[n.P_WARM_AT])
    lo, hi = 0, m - 1
    if h <= par[at]:
        t += par[at + m]
    elif h >= par[at + hi]:
        t += par[at + m + hi]
    else:
        while hi - lo > 1:
            mid = (lo + hi) // 2
            if par[at + mid] <= h:
                lo = mid
            else:
                hi = mid
        f = (h - par[at + lo]) / (par[at + hi] - par[at + lo])
        t += par[at + m + lo] + f * (par[at + m + hi] - par[at + m + lo])
    return t, p, p / (R_AIR * t), math.sqrt(GAMMA * R_AIR * t)
