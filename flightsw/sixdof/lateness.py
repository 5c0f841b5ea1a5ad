"""How late a gyro comes, by what an attitude reference turns beyond it (docs/sources/recovery.md 9)."""

from __future__ import annotations

import math

from flightsw.types import Vec3

LATE_S = 0.1  # [s] that takes the damping out of a law
CLEAR = 3.0  # [-] sigmas of the lateness found, below half of that


class Lateness:
    """Least squares of one lateness of all axes. `take` each pair of looks, T apart; begins anew with `begin`."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Nothing is known."""
        self._xx = self._xy = self._noise = 0.0

    def take(self, more: Vec3, faster: Vec3, noise: float) -> None:
        """more [3] rad: what the reference has turned beyond the gyro over T; faster [3] rad/s: the gyro's rates less those T
        before, noise [rad^2/s^2]: variance of one of its rates. A gyro late by tau has turned tau times that too little."""
        self._noise += 6.0 * noise  # of two rates about three axes
        for y, x in zip(more, faster, strict=True):
            self._xx += x * x
            self._xy += x * y

    def in_time(self, scatter: float) -> bool:
        """Whether the gyro is clearly less late than half of LATE_S; scatter [rad^2]: variance of one reading of the reference.

        tau = sum(xy)/S, S = sum(xx) less what the gyro's noise makes of it, which would have the lateness smaller. Each reading
        is in two looks, of noise n(t) - n(t - T): the variance of tau is at most 4 scatter sum(xx)/S^2.
        """
        motion = self._xx - self._noise
        if motion <= 0.0:
            return False
        return (self._xy + CLEAR * 2.0 * math.sqrt(scatter * self._xx)) / motion < 0.5 * LATE_S
