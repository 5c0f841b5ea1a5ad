"""What the protection is given: its table of a flight file, what a step has besides its sensors, and the mission's way back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightsw.sixdof.turning import Turning


@dataclass(frozen=True)
class RecoveryParams:
    """[recovery] of a flight file."""

    on: bool = True  # the command is taken outside the envelope and without navigation


@dataclass(slots=True)
class Rejoin:
    """What is flown once level, and when the law may have the command back: all of it by the mission.

    V [m/s] airspeed, None: as it is; away [m/s, NED] velocity to take on, None: straight on; path [rad]; ready: the law can fly
    from here.
    """

    V: float | None = None
    away: tuple[float, float] | None = None
    path: float = 0.0
    side: float = 1.0  # to bank to where bank has to make the path: +1 right, -1 left
    ready: bool = True
    strange: str = ""  # why the law cannot fly from here at all


@dataclass(frozen=True, slots=True)
class Felt:
    """What a step has besides its sensors. u [4]: mean controls believed to have acted (surfaces rad, thrust N)."""

    u: np.ndarray
    turning: Turning | None  # gyro and reference compared
