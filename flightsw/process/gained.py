"""Velocity gained by the own accelerometers, for another aircraft that wants to know the motion between fixes."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.rotations import dcm_from_quat, to_parent, vec3
from flightsw.types import UPD_IMU, Gain, SensorFrame


class Gained:
    """Sums specific force, turned by the attitude reference, and gravity: dv = sum (C' f + g) dt. One `add` a tick."""

    def __init__(self) -> None:
        self._R, self._f, self._a, self._v = np.zeros(9), np.zeros(3), np.zeros(3), np.zeros(3)
        self._from_us = self._t_us = self._att_us = -1

    def add(self, f: SensorFrame) -> None:
        """Take in a frame; one without a specific force ends the sum, which begins anew with the next."""
        if not f.updated & UPD_IMU or f.t_us <= self._t_us:
            self._from_us = -1
            return
        if self._from_us < 0:
            self._from_us = self._t_us = f.t_us
            self._v[:] = 0.0
            return
        if f.att_t_us != self._att_us:
            self._att_us = f.att_t_us
            dcm_from_quat(np.array(f.att_q_nb), self._R)
        self._f[:] = f.acc_b
        to_parent(self._R, self._f, self._a)
        self._a[2] += G0
        self._v += self._a * ((f.t_us - self._t_us) * 1e-6)
        self._t_us = f.t_us

    def take(self) -> Gain:
        """What was gained since the last `take`; span 0 where there is nothing, or something was missing."""
        out = Gain()
        if 0 <= self._from_us < self._t_us:
            out = Gain(self._t_us, (self._t_us - self._from_us) * 1e-6, vec3(self._v))
            self._from_us = self._t_us
        self._v[:] = 0.0
        return out
