"""What the bank of filters says of the sources at a step."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from flightsw.missions.receiver.integrity.layout import SOURCES
from flightsw.types import Vec3


@dataclass(slots=True)
class Verdict:
    """What the bank says at a step. Masks have a bit a source."""

    pl: Vec3 = (math.inf, math.inf, math.inf)  # [m] protection level, tanker axes
    ratio: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # [-] test over its threshold; 0: not live
    disagree: bool = False  # a test has failed
    blamed: int = -1  # the source the likelihoods name, -1: none
    slot: int = 0  # by forks of this slot
    scores: list[float] = field(default_factory=lambda: [0.0] * SOURCES)
