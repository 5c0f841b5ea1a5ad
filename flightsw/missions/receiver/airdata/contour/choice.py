"""Which way of finding the position in the wake a flight file chooses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import Aircraft
from flightsw.missions.receiver.airdata.contour.params import FILTER

if TYPE_CHECKING:
    from flightsw.missions.receiver.airdata.contour.position import ContourPosition
    from flightsw.missions.receiver.airdata.params import WakePositionParams


def make_contours(ac: Aircraft, p: WakePositionParams) -> ContourPosition | None:
    """The position by contours that `method` names, None for the filter's. Raises ConfigError for a map that cannot be used."""
    if p.method == FILTER:
        return None
    from flightsw.missions.receiver.airdata.contour.position import ContourPosition  # contourpy: slow to import

    return ContourPosition(ac, p.method, p.contours)
