"""Protection around a law that holds airspeed and altitude."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.protection import Protection
from flightsw.terms import LawTerms
from flightsw.types import GuidanceCmd, Health, NavState, SensorFrame

PATH_MOST, PATH_S = math.radians(3.0), 10.0  # [rad], [s] towards a height
CLOSE_M, CLOSE_MPS = 30.0, 10.0  # [m], [m/s] of what the law holds: it is linear


class Estimator(Protocol):
    """What recovery asks of an estimator."""

    def begin_again(self, why: str) -> None:
        """Forget the estimate and start from the sensors as soon as they are there."""


def cruise(V: float, alt_m: float, nav: NavState) -> Rejoin:
    """Back to airspeed V [m/s] and altitude [m], on whatever heading."""
    short = alt_m + nav.pos_n[2]
    path = min(max(short / (PATH_S * V), -PATH_MOST), PATH_MOST) if nav.valid else 0.0
    return Rejoin(V, path=path, ready=abs(short) < CLOSE_M and abs(nav.V - V) < CLOSE_MPS)


def protected(
    guard: Protection | None, law: LawTerms, f: SensorFrame, nav: NavState, g: GuidanceCmd, updated: int, health: Health,
    felt: Felt, dt: float, *estimators: Estimator,
) -> tuple[np.ndarray, float] | None:  # fmt: skip
    """The recovery law's command (as Protection.fly) while it has it, dt [s] after the last step; None: `law` flies by g."""
    if guard is None:
        return None
    rejoin = cruise(g.V, g.alt_m, nav)
    if guard.step(f, nav, updated, health, rejoin, felt, dt):
        law.open()
    if guard.anew:
        for e in estimators:
            e.begin_again("restarting after recovery")
    return guard.command(g, rejoin, dt)
