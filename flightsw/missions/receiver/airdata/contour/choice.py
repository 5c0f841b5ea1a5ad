"""Which way of finding the position in the wake a flight file chooses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flightsw.aircraft import Aircraft
from flightsw.missions.receiver.airdata.contour.params import FILTER
from flightsw.missions.receiver.airdata.contour.wake_map import map_files

if TYPE_CHECKING:
    from flightsw.missions.receiver.airdata.contour.position import ContourPosition
    from flightsw.missions.receiver.airdata.params import WakePositionParams


def make_contours(ac: Aircraft, p: WakePositionParams) -> ContourPosition | None:
    """The position by contours that `method` names, None for the filter's. Raises ConfigError for a map that cannot be used."""
    if p.method == FILTER:
        return None
    from flightsw.missions.receiver.airdata.contour.position import ContourPosition  # contourpy: slow to import

    return ContourPosition(ac, p.method, p.contours)


def maps_of(p: WakePositionParams) -> dict[str, tuple[Path, ...]]:
    """The key, below [airdata.position], that names the map in use, and the map's files. Raises ConfigError if there are none."""
    return {} if p.method == FILTER else {"contours.map": map_files(p.contours.map)}
