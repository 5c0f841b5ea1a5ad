"""Readings that wait until the bank has come to their time, in arrays that compiled calls work on (horizon_kernel.py)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.layout import ROWS

ROOM = 16  # readings that may wait before there is made more
# of a place, in `when`: how many have come before (FREE: nothing waits there), [us] time of the sample, source, rows filled
NUMBER, AT_US, SOURCE, COUNT = range(4)
FREE = -1


@dataclass(slots=True)
class Reading:
    """Rows H [ROWS,n] at the time of the sample, y [ROWS], variances r [ROWS] of one source; `count` of them are filled: three
    of the position, then three of the velocity."""

    source: int
    t_us: int
    H: np.ndarray
    y: np.ndarray
    r: np.ndarray
    count: int


@jit
def empty(
    when: np.ndarray, k: int, source: int, t_us: int, count: int, H: np.ndarray, y: np.ndarray, r: np.ndarray
) -> int:
    """A free place from place k on, which is made ready for `count` rows of `source` at t_us; -1: there is none. The reading does
    not wait there yet. H [K,ROWS,n], y, r [K,ROWS], when [K,4] of all places."""
    while k < when.shape[0] and when[k, NUMBER] != FREE:
        k += 1
    if k == when.shape[0]:
        return -1
    when[k, AT_US], when[k, SOURCE], when[k, COUNT] = t_us, source, count
    for i in range(H.shape[1]):
        y[k, i], r[k, i] = 0.0, 1.0
        for j in range(H.shape[2]):
            H[k, i, j] = 0.0
    return k


@jit
def earliest(when: np.ndarray) -> int:
    """Place of the reading of the earliest time, of those of one time the one that came first; -1: none waits. when [K,4]."""
    first = -1
    for k in range(when.shape[0]):
        if when[k, NUMBER] != FREE and (
            first < 0
            or when[k, AT_US] < when[first, AT_US]
            or (when[k, AT_US] == when[first, AT_US] and when[k, NUMBER] < when[first, NUMBER])
        ):
            first = k
    return first


class Waiting:
    """Places for readings, and those that wait."""

    def __init__(self, n: int) -> None:
        """n: states of the bank."""
        self.H, self.y, self.r = np.zeros((ROOM, ROWS, n)), np.zeros((ROOM, ROWS)), np.ones((ROOM, ROWS))
        self.when = np.full((ROOM, COUNT + 1), FREE)
        self._number = 0

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """H [K,ROWS,n], y [K,ROWS], r [K,ROWS], when [K,4], as kernels take them."""
        return self.H, self.y, self.r, self.when

    def place(self, source: int, t_us: int, count: int) -> int:
        """A free place as `empty` makes it ready, for one reading."""
        while (k := int(empty(self.when, 0, source, t_us, count, self.H, self.y, self.r))) < 0:
            self.grow()
        return k

    def grow(self) -> None:
        """Twice the places."""
        self.H, self.y, self.r = (np.concatenate((a, np.zeros_like(a))) for a in (self.H, self.y, self.r))
        self.when = np.concatenate((self.when, np.full_like(self.when, FREE)))

    def wait(self, k: int) -> None:
        """Let the reading at place k wait."""
        self.when[k, NUMBER] = self._number
        self._number += 1

    def drop(self, source: int) -> None:
        """Readings of a source are not used."""
        self.when[self.when[:, SOURCE] == source, NUMBER] = FREE

    def clear(self) -> None:
        """None waits."""
        self.when[:, NUMBER] = FREE

    def __getitem__(self, k: int) -> Reading:
        """The reading at place k; its rows are not copied."""
        _, t_us, source, count = self.when[k].tolist()
        return Reading(source, t_us, self.H[k], self.y[k], self.r[k], count)
