"""By how much the aircraft flown differs from its file, which is what the onboard software believes in."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

from flightsw.strict import Range

Factor = Annotated[float, Range(0.2, 5.0)]


@dataclass(frozen=True)
class Mismatch:
    """[aircraft.mismatch]: true value over that of the file. mass: of the aircraft without fuel (of all where fuel is not told
    apart); inertia: all moments; thrust; lag of the engine; servo: bandwidth of the surfaces' servos."""

    mass: Factor = 1.0
    inertia: Factor = 1.0
    thrust: Factor = 1.0
    lag: Factor = 1.0
    servo: Factor = 1.0


MISMATCHES = tuple(f.name for f in fields(Mismatch))
