"""How far the motion departs from what is known of it, learnt from the velocities the sources read."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.receiver.integrity.layout import GNSS, REL
from flightsw.missions.receiver.integrity.params import IntegrityParams

RATED = (REL, GNSS)  # sources that read a velocity,
FIRST, LAST = 3, 6  # in these rows
GAIN = 0.01  # [-] share of a reading's product in the logarithm of the variance
LEAVE = 0.2  # [-] correlation of successive innovations that is left: part of it is not white
MOST = 2.0  # [-] one reading's product


class Unrest:
    """Density of the white acceleration, between the least and the most believed.

    A filter that expects too little motion follows late, and its innovations have the same sign twice running: their product
    raises the density, and one that expects too much sees it fall (Mehra 1970; separation.md 1). What moves is seen by every
    source and what lies by one alone: the least of them counts.
    """

    def __init__(self, p: IntegrityParams) -> None:
        self._least, self._top = p.accel, max(2.0 * math.log(p.accel_most / p.accel), 0.0)
        start = min(max(2.0 * math.log(p.accel_start / p.accel), 0.0), self._top)
        self._log, self._last = [start] * len(RATED), [[0.0] * (LAST - FIRST) for _ in RATED]
        self.density = 0.0  # [m/s^2 per sqrt(Hz)]
        self._settle((True, True))

    def hear(self, source: int, z: np.ndarray, sound: tuple[bool, bool]) -> None:
        """Learn from the innovations z [ROWS] of a reading in their sigmas; sound: which of RATED are heard and believed."""
        if source not in RATED:
            return
        k = RATED.index(source)
        now, (u, v, w) = z[FIRST:LAST].tolist(), self._last[k]
        a, b, c = now
        turn = ((a * u - LEAVE * a * a) + (b * v - LEAVE * b * b) + (c * w - LEAVE * c * c)) / 3.0
        self._log[k] = min(max(self._log[k] + GAIN * min(max(turn, -MOST), MOST), 0.0), self._top)
        self._last[k] = now
        self._settle(sound)

    def _settle(self, sound: tuple[bool, bool]) -> None:
        rel, gnss = self._log
        least = min(rel, gnss) if sound[0] == sound[1] else rel if sound[0] else gnss
        self.density = self._least * math.exp(0.5 * least)
