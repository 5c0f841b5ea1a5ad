"""Approach and escape of the jet transport in wind shear: from the estimate to a demand on the flight path. When the approach is
given up: hazard.py. Laws: jing.md 3.4, 6.3, 7.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import engine_out as single
from flightsw.missions.windshear.hazard import Hazard, HazardParams, HazardState
from flightsw.missions.windshear.model import PathDemand
from flightsw.plugins import EVERY_KEY, OursOr
from flightsw.strict import IN_FLIGHT, OneOf, Range

Array = np.ndarray
LAWS = ("managed", "pitch", "climb", "open", "continue")
PHASES = ("approach", "caution", "escape", "clear")
LEAST_TARGET_M = 10.0


@dataclass(frozen=True)
class ApproachParams:
    """Descent along the slope: climb rate from the slope and the height error, airspeed from the ground speed wanted."""

    slope_deg: Annotated[float, Range(1.0, 8.0)] = 3.0
    gain_1ps: Annotated[float, Range(0.01, 2.0), IN_FLIGHT] = 0.25
    climb_min_mps: Annotated[float, Range(-20.0, 0.0), IN_FLIGHT] = -9.0
    climb_max_mps: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 4.0
    ground_mps: Annotated[float, Range(40.0, 120.0), IN_FLIGHT] = 75.0
    speed_min_mps: Annotated[float, Range(40.0, 120.0)] = 75.0
    speed_max_mps: Annotated[float, Range(40.0, 140.0)] = 83.0
    caution_speed_mps: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 8.0  # added while caution is on
    alpha_max_rad: Annotated[float, Range(0.1, 0.25)] = 0.20


@dataclass(frozen=True)
class EscapeParams:
    """Escape law and its numbers. target_m is a height above ground: terrain clearance is the operator's to set."""

    law: Annotated[str, OneOf(LAWS)] = "managed"
    pitch_deg: Annotated[float, Range(5.0, 25.0), IN_FLIGHT] = 15.0
    climb_mps: Annotated[float, Range(-5.0, 20.0), IN_FLIGHT] = 5.0
    target_m: Annotated[float, Range(10.0, 500.0), IN_FLIGHT] = 35.0
    height_gain_1ps: Annotated[float, Range(0.01, 1.0), IN_FLIGHT] = 0.3
    descent_mps: Annotated[float, Range(0.0, 30.0), IN_FLIGHT] = 15.0
    # so much lower in a hard shear, where the air sinks less and the outflow is weaker: from the one to the other peak of quick F
    deeper_m: Annotated[float, Range(0.0, 100.0), IN_FLIGHT] = 0.0
    deeper_from_F: Annotated[float, Range(0.0, 2.0), IN_FLIGHT] = 0.45
    deeper_to_F: Annotated[float, Range(0.0, 2.0), IN_FLIGHT] = 0.60
    rise_mps: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 5.0
    after_mps: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 8.0  # climb once the shear is behind
    hold_F: Annotated[float, Range(-0.5, 0.5), IN_FLIGHT] = 0.05  # quick F above which the height is managed
    clear_s: Annotated[float, Range(0.0, 60.0), IN_FLIGHT] = 1.0  # below hold_F for this long: the shear is behind
    again_F: Annotated[float, Range(-0.5, 1.0), IN_FLIGHT] = (
        0.12  # quick F above which there is a new one; turbulence stays below
    )
    protect_mps: Annotated[float, Range(40.0, 100.0), IN_FLIGHT] = (
        62.0  # airspeed below which climbing is given up for speed
    )
    protect_gain: Annotated[float, Range(0.0, 5.0), IN_FLIGHT] = 0.6
    protect_above_m: Annotated[float, Range(0.0, 500.0), IN_FLIGHT] = 27.0
    alpha_max_rad: Annotated[float, Range(0.1, 0.25), IN_FLIGHT] = 0.20
    managed_alpha_max_rad: Annotated[float, Range(0.1, 0.25), IN_FLIGHT] = 0.22

    def __post_init__(self) -> None:
        if self.again_F < self.hold_F:
            raise ValueError(f"again_F = {self.again_F}; allowed: hold_F = {self.hold_F} or more")
        if not self.deeper_from_F < self.deeper_to_F:
            raise ValueError(f"deeper_to_F = {self.deeper_to_F}; allowed: above deeper_from_F = {self.deeper_from_F}")
        if self.target_m - self.deeper_m < LEAST_TARGET_M:
            raise ValueError(f"deeper_m = {self.deeper_m}; allowed: target_m = {self.target_m} less {LEAST_TARGET_M}")

    def target(self, peak_F: float) -> float:
        """Height to be managed [m] in a shear whose quick F has peaked at peak_F [-]."""
        share = (peak_F - self.deeper_from_F) / (self.deeper_to_F - self.deeper_from_F)
        return self.target_m - self.deeper_m * min(max(share, 0.0), 1.0)


