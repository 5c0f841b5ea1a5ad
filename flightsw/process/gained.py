"""Velocity gained by the own accelerometers, for another aircraft that wants to know the motion between fixes."""

from __future__ import annotations

from flightsw.felt import Felt
from flightsw.types import NO_GAIN, UPD_IMU, ZERO3, Gain, SensorFrame


class Gained:
    """Sums the inertial acceleration over the ticks. One `add` a tick."""

    def __init__(self) -> None:
        self._felt, self._v = Felt(), ZERO3
        self._from_us = self._t_us = -1

    def add(self, f: SensorFrame) -> None:
        """Take in a frame; one without specific force or attitude ends the sum, which begins anew with the next."""
        t_us, last_us = f.t_us, self._t_us
        acc = self._felt.acceleration(f, f.acc_b) if f.updated & UPD_IMU and t_us > last_us else None
        if acc is None:
            self._from_us = -1
        elif self._from_us < 0:
            self._from_us, self._v = t_us, ZERO3
        else:
            dt, (x, y, z) = (t_us - last_us) * 1e-6, self._v
            self._v = (x + acc[0] * dt, y + acc[1] * dt, z + acc[2] * dt)
        if t_us > last_us:
            self._t_us = t_us

    def take(self) -> Gain:
        """What was gained since the last `take`; span 0 where there is nothing, or something was missing."""
        if not 0 <= self._from_us < self._t_us:
            return NO_GAIN
        out = Gain(self._t_us, (self._t_us - self._from_us) * 1e-6, self._v)
        self._from_us, self._v = self._t_us, ZERO3
        return out
