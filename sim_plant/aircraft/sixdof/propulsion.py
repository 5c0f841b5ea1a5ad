"""Thrust available against altitude and Mach number: turbofan formula or a table of the engine's data."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.atmosphere import RHO0
from sim_plant.kernels.jit import jit
from sim_plant.kernels.layout import P_LAPSE, P_NH, P_NI, P_NM, P_T0, P_TABLES


@jit
def bracket(par: NDArray[np.float64], at: int, n: int, x: float) -> tuple[int, float]:
    """Index i and fraction f in [0, 1] of x in the ascending table par[at:at+n]; end values held outside."""
    if n < 2 or x <= par[at]:
        return 0, 0.0
    if x >= par[at + n - 1]:
        return n - 2, 1.0
    i = 0
    while x > par[at + i + 1]:
        i += 1
    return i, (x - par[at + i]) / (par[at + i + 1] - par[at + i])


@jit
def thrust_available(h: float, mach: float, rho: float, par: NDArray[np.float64]) -> float:
    """Greatest thrust [N] of all engines at height h [m], Mach number, air density rho [kg/m^3].

    "bypass": T0 (0.568 + 0.25 (1.2 - M)^3) sigma^0.6 (Mattingly, high-bypass turbofan form); "table": bilinear in
    Mach and height, end values held. `par` is the aircraft's parameter vector (layout.py).
    """
    if par[P_LAPSE] < 0.5:
        t0: float = par[P_T0]
        return t0 * (0.568 + 0.25 * (1.2 - mach) ** 3) * math.pow(rho / RHO0, 0.6)
    nm, nh = int(par[P_NM]), int(par[P_NH])
    at_m = P_TABLES + 5 * int(par[P_NI])
    at_h = at_m + nm
    at_f = at_h + nh
    i, fm = bracket(par, at_m, nm, mach)
    j, fh = bracket(par, at_h, nh, h)
    a, b = at_f + i * nh + j, at_f + (i + 1) * nh + j
    lo: float = par[a] + fh * (par[a + 1] - par[a])
    hi: float = par[b] + fh * (par[b + 1] - par[b])
    frac = lo + fm * (hi - lo)
    out: float = par[P_T0] * frac
    return out
