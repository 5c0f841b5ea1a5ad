"""The approach and the escape on what one engine gives: energy first, no chasing of the slope.

With gear and landing flaps one engine holds level flight at best. So the approach goes on below the slope, parallel to it, and as
soon as the wind gives energy all thrust is kept on and the airspeed grows: it will be taken back. The escape begins at the quick
hazard index. In the shear height goes for speed at once, down where both the sinking air and the outflow are weak: what the shear
takes is less there, and what is left at its end is speed. Behind it only speed above that of the least drag becomes height.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.model import PathDemand
from flightsw.strict import IN_FLIGHT, Range

Array = np.ndarray
YOUNG_S = 2.0  # [s] for which readings that come into question take the conclusion back


@dataclass(frozen=True)
class EngineOutParams:
    """[guid.engine_out]: recognition, and the law that flies."""

    factor: Annotated[float, Range(0.1, 0.95)] = 0.85  # of the thrust commanded; surely below: an engine is out
    sigma: Annotated[float, Range(0.0, 10.0)] = 2.0  # that make it sure
    # for so long: a reading that looks like an engine, a frozen airspeed, is doubted by then
    held_s: Annotated[float, Range(0.0, 10.0)] = 0.5
    least_kN: Annotated[float, Range(0.0, 100.0)] = (
        8.0  # commanded: near idle nothing tells an engine from a bad reading
    )
    back: Annotated[float, Range(0.5, 1.5)] = 0.9  # surely above: it is back
    gain_F: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = (
        0.05  # slow F below minus this: what is given will be taken back,
    )
    reserve_mps: Annotated[float, Range(0.0, 30.0), IN_FLIGHT] = 15.0  # and so much more airspeed is asked for
    hold_mps: Annotated[float, Range(50.0, 100.0), IN_FLIGHT] = (
        70.0  # about that of the least drag: kept outside the shear
    )
    protect_mps: Annotated[float, Range(50.0, 100.0), IN_FLIGHT] = 62.0  # in the shear: below it height goes for speed
    speed_gain: Annotated[float, Range(0.0, 5.0), IN_FLIGHT] = 0.4  # climb rate per airspeed above or below these
    climb_mps: Annotated[float, Range(0.0, 10.0), IN_FLIGHT] = 3.0
    sink_mps: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 15.0
    target_m: Annotated[float, Range(5.0, 500.0), IN_FLIGHT] = 20.0  # height to come down to in the shear
    target_gain_1ps: Annotated[float, Range(0.01, 2.0), IN_FLIGHT] = 0.3
    floor_m: Annotated[float, Range(1.0, 100.0), IN_FLIGHT] = 12.0  # below it nothing is given away
    alpha_max_rad: Annotated[float, Range(0.1, 0.25), IN_FLIGHT] = 0.22

    def __post_init__(self) -> None:
        if self.back < self.factor:
            raise ValueError(f"back = {self.back}; allowed: factor = {self.factor} or more")
        if self.hold_mps < self.protect_mps:
            raise ValueError(f"hold_mps = {self.hold_mps}; allowed: protect_mps = {self.protect_mps} or more")


class EngineWatch:
    """`step` once per sample with what the estimate knows of the thrust; `out`: an engine is."""

    def __init__(self, p: EngineOutParams) -> None:
        self.p = p
        self.out = False
        self._since_s = self._out_s = 0.0

    def step(self, x: Array, sigma: Array, commanded_kN: float, dt: float, doubt: bool = False) -> bool:
        """Whether an engine is out, by the factor of thrust in the estimate x [26], sigma [26]; another filter knows none. doubt:
        readings that would look like one are in question: nothing new is concluded, and what just has been is
        taken back."""
        if len(x) <= k.K_T:
            return False
        self._out_s = self._out_s + dt if self.out else 0.0
        if doubt:
            self.out, self._since_s = self.out and self._out_s > YOUNG_S, 0.0
        if doubt or commanded_kN < self.p.least_kN:
            return self.out
        p, room = self.p, self.p.sigma * float(sigma[k.K_T])
        factor = float(x[k.K_T])
        other = factor - room > p.back if self.out else factor + room < p.factor
        self._since_s = self._since_s + dt if other else 0.0
        if self._since_s > p.held_s:
            self.out, self._since_s = not self.out, 0.0
        return self.out


def approach(p: EngineOutParams, x: Array, d: PathDemand, slope_mps: float, gain: bool) -> PathDemand:
    """The approach's demand d for the state x [>=15] on one engine; slope_mps: climb rate parallel to the slope [m/s]; gain: the
    wind gives energy, or caution is on."""
    climb = min(d.climb_mps, slope_mps) + p.speed_gain * min(float(x[k.VA]) - p.hold_mps, 0.0)
    return PathDemand("approach", climb, max(d.speed_mps, p.hold_mps) + p.reserve_mps * gain, 0.0, d.alpha_max_rad)


def escape(p: EngineOutParams, x: Array, shear: bool) -> PathDemand:
    """Climb rate at full thrust for the state x [>=15]: outside the shear what the speed allows, in it down to the target."""
    V, h = float(x[k.VA]), float(x[k.H])
    if shear:
        climb = min(p.target_gain_1ps * (p.target_m - h), 0.0)
        climb += p.speed_gain * min(V - p.protect_mps, 0.0) if h > p.floor_m else 0.0
    else:
        climb = min(p.speed_gain * (V - p.hold_mps), p.climb_mps)
    lowest = -min(p.target_gain_1ps * max(h - p.floor_m, 0.0), p.sink_mps)
    return PathDemand("climb", max(climb, lowest), alpha_max_rad=p.alpha_max_rad)
