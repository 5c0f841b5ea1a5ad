"""Randomness: one generator per consumer, derived from (seed, consumer name), so that consumers never share draws."""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.wind.air import gauss_markov_block

BLOCK = 1000  # rows drawn at a time: few numpy calls, and the series does not depend on it


def generator(seed: int, name: str) -> np.random.Generator:
    """PCG64 generator of consumer `name` for run `seed`. The name is hashed with SHA-256, so it is stable
    everywhere."""
    words = np.frombuffer(hashlib.sha256(name.encode()).digest()[:16], dtype="<u4")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *(int(w) for w in words)])))


class NoiseRows:
    """Endless rows of sensor error: fixed bias + white or exact first-order Gauss-Markov noise, drawn in blocks.

    `std`, `bias_std` one entry per column (their unit is the column's); bias is one draw per run. `tau_s` > 0
    colours the noise with that correlation time at sample period `period_s`, started stationary.
    """

    def __init__(
        self, seed: int, name: str, std: list[float], bias_std: list[float], tau_s: float = 0.0, period_s: float = 0.01
    ) -> None:
        self._rng = generator(seed, name + ".noise")
        self._std = np.array(std, dtype=np.float64)
        self.bias = generator(seed, name + ".bias").standard_normal(len(bias_std)) * np.array(bias_std)
        self._e = math.exp(-period_s / tau_s) if tau_s > 0.0 else 0.0
        self._x: NDArray[np.float64] = self._rng.standard_normal(len(std)) if tau_s > 0.0 else np.zeros(len(std))
        self._rows: list[list[float]] = []
        self._i = 0

    def next(self) -> list[float]:
        """The next row of errors; the caller may change it."""
        if self._i == len(self._rows):
            unit = self._rng.standard_normal((BLOCK, len(self._std)))
            if self._e > 0.0:
                gauss_markov_block(self._x, self._e, unit)
            self._rows = (unit * self._std + self.bias).tolist()
            self._i = 0
        row = self._rows[self._i]
        self._i += 1
        return row
