"""International standard atmosphere as the onboard software knows it (troposphere and lower stratosphere)."""

from __future__ import annotations

import math

from flightsw.kernels.jit import jit

G0 = 9.80665  # [m/s^2]
R_AIR = 287.05287  # [J/(kg K)]
GAMMA = 1.4
T0 = 288.15  # [K]
P0 = 101325.0  # [Pa]
LAPSE = 0.0065  # [K/m]
H_TROP = 11000.0  # [m]


@jit
def temperature(h: float) -> float:
    """Static temperature [K] at geopotential altitude h [m], 0..20 km (ISO 2533)."""
    return T0 - LAPSE * min(h, H_TROP)


@jit
def density(h: float) -> float:
    """Air density [kg/m^3] at geopotential altitude h [m], 0..20 km (ISO 2533)."""
    t = T0 - LAPSE * min(h, H_TROP)
    p = P0 * math.pow(t / T0, G0 / (LAPSE * R_AIR))
    if h > H_TROP:
        p *= math.exp(-G0 * (h - H_TROP) / (R_AIR * t))
    return p / (R_AIR * t)


@jit
def sound_speed(h: float) -> float:
    """Speed of sound [m/s] at geopotential altitude h [m]."""
    return math.sqrt(GAMMA * R_AIR * temperature(h))
