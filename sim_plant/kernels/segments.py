"""Kernels: distance of two segments, and of two bodies made of bars."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit, jit_own

Arr = NDArray[np.float64]


@jit
def _clip(x: float) -> float:
    return min(max(x, 0.0), 1.0)


@jit
def distance(m: Arr, o: Arr) -> float:
    """Shortest distance [m] of the segments m[0:3]..m[3:6] and o[0:3]..o[3:6].

    |p + s d - u - t e|^2 is convex in (s, t): its least is where both derivatives vanish, if that lies within the unit square,
    else on one of the four sides, where it is a parabola in one of them.
    """
    a = b = c = dw = ew = 0.0
    for i in range(3):
        d, e, w = m[3 + i] - m[i], o[3 + i] - o[i], m[i] - o[i]
        a += d * d
        b += d * e
        c += e * e
        dw += d * w
        ew += e * w
    best, det = math.inf, a * c - b * b
    for k in range(5):
        # a side each: s or t at an end; then within, where nearly parallel: t is rough, but the best s for it is not, and no try
        # is nearer than the truth
        if k < 2:
            s = float(k)
            t = _clip((s * b + ew) / c) if c > 0.0 else 0.0
        elif k < 4 or det > 0.0:
            t = float(k - 2) if k < 4 else _clip((a * ew - b * dw) / det)
            s = _clip((t * b - dw) / a) if a > 0.0 else 0.0
        else:
            break
        square = 0.0
        for i in range(3):
            x = m[i] - o[i] + s * (m[3 + i] - m[i]) - t * (o[3 + i] - o[i])
            square += x * x
        best = min(best, math.sqrt(square))
    return best


@jit_own
def gap(mine: Arr, other: Arr, lead: Arr, own: Arr, xi: Arr) -> float:
    """Least distance [m] of two bodies; below 0 they touch. mine [n, 7], other [m, 7]: bars (ends, radius [m]) in the leader's
    and in the other's body axes; lead, own [9]: body to navigation axes, row by row; xi [3]: the other's place, leader's axes."""
    least, here, nav = math.inf, np.empty(6), np.empty(3)
    for j in range(other.shape[0]):
        for end in (0, 3):
            for k in range(3):
                nav[k] = (
                    own[3 * k] * other[j, end] + own[3 * k + 1] * other[j, end + 1] + own[3 * k + 2] * other[j, end + 2]
                )
            for k in range(3):
                here[end + k] = xi[k] + lead[k] * nav[0] + lead[3 + k] * nav[1] + lead[6 + k] * nav[2]
        for i in range(mine.shape[0]):
            least = min(least, distance(mine[i], here) - mine[i, 6] - other[j, 6])
    return least
