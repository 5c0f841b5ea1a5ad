"""Intersection methods IM-1 and IM-2 of Sevil (2013), section 4.1, on polylines and point sets in the y-z plane."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.airdata.contour.lines import Lines

Arr = NDArray[np.float64]
MERGE_M = 1e-6  # [m] crossings of one pair of contours nearer than this are one crossing
CAPACITY = 512  # crossings of one pair of contours kept at most


@jit
def crossings(a: np.ndarray, at_a: np.ndarray, b: np.ndarray, at_b: np.ndarray, merge: float, out: np.ndarray) -> int:
    """IM-1: every crossing of two sets of polylines, segment by segment; returns how many, out [n, 2] <- where [m].

    a, b vertices [., 2], at_a, at_b offsets (see lines.Lines). Segments are closed (their ends count, with 1e-9
    of their length as allowance for rounding), zero-length and parallel ones are passed over. A crossing within
    `merge` [m] of an earlier one is that one (two segments share each vertex). Order: along a, then along b. Beyond
    the rows of `out` crossings are dropped.
    """
    tol = 1e-9
    n = 0
    for la in range(at_a.shape[0] - 1):
        for i in range(at_a[la], at_a[la + 1] - 1):
            px, py = a[i, 0], a[i, 1]
            rx, ry = a[i + 1, 0] - px, a[i + 1, 1] - py
            rr = rx * rx + ry * ry
            if rr == 0.0:
                continue
            lo_x, hi_x = min(px, px + rx) - merge, max(px, px + rx) + merge
            lo_y, hi_y = min(py, py + ry) - merge, max(py, py + ry) + merge
            for lb in range(at_b.shape[0] - 1):
                for j in range(at_b[lb], at_b[lb + 1] - 1):
                    qx, qy = b[j, 0], b[j, 1]
                    ex, ey = b[j + 1, 0], b[j + 1, 1]
                    if (qx < lo_x and ex < lo_x) or (qx > hi_x and ex > hi_x):
                        continue
                    if (qy < lo_y and ey < lo_y) or (qy > hi_y and ey > hi_y):
                        continue
                    sx, sy = ex - qx, ey - qy
                    ss = sx * sx + sy * sy
                    den = rx * sy - ry * sx
                    if den * den <= 1e-24 * rr * ss:
                        continue
                    dx, dy = qx - px, qy - py
                    t = (dx * sy - dy * sx) / den
                    u = (dx * ry - dy * rx) / den
                    if t < -tol or t > 1.0 + tol or u < -tol or u > 1.0 + tol:
                        continue
                    cx, cy = px + t * rx, py + t * ry
                    new = n < out.shape[0]
                    for k in range(n):
                        if math.hypot(out[k, 0] - cx, out[k, 1] - cy) < merge:
                            new = False
                            break
                    if new:
                        out[n, 0] = cx
                        out[n, 1] = cy
                        n += 1
    return n


@jit
def nearest_pair(a: np.ndarray, b: np.ndarray, same: bool, out: np.ndarray) -> float:
    """Distance [m] of the closest pair of points of a [n, 2] and b [m, 2], infinity without one; out [2] <- its midpoint.

    `same`: a and b are one set; pairs of distinct members. Of equally close pairs the first found counts.
    """
    best = math.inf
    for i in range(a.shape[0]):
        for j in range(i + 1 if same else 0, b.shape[0]):
            dx, dy = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
            d = dx * dx + dy * dy
            if d < best:
                best = d
                out[0] = 0.5 * (a[i, 0] + b[j, 0])
                out[1] = 0.5 * (a[i, 1] + b[j, 1])
    return math.sqrt(best)


def im1(a: Lines, b: Lines) -> Arr:
    """All crossings [n, 2] of two contours (IM-1), duplicates within 1e-6 m merged."""
    out = np.zeros((CAPACITY, 2))
    n = crossings(a.xy, a.at, b.xy, b.at, MERGE_M, out)
    return out[:n].copy()


def im2(a: Arr, b: Arr, same: bool = False) -> tuple[Arr, float]:
    """Midpoint [2] and length of the closest pair of points of two sets (IM-2); within one set with `same`.

    Answers whether or not two contours cross: the length says how far they are apart, infinity where a set is empty.
    """
    out = np.zeros(2)
    return out, float(nearest_pair(a, b, same, out))
