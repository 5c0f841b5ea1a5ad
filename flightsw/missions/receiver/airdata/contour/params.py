"""Parameters of the position by contours of a wake map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

FILTER = "filter"
ALGORITHM = {"algorithm_11": 11, "algorithm_15": 15}  # of Sevil (2013), chapter 4
METHODS = (FILTER, *ALGORITHM)  # of finding the position


@dataclass(frozen=True)
class ContourParams:
    """Which map, which readings, and how far its positions are believed."""

    map: str = "contact"  # one of flightsw/missions/receiver/airdata/maps, or the path of a map's .toml file
    window: Annotated[int, Range(1, 1200)] = (
        20  # [sample] moving mean of the readings: 1 s at 20 Hz, half of it their lag
    )
    epsilon_m: Annotated[float, Range(1e-3, 10.0)] = 0.1  # [m] crossings of one variable nearer than this are one place
    # [m] 1-sigma of y and z. The method has none of its own: RMS error of Algorithm 11 over twenty flights at contact in light
    # turbulence with a window of 1 s, rounded up (study sevil_baseline)
    sigma_m: Annotated[tuple[float, float], Range(1e-3, 100.0)] = (1.1, 1.1)
    # [m] a relative estimate farther than this outside the map's grid: no position is asked for. Far away the contours cross
    # inside the map as well, at places that are none
    outside_m: Annotated[float, Range(0.0, 500.0)] = 0.5
