"""Error rows by blocks, kept where the compiled reading of an aircraft's sensors (bank_kernel.py) finds them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from sim_plant.rng import BLOCK, generator
from sim_plant.sensors.shape_kernel import HEAD, K_AT, K_NEXT, K_WIDTH, WIDTH
from sim_plant.wind.air import gauss_markov_block

Arr = NDArray[np.float64]


class Store:
    """What the compiled reading goes by, sensor by sensor: numbers `f` [m, HEAD + BLOCK, WIDTH], whole numbers `k`
    [m, K_AT + WIDTH] (shape_kernel.py). Used up at first: rows are drawn when the first is asked for."""

    def __init__(self, m: int) -> None:
        self.f = np.zeros((m, HEAD + BLOCK, WIDTH))
        self.k = np.zeros((m, K_AT + WIDTH), dtype=np.int64)
        self.k[:, K_NEXT] = BLOCK


class Rows(ABC):
    """Endless rows of `width` columns, drawn in blocks. No view is kept: in a copied flight it would be an array of its own."""

    def __init__(self, width: int) -> None:
        self.width = width
        self.store, self.j = Store(1), 0
        self.store.k[0, K_WIDTH] = width

    @abstractmethod
    def block(self) -> Arr:
        """The next BLOCK rows [BLOCK, width]."""

    def move(self, store: Store, j: int) -> None:
        """From now on be sensor j of `store`."""
        store.f[j], store.k[j] = self.store.f[self.j], self.store.k[self.j]
        self.store, self.j = store, j

    def row(self) -> Arr:
        """The next row, not used up by looking at it; changes to it are kept."""
        k = self.store.k[self.j]
        if k[K_NEXT] == BLOCK:
            self.store.f[self.j, HEAD:, : self.width] = self.block()
            k[K_NEXT] = 0
        return self.store.f[self.j, HEAD + int(k[K_NEXT]), : self.width]

    def use(self) -> int:
        """Use up the next row, which has been looked at; its number in the block."""
        i = int(self.store.k[self.j, K_NEXT])
        self.store.k[self.j, K_NEXT] = i + 1
        return i


class NoiseRows(Rows):
    """Endless rows of sensor error: fixed bias + white or exact first-order Gauss-Markov noise.

    `std`, `bias_std` one entry per column (their unit is the column's); bias is one draw per run. `tau_s` > 0
    colours the noise with that correlation time at sample period `period_s`, started stationary.
    """

    def __init__(
        self, seed: int, name: str, std: list[float], bias_std: list[float], tau_s: float = 0.0, period_s: float = 0.01
    ) -> None:
        super().__init__(len(std))
        self._rng = generator(seed, name + ".noise")
        self._std = np.array(std, dtype=np.float64)
        self.bias = generator(seed, name + ".bias").standard_normal(len(bias_std)) * np.array(bias_std)
        self._e = math.exp(-period_s / tau_s) if tau_s > 0.0 else 0.0
        self._x: Arr = self._rng.standard_normal(len(std)) if tau_s > 0.0 else np.zeros(len(std))

    def block(self) -> Arr:
        unit = self._rng.standard_normal((BLOCK, len(self._std)))
        if self._e > 0.0:
            gauss_markov_block(self._x, self._e, unit)
        return np.asarray(unit * self._std + self.bias)

    def next(self) -> list[float]:
        """The next row of errors; the caller may change it."""
        row: list[float] = self.row().tolist()
        self.use()
        return row
