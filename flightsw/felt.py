"""Inertial acceleration as accelerometers and attitude reference have it."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.rotations import dcm_from_quat
from flightsw.types import SensorFrame, Vec3

ATTITUDE_US = 200_000  # [us] an older attitude turns no specific force


class Felt:
    """a = C' f + g by the attitude reference of a frame."""

    def __init__(self) -> None:
        self._R = np.zeros(9)
        self._C: list[float] = self._R.tolist()
        self._att_us = -1

    def acceleration(self, f: SensorFrame, force: Vec3) -> Vec3 | None:
        """a [3] m/s^2 NED of a specific force [3] m/s^2 in body axes; None: there is no attitude of about this time."""
        if not f.att_t_us > 0 or f.t_us - f.att_t_us > ATTITUDE_US:
            return None
        if f.att_t_us != self._att_us:
            self._att_us = f.att_t_us
            dcm_from_quat(np.array(f.att_q_nb), self._R)
            self._C = self._R.tolist()
        C, (x, y, z) = self._C, force
        return (
            C[0] * x + C[3] * y + C[6] * z,
            C[1] * x + C[4] * y + C[7] * z,
            C[2] * x + C[5] * y + C[8] * z + G0,
        )
