"""Random microbursts for the survival studies, and light turbulence."""

from __future__ import annotations

import math

from sim_plant.aircraft.twinjet.flight import TwinJetAir, TwinJetParams
from sim_plant.rng import generator
from sim_plant.wind.microburst import Microburst

LIGHT = (1.07, 0.77)  # [m/s] along, up: MIL-F-8785C, 15 kn at 20 ft, at 100 m
CORE_M = (30.0, 220.0)  # height at which the slope crosses the axis
CLASSES = (("low", 0.0, 0.3), ("middle", 0.3, 0.45), ("high", 0.45, math.inf))  # peak F of the continued approach


def draw(seed: int) -> tuple[Microburst, TwinJetParams]:
    """Microburst and start height of run `seed`: radius 500-1500 m, outflow 16-36 m/s at 30-100 m, axis up to 300 m aside."""
    g = generator(seed % 2**31, "jing.microburst")
    radius, outflow, top, aside, core = (
        g.uniform(500.0, 1500.0), g.uniform(16.0, 36.0), g.uniform(30.0, 100.0), g.uniform(0.0, 300.0), g.uniform(*CORE_M),
    )  # fmt: skip
    start = TwinJetParams()
    height = core - start.x_m * math.tan(math.radians(start.slope_deg))
    return Microburst(outflow, radius, top, 0.0, aside), TwinJetParams(height_m=height)


def air(burst: Microburst, turbulence: tuple[float, float]) -> TwinJetAir:
    """The burst with turbulence of these standard deviations along and up [m/s]."""
    return TwinJetAir(burst, *turbulence)


def class_of(peak_F: float) -> str:
    """Name of the class of a peak F."""
    return next(name for name, lo, hi in CLASSES if lo <= peak_F < hi or (lo == 0.0 and peak_F < hi))
