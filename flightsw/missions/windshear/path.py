"""What the windshear mission asks of its guidance: ours, or anybody's by `package.module:Class` (`guid.path`)."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from flightsw.missions.windshear.guidance import WindshearGuidance, WindshearGuidanceParams
from flightsw.missions.windshear.hazard import HazardState
from flightsw.missions.windshear.model import PathDemand
from flightsw.plugins import made, refuse_ignored

Array = np.ndarray


@runtime_checkable
class ShearPath(Protocol):
    """What the mission asks of its guidance: a demand on path and speed, the hazard it sees. A pure step, as all algorithms.
    `phase`: one of PHASES; `demand`: the last one; `engine_out`: the mission sets it while an engine is."""

    phase: str
    demand: PathDemand
    engine_out: bool

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def law(self) -> str:
        """The escape law chosen, one of LAWS."""

    @property
    def state(self) -> HazardState:
        """The hazard as last judged."""

    @property
    def cautions(self) -> int:
        """How often caution came on."""

    def step(self, x: Array, F: float, dt: float, valid: bool = True) -> PathDemand:
        """Demand for the estimate x [15] with hazard index F [-], dt [s] after the last."""

    def abort(self) -> None:
        """Escape now."""

    def choose(self, law: str) -> None:
        """Another of LAWS from now on."""

    def use(self, p: WindshearGuidanceParams) -> None:
        """Changed numbers from now on; the escape law stays the one chosen."""

    def slope_height(self, x_m: float) -> float:
        """Height of the slope [m] at x; NaN where there is none."""

    def slope_ends(self) -> tuple[tuple[float, float], ...]:
        """(x, h) [m] where the slope was taken up and where it meets the ground; () where there is none."""


OURS = {"approach": WindshearGuidance}
BESIDE = (
    "approach.ground_mps",
    "approach.slope_deg",
    "blind_s",
    "escape.pitch_deg",
    "escape.alpha_max_rad",
)  # the mission's own


def make_path(p: WindshearGuidanceParams) -> ShearPath:
    """The guidance p.path names. Raises ConfigError; ValueError for speeds that are not in order."""
    path = made(OURS, ShearPath, p.path, "guid.path", p)  # type: ignore[type-abstract]
    refuse_ignored("guid.path", p.path, (*BESIDE, *path.obeys), p)
    return path


def use_path(path: ShearPath, p: WindshearGuidanceParams) -> None:
    """Fly by these parameters from now on. Raises ConfigError for a key the path does not obey."""
    refuse_ignored("guid.path", p.path, (*BESIDE, *path.obeys), p)
    path.use(p)