@dataclass(frozen=True)
class WindshearGuidanceParams:
    """All of guidance."""

    approach: ApproachParams = field(default_factory=ApproachParams)
    hazard: HazardParams = field(default_factory=HazardParams)
    escape: EscapeParams = field(default_factory=EscapeParams)
    engine_out: single.EngineOutParams = field(default_factory=single.EngineOutParams)
    blind_s: Annotated[float, Range(0.0, 60.0), IN_FLIGHT] = (
        1.0  # without an estimate for this long: go around on what readings there are
    )
    gravity_mps2: Annotated[float, Range(9.7, 9.9)] = 9.81
    path: Annotated[str, OursOr(("approach",))] = "approach"  # a ShearPath, made from (this table)


class WindshearGuidance:
    """`step` once per sample. `phase` is one of PHASES; `aim` moves the slope; `abort()` is the pilot's."""

    obeys = EVERY_KEY

    def __init__(self, p: WindshearGuidanceParams | None = None) -> None:
        """Raises ValueError when the speeds of the approach are not in order."""
        self.p = p = p or WindshearGuidanceParams()
        if not p.approach.speed_min_mps <= p.approach.speed_max_mps:
            raise ValueError(
                f"approach speeds {p.approach.speed_min_mps}, {p.approach.speed_max_mps}; allowed: ascending"
            )
        self.hazard = Hazard(p.hazard)
        self.phase = "approach"
        self.engine_out = False  # set by the mission
        self._aim: tuple[float, float] | None = None
        self._told = False
        self._low_s = self._given_s = 0.0
        self._peak = 0.0  # largest quick F since the approach was given up
        self.demand = PathDemand()
        self._tan = math.tan(math.radians(p.approach.slope_deg))

    @property
    def law(self) -> str:
        """The escape law chosen."""
        return self.p.escape.law

    @property
    def state(self) -> HazardState:
        """The hazard as last judged."""
        return self.hazard.state

    @property
    def cautions(self) -> int:
        """How often caution came on."""
        return self.hazard.cautions

    def choose(self, law: str) -> None:
        """Another escape law from now on. Raises ValueError for one that is unknown."""
        self.p = with_law(self.p, law)

    def use(self, p: WindshearGuidanceParams) -> None:
        """Changed numbers from this step on; the escape law stays the one chosen."""
        self.p = with_law(p, self.p.escape.law)
        self.hazard.p = p.hazard

    def aim(self, x_m: float, h_m: float) -> None:
        """The slope goes through this point (default: where the first valid estimate is)."""
        self._aim = (x_m, h_m)

    def abort(self) -> None:
        """Escape now."""
        self._told = True

    def slope_height(self, x_m: float) -> float:
        """Height of the slope [m] at x; NaN before there is one."""
        if self._aim is None:
            return math.nan
        x0, h0 = self._aim
        return h0 - (x_m - x0) * self._tan

    def slope_ends(self) -> tuple[tuple[float, float], ...]:
        """(x, h) [m] where the slope was taken up and where it meets the ground; () before there is one."""
        if self._aim is None:
            return ()
        x, h = self._aim
        return ((x, h), (x + h / self._tan, 0.0))

    def step(self, x: Array, F: float, dt: float, valid: bool = True) -> PathDemand:
        """Demand for the estimate x [15] with hazard index F; the last one while the estimate is not valid."""
        if not valid:
            self.hazard.lost()
            return self.demand
        if self._aim is None:
            self.aim(float(x[k.X]), float(x[k.H]))
        index = self.hazard.index(x, F, dt, self.p.gravity_mps2)
        s = self.hazard.step(index, dt, sink=-float(x[k.WH]) / float(x[k.VA]))
        low = s.quick <= self.p.escape.hold_F
        self._low_s = self._low_s + dt if low else 0.0
        if self.phase in ("approach", "caution"):
            self.phase = "caution" if s.caution else "approach"
            early = self.engine_out and s.quick > self.p.hazard.caution_F
            if (s.abort or self._told or early) and self.p.escape.law != "continue":
                self.phase = "escape"
        if self.phase in ("approach", "caution"):
            self.demand = self._approach(x, self.phase == "caution", dt)
        else:
            # not decided anew at every sample that turbulence moves F across one threshold
            if self.phase == "escape" and low and self._low_s >= self.p.escape.clear_s:
                self.phase = "clear"
            elif s.quick > self.p.escape.again_F:
                self.phase = "escape"
            self._peak = max(self._peak, s.quick)
            self.demand = self._escape(x)
        return self.demand

    def _approach(self, x: Array, caution: bool, dt: float) -> PathDemand:
        a = self.p.approach
        ground = float(x[k.VA]) * math.cos(float(x[k.GA])) + float(x[k.WX])
        climb = -ground * self._tan + a.gain_1ps * (self.slope_height(float(x[k.X])) - float(x[k.H]))
        speed = min(max(a.ground_mps - float(x[k.WX]), a.speed_min_mps), a.speed_max_mps)
        climb = min(max(climb, a.climb_min_mps), a.climb_max_mps)
        if caution:
            speed += a.caution_speed_mps
            climb = max(
                climb, -ground * self._tan
            )  # what the head wind gave is not dived away before the tail wind comes
        d = PathDemand("approach", climb, speed, 0.0, a.alpha_max_rad)
        if not self.engine_out:
            return d
        one = self.p.engine_out
        self._given_s = self.p.hazard.gain_hold_s if self.state.slow < -one.gain_F else self._given_s - dt
        return single.approach(one, x, d, -ground * self._tan, caution or self._given_s > 0.0)

    def _escape(self, x: Array) -> PathDemand:
        e = self.p.escape
        if self.engine_out and e.law == "managed":
            return single.escape(self.p.engine_out, x, self.phase == "escape")
        if e.law == "open":
            return PathDemand("open")
        if e.law == "pitch":
            return PathDemand("pitch", pitch_rad=math.radians(e.pitch_deg), alpha_max_rad=e.alpha_max_rad)
        if e.law == "climb":
            return PathDemand("climb", e.climb_mps, alpha_max_rad=e.alpha_max_rad)
        h, V = float(x[k.H]), float(x[k.VA])
        climb = e.after_mps
        if self.phase == "escape":
            climb = min(max(e.height_gain_1ps * (e.target(self._peak) - h), -e.descent_mps), e.rise_mps)
        if e.protect_mps > V and h > e.protect_above_m:
            climb = min(climb, e.rise_mps - e.protect_gain * (e.protect_mps - V))
        return PathDemand("climb", climb, alpha_max_rad=e.managed_alpha_max_rad)


def with_law(p: WindshearGuidanceParams, law: str, **more: float) -> WindshearGuidanceParams:
    """The same with another escape law; `more` changes its numbers. Raises ValueError for an unknown law."""
    if law not in LAWS:
        raise ValueError(f"escape law {law!r}; allowed: {', '.join(LAWS)}")
    return replace(p, escape=replace(p.escape, law=law, **more))
