"""What a failing sensor does sample by sample. Each fault with randomness draws from a generator of its own."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np


class Drift:
    """Adds rate * time since the start to the error row; `rates` one per column [unit of the column per s]."""

    def __init__(self, rates: list[float], start_us: int) -> None:
        self._rates, self._start = rates, start_us

    def add(self, e: list[float], t_us: int) -> list[float]:
        """Error row of the sample taken at t_us."""
        dt = (t_us - self._start) * 1e-6
        return [a + r * dt for a, r in zip(e, self._rates, strict=True)]


class Garbage:
    """Adds uniform noise within +-half[column] to the error row, fresh each sample."""

    def __init__(self, half: list[float], rng: np.random.Generator) -> None:
        self._half, self._rng = half, rng

    def add(self, e: list[float], t_us: int) -> list[float]:
        """Error row of the next sample."""
        u = self._rng.uniform(-1.0, 1.0, len(e)).tolist()
        return [a + h * x for a, h, x in zip(e, self._half, u, strict=True)]


class Delay:
    """Hands back what it was given n samples ago; until it is full, the first value."""

    def __init__(self, n: int) -> None:
        self._line: deque[Any] = deque(maxlen=n + 1)

    def push(self, x: Any) -> Any:
        """Take the newest value, give the delayed one."""
        self._line.append(x)
        return self._line[0]


class Flicker:
    """Two-state Markov chain: in the long run `share` of the samples are lost, an outage lasts `mean` samples on average.

    mean = 1 / (1 - share) makes samples independent. The chain starts in its stationary distribution.
    """

    def __init__(self, share: float, mean: float, rng: np.random.Generator) -> None:
        self._leave = min(1.0, 1.0 / mean)
        self._enter = min(1.0, share / (1.0 - share) * self._leave)
        self._rng = rng
        self._lost = bool(rng.random() < share)
        self._first = True

    def lost(self) -> bool:
        """Whether the next sample is lost."""
        if self._first:
            self._first = False
            return self._lost
        u = self._rng.random()
        self._lost = u >= self._leave if self._lost else u < self._enter
        return self._lost
