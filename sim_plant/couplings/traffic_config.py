"""[track] and [traffic] of a scenario: where two aircraft meet, and a receiver without onboard software."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range
from sim_plant.sensors.config import NonNeg

KN = 1852.0 / 3600.0
FT = 0.3048
Pos = Annotated[float, Range(1e-9)]


@dataclass(frozen=True)
class Track:
    """Where they meet: control point and direction to the initial point (the refuelling track, reversed)."""

    north_m: float = 0.0
    east_m: float = 0.0
    heading_deg: float = 0.0  # of +x, clockwise from north


@dataclass(frozen=True)
class TrafficCfg:
    """[traffic]: one receiver of the population. Defaults: rivard.md section 4."""

    on: bool = False
    name: str = "traffic"  # what `tacan_to` says
    sysid: Annotated[int, Range(1, 250)] = 2  # of its TRUTH
    V_mps: Pos = 396.0 * KN  # planned airspeed
    alt_m: Pos = 7010.0 - 1000.0 * FT
    x_m: float = 30.0 * 1852.0  # [m] first position
    y_m: float = 0.0  # [m] where the crew sees it; it is there give or take y_sigma_m
    y_sigma_m: NonNeg = 1852.0
    velocity_sigma_mps: NonNeg = 6.0 * KN  # constant part, along track
    fluctuation_sigma_mps: NonNeg = 10.0 * KN
    fluctuation_tau_s: Pos = 455.0
    drift_sigma_mps: NonNeg = 0.55 * math.sqrt(2.0) * KN  # across track
    walk_m2ps: NonNeg = (500.0 * FT) ** 2 / 600.0
    altitude_sigma_m: NonNeg = 150.0 * FT
    # what nobody has planned, both from manoeuvre_at_s on
    manoeuvre_at_s: NonNeg = 0.0
    turn_deg: float = 0.0  # to the left
    turn_rate_degps: Pos = 1.5
    speed_change_mps: float = 0.0
    speed_accel_mps2: Pos = 0.5
