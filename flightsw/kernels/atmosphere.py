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
def pressure(h: float) -> float:
    """Static pressure [Pa] at geopotential altitude h [m], 0..20 km (ISO 2533)."""
    t = T0 - LAPSE * min(h, H_TROP)
    p = P0 * math.pow(t / T0, G0 / (LAPSE * R_AIR))
    if h > H_TROP:
        p *= math.exp(-G0 * (h - H_TROP) / (R_AIR * t))
    return p


@jit
def density(h: float) -> float:
    """Air density [kg/m^3] at geopotential altitude h [m], 0..20 km (ISO 2533)."""
    return pressure(h) / (R_AIR * temperature(h))


@jit
def sound_speed(h: float) -> float:
    """Speed of sound [m/s] at geopotential altitude h [m]."""
    return math.sqrt(GAMMA * R_AIR * temperature(h))


@jit
def calibrated_airspeed(V: float, h: float) -> float:
    """Calibrated airspeed [m/s] at true airspeed V [m/s], subsonic, and pressure altitude h [m] in the standard temperature.

    The impact pressure p ((1 + (g - 1) M^2 / 2)^(g / (g - 1)) - 1) of compressible flow, read off as a speed at sea level
    (Saint-Venant; FAA AC 23-8C, appendix 9; Anderson, Introduction to Flight, section 4.12).
    """
    k = GAMMA / (GAMMA - 1.0)
    M = V / sound_speed(h)
    q = pressure(h) * (math.pow(1.0 + 0.5 * (GAMMA - 1.0) * M * M, k) - 1.0)
    return sound_speed(0.0) * math.sqrt(2.0 / (GAMMA - 1.0) * (math.pow(q / P0 + 1.0, 1.0 / k) - 1.0))
