"""Contours of a wake map at measured levels."""

from __future__ import annotations

import math
from typing import cast

import contourpy
import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.contour.lines import Lines
from flightsw.missions.receiver.airdata.contour.wake_map import WakeMap

Arr = NDArray[np.float64]
Chunks = tuple[list[Arr | None], list[NDArray[np.uint32] | None]]  # what LineType.ChunkCombinedOffset gives


NOTHING = Lines(np.zeros((0, 2)), np.zeros(1, np.int64))


class Contours:
    """The contour generators of one wake map, built once (contour extraction itself allocates). They never change: copies share
    them.

    Erratum E10: A_q^beta is the contour of map q of sideslip at the measured sideslip (Sevil 2013, Table 4.1 names the
    other variable), A_q^alpha that of incidence at the measured incidence.
    """

    def __init__(self, wake_map: WakeMap) -> None:
        self.map = wake_map
        self._cut = [
            contourpy.contour_generator(
                wake_map.y,
                wake_map.z,
                wake_map.readings[c],
                name="serial",
                line_type=contourpy.LineType.ChunkCombinedOffset,
            )
            for c in range(9)
        ]

    def __deepcopy__(self, memo: dict[int, object]) -> Contours:
        """Itself: a flight is copied with the map it has."""
        return self

    def lines(self, channel: int, level: float) -> Lines:
        """Contour of map `channel` (0..8: V1..3, beta1..3, alpha1..3) at `level` ([m/s] or [rad]), linear in each cell.

        Where the level is not reached, or is not finite, there is no line.
        """
        if not math.isfinite(level):
            return NOTHING
        points, offsets = cast(Chunks, self._cut[channel].lines(level))
        if points[0] is None or offsets[0] is None:
            return NOTHING
        return Lines(np.ascontiguousarray(points[0]), offsets[0].astype(np.int64))
