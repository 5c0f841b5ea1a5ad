"""The servos of the model in force, as the laws look at them."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

Array = np.ndarray


def slow_by(ll: Array, lag_s: Array, most_s: float) -> float:
    """Log-likelihood by which the models that lag by more than most_s [s] lead the others, of those of all models [c] and their
    lags [c]; inf where all do, -inf where none does."""
    slow = lag_s > most_s
    if slow.all():
        return math.inf
    return float(ll[slow].max() - ll[~slow].max()) if slow.any() else -math.inf


class Bank(Protocol):
    """What is asked of the bank: surfaces and rates [models,3] at this sample, commands sent (newest first), the model in force
    and the age of the command that reaches its servos."""

    now: Array
    rate: Array
    sent: Array
    chosen: int

    @property
    def late(self) -> int:
        """Samples between a command and the servos, of the model in force."""


class Believed:
    """A view of a bank that satisfies gust.servos.Servos."""

    def __init__(self, bank: Bank) -> None:
        self._bank = bank

    @property
    def now(self) -> Array:
        """Surfaces [3] at this sample: elevator [rad], throttle setting, flap [rad]."""
        return np.asarray(self._bank.now[self._bank.chosen])

    @property
    def rate(self) -> Array:
        """Their rates [3]."""
        return np.asarray(self._bank.rate[self._bank.chosen])

    @property
    def queue(self) -> Array:
        """Commands under way [late,3]: row 0 reaches the servos with the next step."""
        return np.asarray(self._bank.sent[: self._bank.late][::-1])
