"""How far the motion departs from what is known of it, learnt from the velocities the sources read."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.layout import GNSS, REL
from flightsw.missions.receiver.integrity.params import IntegrityParams

RATED = (REL, GNSS)  # sources that read a velocity, in the order of what is learnt by them,
FIRST = 3  # in the three rows from here on
GAIN = 0.01  # [-] share of a reading's product in the logarithm of the variance
LEAVE = 0.2  # [-] correlation of successive innovations that is left: part of it is not white
MOST = 2.0  # [-] one reading's product
# of what is learnt: density [m/s^2 per sqrt(Hz)], the least of it, and the largest logarithm of the variance over the least's;
# that by either source, the last innovations [3] of either
DENSITY, LEAST, TOP, LOG, LAST = 0, 1, 2, 3, 5
LEARNT = LAST + 3 * len(RATED)


@jit
def within(x: float, least: float, most: float) -> float:
    """x, at least and at most; what is no number stays none."""
    if least > x:
        x = least
    return most if most < x else x


@jit
def hear(s: np.ndarray, source: int, z: np.ndarray, rel: bool, gnss: bool) -> None:
    """Let s [LEARNT] learn from the innovations z [ROWS] of a reading in their sigmas; rel, gnss: whether those sources are heard
    and believed. Other sources read no velocity."""
    if source != REL and source != GNSS:
        return
    k = 0 if source == REL else 1
    last = s[LAST + 3 * k : LAST + 3 * k + 3]
    a, b, c = z[FIRST], z[FIRST + 1], z[FIRST + 2]
    turn = ((a * last[0] - LEAVE * a * a) + (b * last[1] - LEAVE * b * b) + (c * last[2] - LEAVE * c * c)) / 3.0
    s[LOG + k] = within(s[LOG + k] + GAIN * within(turn, -MOST, MOST), 0.0, s[TOP])
    last[0], last[1], last[2] = a, b, c
    by_rel, by_gnss = s[LOG], s[LOG + 1]
    if rel == gnss:
        least = by_gnss if by_gnss < by_rel else by_rel
    else:
        least = by_rel if rel else by_gnss
    s[DENSITY] = s[LEAST] * math.exp(0.5 * least)


class Unrest:
    """Density of the white acceleration, between the least and the most believed.

    A filter that expects too little motion follows late, and its innovations have the same sign twice running: their product
    raises the density, and one that expects too much sees it fall (Mehra 1970; separation.md 1). What moves is seen by every
    source and what lies by one alone: the least of them counts.
    """

    def __init__(self, p: IntegrityParams) -> None:
        self.learnt = np.zeros(LEARNT)  # by `hear`
        top = max(2.0 * math.log(p.accel_most / p.accel), 0.0)
        start = min(max(2.0 * math.log(p.accel_start / p.accel), 0.0), top)
        self.learnt[:LAST] = p.accel * math.exp(0.5 * start), p.accel, top, start, start

    @property
    def density(self) -> float:
        """[m/s^2 per sqrt(Hz)]."""
        return float(self.learnt[DENSITY])
