"""US Standard Atmosphere 1976, 0 to 20 km geopotential height."""

from __future__ import annotations

import math

from sim_plant.kernels.jit import jit

T0, P0, LAPSE, R_AIR, GAMMA, G0 = 288.15, 101325.0, 0.0065, 287.053, 1.4, 9.80665  # SI, the Standard's constants
H_TROP, T_TROP, RHO0 = 11000.0, 216.65, P0 / (R_AIR * T0)
P_TROP = P0 * (T_TROP / T0) ** (G0 / (LAPSE * R_AIR))


@jit
def isa(h: float) -> tuple[float, float, float, float]:
    """Temperature [K], pressure [Pa], density [kg/m^3], speed of sound [m/s] at geopotential height h [m].

    Hydrostatic equation with 6.5 K/km up to 11 km, isothermal above (US Standard Atmosphere 1976, eqs. 33a, 33b, 50).
    """
    if h < H_TROP:
        t = T0 - LAPSE * h
        p = P0 * math.pow(t / T0, G0 / (LAPSE * R_AIR))
    else:
        t = T_TROP
        p = P_TROP * math.exp(-G0 * (h - H_TROP) / (R_AIR * T_TROP))
    return t, p, p / (R_AIR * t), math.sqrt(GAMMA * R_AIR * t)


@jit
def pressure_altitude(p: float) -> float:
    """Height [m] at which the standard atmosphere has static pressure p [Pa]; inverse of `isa`."""
    if p > P_TROP:
        return T0 / LAPSE * (1.0 - math.pow(p / P0, LAPSE * R_AIR / G0))
    return H_TROP - R_AIR * T_TROP / G0 * math.log(p / P_TROP)
