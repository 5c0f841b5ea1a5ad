"""Turbulence levels by name: intensity and scale length against height. Sources and equations: docs/air.md 1, 2.

MIL-F-8785C: figure 7 (intensity by probability of exceedance), 3.7.2.1 (lengths above 2000 ft), figures 10 and 11 (below 1000
ft).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FT, KNOT = 0.3048, 0.514444  # [m], [m/s]
LOW_FT, HIGH_FT, FLOOR_FT = (
    1000.0,
    2000.0,
    10.0,
)  # [ft] the low model ends, the high one begins, the low one is held below
LENGTH_FT = {"dryden": 1750.0, "von_karman": 2500.0}  # [ft] scale length above HIGH_FT
SPECTRA = tuple(LENGTH_FT)
# figure 7 as tabulated in JSBSim 1.3 (FGWinds): heights [ft], 1-sigma [ft/s]
HEIGHTS_FT = (500.0, 1750.0, 3750.0, 7500.0, 15e3, 25e3, 35e3, 45e3, 55e3, 65e3, 75e3, 80e3)
Arr = NDArray[np.float64]


@dataclass(frozen=True)
class Level:
    """One named level: wind [kt] 20 ft above the ground, probability that figure 7's intensity [ft/s] is exceeded."""

    wind_20_kt: float
    exceeded: float
    sigma_fps: tuple[float, ...]


LEVELS = {
    "light": Level(15.0, 1e-2, (6.6, 6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0)),
    "moderate": Level(30.0, 1e-3, (8.6, 9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0.0, 0.0, 0.0)),
    "severe": Level(45.0, 1e-5, (15.6, 17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9, 6.2, 5.1)),
}


def low(h_ft: float, wind_20_kt: float) -> tuple[float, float, float, float]:
    """Horizontal and vertical intensity [m/s], horizontal and vertical length [m] below 1000 ft (3.7.3.2, 3.7.3.4)."""
    h = max(h_ft, FLOOR_FT)
    shape = 0.177 + 0.000823 * h
    w = 0.1 * wind_20_kt * KNOT
    return w / shape**0.4, w, FT * h / shape**1.2, FT * h


def strength(level: str, spectrum: str, height_m: float) -> tuple[Arr, Arr]:
    """Intensities [3] (m/s) and scale lengths [3] (m) of u, v, w at a height [m]; linear between 1000 and 2000 ft."""
    lev, h = LEVELS[level], height_m / FT
    out = np.zeros(4)  # horizontal and vertical intensity, horizontal and vertical length
    if h < HIGH_FT:
        out[:] = low(min(h, LOW_FT), lev.wind_20_kt)
    if h > LOW_FT:
        sigma = FT * float(np.interp(max(h, HIGH_FT), HEIGHTS_FT, lev.sigma_fps))
        length = FT * LENGTH_FT[spectrum]
        out += min(1.0, (h - LOW_FT) / (HIGH_FT - LOW_FT)) * (np.array([sigma, sigma, length, length]) - out)
    return out[[0, 0, 1]], out[[2, 2, 3]]
