"""Control-surface servo: second order, rate limited, travel limited."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit
from sim_plant.kernels.layout import C_JAM, C_SURF, P_HI, P_LO, P_RATE, P_WN, P_ZETA, S_RATE, S_SURF


@jit
def servo_step(s: NDArray[np.float64], c: NDArray[np.float64], par: NDArray[np.float64], h: float) -> None:
    """Advance the three servos in `s` by h [s] towards the commands `c` [rad], in place.

    x'' = wn^2 (command - x) - 2 zeta wn x' is stepped with its exact transition matrix (zeta < 1); then position change
    and rate are cut to the rate limit and the position to the travel, where the rate becomes zero.
    """
    wn, z = par[P_WN], par[P_ZETA]
    wd = wn * math.sqrt(1.0 - z * z)
    e = math.exp(-z * wn * h)
    cs, sn = e * math.cos(wd * h), e * math.sin(wd * h)
    f11, f12 = cs + z * wn / wd * sn, sn / wd
    f21, f22 = -wn * wn / wd * sn, cs - z * wn / wd * sn
    for i in range(3):
        if c[C_JAM + i] > 0.5:
            s[S_RATE + i] = 0.0
            continue
        lo, hi, lim = par[P_LO + i], par[P_HI + i], par[P_RATE + i]
        cmd = min(hi, max(lo, c[C_SURF + i]))
        x0, v0 = s[S_SURF + i] - cmd, s[S_RATE + i]
        x = s[S_SURF + i] + min(lim * h, max(-lim * h, f11 * x0 + f12 * v0 - x0))
        v = min(lim, max(-lim, f21 * x0 + f22 * v0))
        if x < lo or x > hi:
            x, v = min(hi, max(lo, x)), 0.0
        s[S_SURF + i], s[S_RATE + i] = x, v
