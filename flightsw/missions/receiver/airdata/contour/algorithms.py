"""Algorithms 1-16 of Sevil (2013), chapter 4: from readings to a position by the crossings of map contours.

The table is Table 4.2, completed as in sevil.md section 5. Errata: E12, the text of Algorithms 8 and 9 omits the rule
for one set that the table gives (the table is used); E19, the pseudocode's triple loop over three contours is
three pairwise loops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.intersect import im1, im2
from flightsw.missions.receiver.airdata.contour.lines import Lines
from flightsw.missions.receiver.airdata.contour.wake_map import WakeMap

Arr = NDArray[np.float64]
EPSILON_M = 0.1  # [m]
NONE = np.zeros((0, 2))
BETA, ALPHA = 3, 6  # first channel of each variable in the nine readings


@dataclass(frozen=True)
class Algorithm:
    """One row of the table.

    several: what becomes of several candidates when only one set has any: first or last found, discard, or the midpoint
    of the closest two if nearer than epsilon. single: what becomes of one. both: what joins the two sets: midpoint of
    the closest pair, the same only below epsilon ("coincide"), or not applicable (one set).
    """

    number: int
    beta: bool
    alpha: bool
    probes: tuple[int, ...]  # 1 nose, 2 left tip, 3 right tip
    method: Literal["IM-1", "IM-2"]
    both: Literal["closest", "coincide", "n/a"]
    several: Literal["first", "last", "discard", "closest"]
    single: Literal["keep", "discard", "n/a"]

    @property
    def crosses_variables(self) -> bool:
        """Contours of the two variables of one probe are crossed with each other."""
        return len(self.probes) == 1


TIPS, ALL, NOSE = (2, 3), (1, 2, 3), (1,)
ALGORITHMS: dict[int, Algorithm] = {
    a.number: a
    for a in (
        Algorithm(1, True, False, TIPS, "IM-1", "n/a", "first", "keep"),
        Algorithm(2, True, False, TIPS, "IM-1", "n/a", "last", "keep"),
        Algorithm(3, False, True, TIPS, "IM-1", "n/a", "first", "keep"),
        Algorithm(4, False, True, TIPS, "IM-1", "n/a", "last", "keep"),
        Algorithm(5, True, False, TIPS, "IM-1", "n/a", "discard", "keep"),
        Algorithm(6, False, True, TIPS, "IM-1", "n/a", "discard", "keep"),
        Algorithm(7, True, True, TIPS, "IM-1", "coincide", "discard", "discard"),
        Algorithm(8, True, True, TIPS, "IM-1", "closest", "first", "keep"),
        Algorithm(9, True, True, ALL, "IM-1", "closest", "last", "keep"),
        Algorithm(10, True, True, ALL, "IM-1", "closest", "first", "keep"),
        Algorithm(11, True, True, ALL, "IM-1", "closest", "closest", "keep"),
        Algorithm(12, True, True, NOSE, "IM-1", "n/a", "first", "keep"),
        Algorithm(13, True, True, NOSE, "IM-1", "n/a", "last", "keep"),
        Algorithm(14, True, True, ALL, "IM-2", "closest", "first", "keep"),
        Algorithm(15, True, True, ALL, "IM-1", "closest", "closest", "discard"),
        Algorithm(16, True, True, ALL, "IM-1", "closest", "first", "discard"),
    )
}


class Crossings:
    """Candidate positions of one set of nine readings on one map; each pair of contours is crossed once, on demand."""

    def __init__(self, contours: Contours, readings: Sequence[float] | Arr) -> None:
        if len(readings) != 9:
            raise ValueError(f"readings: {len(readings)} values; allowed: 9 (V1..3, beta1..3, alpha1..3)")
        self._contours, self._readings = contours, readings
        self._lines: dict[int, Lines] = {}
        self._sets: dict[tuple[int, int, str], Arr] = {}

    def line(self, channel: int) -> Lines:
        """Contour of map `channel` at the reading of that channel."""
        if channel not in self._lines:
            self._lines[channel] = self._contours.lines(channel, float(self._readings[channel]))
        return self._lines[channel]

    def pair(self, a: int, b: int, method: str) -> Arr:
        """Candidates [n, 2] of the contours of channels a and b: all crossings (IM-1) or the nearest vertices (IM-2)."""
        key = (a, b, method)
        if key not in self._sets:
            la, lb = self.line(a), self.line(b)
            if la.empty or lb.empty:
                self._sets[key] = NONE
            elif method == "IM-1":
                self._sets[key] = im1(la, lb)
            else:
                self._sets[key] = im2(la.xy, lb.xy)[0][None, :]
        return self._sets[key]

    def union(self, first: int, alg: Algorithm) -> Arr:
        """C12 U C13 U C23 (or C23 alone) of the variable whose channels start at `first`; not merged across pairs."""
        p = alg.probes
        sets = [
            self.pair(first + p[i] - 1, first + p[j] - 1, alg.method)
            for i in range(len(p))
            for j in range(i + 1, len(p))
        ]
        return np.concatenate(sets)


def decide(
    alg: Algorithm, beta: Arr, alpha: Arr, epsilon: float = EPSILON_M, gate: float = math.inf
) -> tuple[float, float] | None:
    """Position (y, z) [m, F] from the candidate sets [n, 2] of sideslip and incidence, or None.

    `gate` [m]: with candidates in both sets, none nearer to each other than this gives no position (infinite in the
    source; the epsilon gate of sevil.md section 8.1 trades four wrong positions of 1533 for seven missing ones).
    """
    if alg.both != "n/a" and len(beta) and len(alpha):
        middle, apart = im2(beta, alpha)
        return _point(middle) if apart < min(gate, epsilon if alg.both == "coincide" else math.inf) else None
    one = beta if len(beta) else alpha
    if len(one) == 0:
        return None
    if len(one) == 1:
        return _point(one[0]) if alg.single == "keep" else None
    if alg.several == "closest":
        middle, apart = im2(one, one, same=True)
        return _point(middle) if apart < epsilon else None
    if alg.several == "discard":
        return None
    return _point(one[0] if alg.several == "first" else one[-1])


def _point(p: Arr) -> tuple[float, float]:
    return float(p[0]), float(p[1])


def locate(
    alg: int | Algorithm,
    wake_map: WakeMap | Contours | Crossings,
    readings: Sequence[float] | Arr = (),
    epsilon: float = EPSILON_M,
    gate: float = math.inf,
) -> tuple[float, float] | None:
    """Position (y, z) [m, F] by one algorithm, or None where it gives none.

    alg: number 1..16 or a row of one's own. wake_map: pass Contours when asking often (they are built once per map), or
    the Crossings of these readings to try several algorithms on them. readings [9]: V1..3 [m/s], beta1..3, alpha1..3
    [rad]; a reading that is not finite has no contour. epsilon, gate [m]: see `decide`. Raises ValueError for an
    algorithm that does not exist or another number of readings.
    """
    if isinstance(alg, int):
        if alg not in ALGORITHMS:
            raise ValueError(f"algorithm = {alg}: allowed 1 to 16")
        alg = ALGORITHMS[alg]
    if isinstance(wake_map, Crossings):
        found = wake_map
    else:
        found = Crossings(wake_map if isinstance(wake_map, Contours) else Contours(wake_map), readings)
    if alg.crosses_variables:
        p = alg.probes[0] - 1
        return decide(alg, found.pair(BETA + p, ALPHA + p, alg.method), NONE, epsilon, gate)
    beta = found.union(BETA, alg) if alg.beta else NONE
    alpha = found.union(ALPHA, alg) if alg.alpha else NONE
    return decide(alg, beta, alpha, epsilon, gate)
