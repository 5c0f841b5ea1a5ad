"""Slow errors that sensors of aircraft near each other share: of satellite positions clocks, orbits, ionosphere; of barometers
the weather."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim_plant.rng import BLOCK, generator
from sim_plant.sensors.shape_kernel import NODE_US
from sim_plant.wind.air import gauss_markov_block


class Shared:
    """Unit-variance Gauss-Markov series at fixed times: per axis its value at the origin and its change to the north and to the
    east. Whoever asks with the same seed, stream and correlation time gets the same series, at whatever rate it samples."""

    def __init__(self, seed: int, stream: str, tau_s: float) -> None:
        self._rng = generator(seed, stream)
        self._e = math.exp(-NODE_US * 1e-6 / tau_s)
        self._x: NDArray[np.float64] = self._rng.standard_normal(9)
        self._nodes: list[list[float]] = [self._x.tolist()]

    @staticmethod
    def of(seed: int, stream: str, tau_s: float) -> Shared:
        """The one of a run."""
        return _kept(seed, stream, tau_s)

    def around(self, axis: int, t_us: int) -> list[float]:
        """Values of axis (north, east, down; of one column: 0) before t_us, at the origin and their change to the north and
        to the east, and the same after."""
        k = t_us // NODE_US
        while k + 1 >= len(self._nodes):
            unit = self._rng.standard_normal((BLOCK, 9))
            gauss_markov_block(self._x, self._e, unit)
            self._nodes += unit.tolist()
        return [node[i] for node in self._nodes[k : k + 2] for i in (axis, axis + 3, axis + 6)]


@lru_cache(maxsize=8)
def _kept(seed: int, stream: str, tau_s: float) -> Shared:
    """A series depends on nothing but its key, so that sharing it between sensors and runs changes no value."""
    return Shared(seed, stream, tau_s)
