"""Turbulence along a flight as something sought: wind at knots, straight between them, expected to go as a Gauss-Markov process
whose intensity the flight itself tells (docs/sources/identification.md 6)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Arr = NDArray[np.float64]
KNOT_S = 1.0  # [s] between knots
LENGTH_M = 533.4  # [m] scale of turbulence above 600 m of height (MIL-F-8785C)
SIGMA, LEAST = 0.3, 0.01  # [m/s] intensity to begin with, and at least


class Gusts:
    """Of a flight at airspeed V [m/s]. `sigma` [m/s] per axis; knots are set by `spread`."""

    def __init__(self, V: float) -> None:
        self.sigma, self._tau = SIGMA, LENGTH_M / V
        self.knots = 0
        self._ticks: Arr = np.zeros(0)
        self._at: Arr = np.zeros(0)

    def spread(self, n: int, dt: float) -> None:
        """Over n ticks dt [s] apart and the end of the last one's step."""
        self.knots = math.ceil(n * dt / KNOT_S) + 1
        self._ticks = np.asarray(np.arange(n + 1) * dt, dtype=np.float64)
        self._at = np.asarray(np.arange(self.knots) * KNOT_S, dtype=np.float64)

    def along(self, w: Arr) -> Arr:
        """Wind [n+1,3] m/s at the ticks from that at the knots, w [3 knots]."""
        return np.column_stack([np.interp(self._ticks, self._at, c) for c in w.reshape(self.knots, 3).T])

    def unit(self) -> Arr:
        """Information [knots, knots] of one axis at unit intensity: w_0 of unit variance, w_(j+1) = a w_j + sqrt(1 - a^2) e."""
        a = math.exp(-KNOT_S / self._tau)
        K = self.knots
        q = np.diag(np.full(K, (1.0 + a * a) / (1.0 - a * a)))
        q[0, 0] = q[-1, -1] = 1.0 / (1.0 - a * a)
        off = np.arange(K - 1)
        q[off, off + 1] = q[off + 1, off] = -a / (1.0 - a * a)
        return q

    def information(self) -> Arr:
        """[3 knots, 3 knots] at the intensity."""
        return np.asarray(np.kron(self.unit(), np.eye(3)) / self.sigma**2, dtype=np.float64)

    def learn(self, w: Arr, C: Arr) -> float:
        """Take the most likely intensity, given gusts w [3 knots] with covariance C, in place of that they were sought with (a
        step of expectation and maximisation); returns the share it changed by."""
        q = np.kron(self.unit(), np.eye(3))
        new = max(math.sqrt((float(w @ q @ w) + float((q * C).sum())) / len(w)), LEAST)
        change = abs(new / self.sigma - 1.0)
        self.sigma = new
        return change
