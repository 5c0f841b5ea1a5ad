"""Where an airframe ends: what it bears, and what of it can touch another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

Bar = tuple[float, float, float, float, float, float, float]  # from x, y, z to x, y, z, radius [m], body axes


@dataclass(frozen=True)
class Structure:
    """Ultimate load factors (down, up), dive speed as equivalent airspeed and Mach number. `bars`: round bars that make up the
    body, one with y is there on both sides; none: it touches nothing."""

    load_g: tuple[Annotated[float, Range(hi=0.0)], Annotated[float, Range(1.0)]]
    dive_eas_mps: Annotated[float, Range(1.0)]
    dive_mach: Annotated[float, Range(0.01, 1.0)] = 1.0
    bars: tuple[Bar, ...] = ()
