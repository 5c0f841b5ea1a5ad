"""Readings made good: what is left out is replaced by what the others of its variable say, moved to its place in the wake."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from flightsw.kernels.rotations import vec3
from flightsw.missions.receiver.airdata.expected import OF_ALPHA, OF_BETA, OF_V
from flightsw.types import SensorFrame


def repaired(f: SensorFrame, y: np.ndarray, use: int, expected: np.ndarray, V: float | None = None) -> SensorFrame:
    """Frame `f` with those of its readings y [9] (V [m/s], beta, alpha [rad] of three probes) that are not in the mask `use`
    replaced, in y too, by the mean of the usable ones of their variable less the expected ones [9], plus their own. Where a
    variable has none left its channels are bad, but airspeed where V [m/s] is known without it."""
    mask, bad = 0, f.air_bad
    for v in range(3):
        good = [3 * v + i for i in range(3) if use >> (3 * v + i) & 1]
        if good:
            m = math.fsum(y[c] - expected[c] for c in good) / len(good)
        elif v == 0 and V is not None:
            m = V - math.fsum(expected[OF_V]) / 3.0
        else:
            bad |= 7 << (3 * v)
            continue
        for i in range(3):
            if 3 * v + i not in good:
                y[3 * v + i] = m + expected[3 * v + i]
        bad &= ~(7 << (3 * v))
        mask |= 1 << v
    return replace(
        f, air_V=vec3(y[OF_V]), air_beta=vec3(y[OF_BETA]), air_alpha=vec3(y[OF_ALPHA]), air_bad=bad,
        air_mask=f.air_mask | 7 if mask == 7 else f.air_mask,
    )  # fmt: skip
