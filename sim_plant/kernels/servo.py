"""Control-surface servo: second order, rate limited, travel limited."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit
from sim_plant.kernels.layout import C_JAM, C_SURF, P_HI, P_LO, P_RATE, P_WN, P_ZETA, S_RATE, S_SURF


@jit
def transition(par: NDArray[np.float64], h: float) -> tuple[float, float, float, float]:
    """Exact transition matrix (row-major) of x'' = -wn^2 x - 2 zeta wn x' over h [s]; zeta < 1."""
    wn, z = par[P_WN], par[P_ZETA]
    wd = wn * math.sqrt(1.0 - z * z)
    e = math.exp(-z * wn * h)
    cs, sn = e * math.cos(wd * h), e * math.sin(wd * h)
    return cs + z * wn / wd * sn, sn / wd, -wn * wn / wd * sn, cs - z * wn / wd * sn


@jit
def servo_move(
    s: NDArray[np.float64],
    c: NDArray[np.float64],
    par: NDArray[np.float64],
    h: float,
    f11: float,
    f12: float,
    f21: float,
    f22: float,
) -> None:
    """`servo_step` with the transition over h [s] worked out."""
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


@jit
def servo_step(s: NDArray[np.float64], c: NDArray[np.float64], par: NDArray[np.float64], h: float) -> None:
    """Advance the three servos in `s` by h [s] towards the commands `c` [rad], in place.

    x'' = wn^2 (command - x) - 2 zeta wn x' is stepped with its exact transition matrix (zeta < 1); then position change
    and rate are cut to the rate limit and the position to the travel, where the rate becomes zero.
    """
    f11, f12, f21, f22 = transition(par, h)
    servo_move(s, c, par, h, f11, f12, f21, f22)
