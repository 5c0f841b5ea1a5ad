"""What became of a flight after a fault, by the truth.

Geometry, of the receiver behind the tanker:
- *off*: distance of its centre of gravity from the point it is held at, in the tanker's axes;
- *gap*: least distance between the bars of both airframes (the aircraft files' `structure.bars`, which make a collision where
  they touch). On station in contact it is 11.1 m, 2 m nearer and higher 8.4 m; nearer than KEEP_OUT_M is inside the keep-out;
- *over*: above the boom's pivot within the tanker's span and no further than OVER_BEHIND_M behind it: keep-out too, the wake and
  the tail are there.

*Announced*: the first text of warning or worse from either aircraft after the fault, or the receiver's phase leaving the one it
was in, both as they went over the wire. *Left*: that phase was left.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Arr = NDArray[np.float64]
KEEP_OUT_M = 5.0  # [m] gap
OVER_BEHIND_M = 45.0  # [m] behind the tanker's centre of gravity
TIME_TO_ALERT_S = 1.0
UPSET_S = 1.0


class Outcome(IntEnum):
    """From good to bad; of several that hold, the worst counts."""

    KEPT = 0  # on station, never beyond the limit
    LEFT = 1  # announced before the limit was passed, and left
    LATE = 2  # announced or left within the time to alert after it
    SILENT = 3  # beyond the limit for the time to alert, and nothing said
    KEEP_OUT = 4  # inside the keep-out around the tanker
    UPSET = 5  # bank beyond 70 deg, or beyond the limits of its file, for UPSET_S
    LOST = 6  # on the ground, broken, out of control or against the tanker


@dataclass(frozen=True)
class Track:
    """What was flown from the fault on: t [N] s since the fault, off [N] m, gap [N] m, over [N], beyond [N] (bank, incidence or
    speed of either aircraft); announced_s, left_s: infinite if never; lost: an aircraft was."""

    t: Arr
    off: Arr
    gap: Arr
    over: NDArray[np.bool_]
    beyond: NDArray[np.bool_]
    announced_s: float
    left_s: float
    lost: bool = False


def longest(t: Arr, flag: NDArray[np.bool_]) -> float:
    """Longest time [s] without a break for which `flag` [N] holds at times t [N] s: from its first to its last sample."""
    best, start = 0.0, np.nan
    for now, on in zip(t, flag, strict=True):
        start = np.nan if not on else now if np.isnan(start) else start
        best = max(best, 0.0 if not on else now - start)
    return float(best)


def passed_s(track: Track, limit_m: float) -> float:
    """When the limit [m] was passed [s]; infinite if it was not, or only after the station was left in time."""
    far = track.off > limit_m
    first = float(track.t[np.argmax(far)]) if far.any() else np.inf
    in_time = max(track.announced_s, track.left_s) <= first
    return np.inf if in_time else first


def judge(track: Track, limit_m: float) -> Outcome:
    """The worst outcome that holds. limit_m: largest `off` [m] that is safe on this station."""
    if track.lost:
        return Outcome.LOST
    if longest(track.t, track.beyond) >= UPSET_S:
        return Outcome.UPSET
    if (track.gap < KEEP_OUT_M).any() or track.over.any():
        return Outcome.KEEP_OUT
    first = passed_s(track, limit_m)
    if np.isinf(first):
        return Outcome.KEPT if np.isinf(track.left_s) else Outcome.LEFT
    said = min(track.announced_s, track.left_s)
    last = float(track.t[-1])
    if said > first + TIME_TO_ALERT_S and last >= first + TIME_TO_ALERT_S:
        return Outcome.SILENT
    if said <= first and track.left_s <= first + TIME_TO_ALERT_S:
        return Outcome.LEFT
    return Outcome.LATE
