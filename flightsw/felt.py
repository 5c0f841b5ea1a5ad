"""Inertial acceleration as accelerometers and attitude reference have it."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.rotations import dcm_from_quat, to_parent, vec3
from flightsw.types import SensorFrame, Vec3

ATTITUDE_US = 200_000  # [us] an older attitude turns no specific force


class Felt:
    """a = C' f + g by the attitude reference of a frame."""

    def __init__(self) -> None:
        self._R, self._f, self._a = np.zeros(9), np.zeros(3), np.zeros(3)
        self._att_us = -1

    def acceleration(self, f: SensorFrame, force: Vec3) -> Vec3 | None:
        """a [3] m/s^2 NED of a specific force [3] m/s^2 in body axes; None: there is no attitude of about this time."""
        if not f.att_t_us > 0 or f.t_us - f.att_t_us > ATTITUDE_US:
            return None
        if f.att_t_us != self._att_us:
            self._att_us = f.att_t_us
            dcm_from_quat(np.array(f.att_q_nb), self._R)
        self._f[:] = force
        to_parent(self._R, self._f, self._a)
        x, y, z = vec3(self._a)
        return x, y, z + G0
