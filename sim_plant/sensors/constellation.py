"""Slow errors of satellite positions that receivers near each other share: clocks, orbits, ionosphere."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim_plant.rng import BLOCK, generator
from sim_plant.wind.air import gauss_markov_block

NODE_US = 1_000_000  # [us] between the drawn values, linear in between


class Constellation:
    """Unit-variance Gauss-Markov series at fixed times: per position axis its value at the origin and its change to the north and
    to the east. Whoever asks with the same seed and correlation time gets the same series, at whatever rate it samples."""

    def __init__(self, seed: int, tau_s: float) -> None:
        self._rng = generator(seed, "gnss.constellation")
        self._e = math.exp(-NODE_US * 1e-6 / tau_s)
        self._x: NDArray[np.float64] = self._rng.standard_normal(9)
        self._nodes: list[list[float]] = [self._x.tolist()]

    @staticmethod
    def of(seed: int, tau_s: float) -> Constellation:
        """The constellation of a run."""
        return _shared(seed, tau_s)

    def error(self, axis: int, t_us: int, common: float, gradient: float, north_m: float, east_m: float) -> float:
        """Error [m] of axis (0 north, 1 east, 2 down) at t_us at a place: `common` [m], `gradient` [m/m] 1 sigma."""
        k, rest = divmod(t_us, NODE_US)
        while k + 1 >= len(self._nodes):
            unit = self._rng.standard_normal((BLOCK, 9))
            gauss_markov_block(self._x, self._e, unit)
            self._nodes += unit.tolist()
        a, b, f = self._nodes[k], self._nodes[k + 1], rest / NODE_US
        at, dn, de = (a[i] + f * (b[i] - a[i]) for i in (axis, 3 + axis, 6 + axis))
        return common * at + gradient * (dn * north_m + de * east_m)


@lru_cache(maxsize=8)
def _shared(seed: int, tau_s: float) -> Constellation:
    """A series depends on nothing but its key, so that sharing it between sensors and runs changes no value."""
    return Constellation(seed, tau_s)
