"""Readings of different age brought to one time: short histories of what each sensor said, by its own stamps."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.linalg import inner
from flightsw.kernels.rotations import dcm_from_quat, to_parent
from flightsw.sixdof.windcal.kernel import aligned, between, push
from flightsw.sixdof.windcal.layout import ATTITUDE, H_AIR, H_QUAT, H_VEL, MOTION, READINGS, Z_V, T
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, SensorFrame

VEL = slice(H_VEL, H_VEL + 3)
QUAT = slice(H_QUAT, H_QUAT + 4)
AIR = slice(H_AIR, H_AIR + 3)
ROWS = 12  # held of each: 0.55 s at 20 Hz
FIX_MAX_S = 2.0  # [s] dead reckoning after the last satellite velocity: 0.05 m/s by a tilt of 0.15 deg
GAP_S = 0.5  # [s] between two frames beyond which nothing is carried on


class Histories:
    """Velocity at any recent time: satellite velocity carried on by specific force; attitude and readings between samples."""

    def __init__(self) -> None:
        self.motion = np.full((ROWS, MOTION), np.nan)
        self.attitude = np.full((ROWS, ATTITUDE), np.nan)
        self.readings = np.full((ROWS, READINGS), np.nan)
        self.v, self.R, self.z = np.zeros(3), np.zeros(9), np.zeros(3)
        self._row = np.zeros(ATTITUDE)
        self._fix = np.zeros(3)  # [m/s] dead-reckoned velocity less the satellite's
        self._fix_t, self.air_t = -np.inf, -np.inf
        self._f, self._dv, self._q = np.zeros(3), np.zeros(3), np.zeros(4)
        self.now = np.zeros(9)  # NED to body by the newest attitude

    def take(self, f: SensorFrame, updated: int, air: np.ndarray | None) -> bool:
        """Take in a frame: `updated` what is new and sound in it, air [3] the mean reading (V, beta, alpha) if there is one.
        Whether it was a new one."""
        t, row, q = f.t_us * 1e-6, self._row, self._q
        if updated & UPD_ATT:
            last = self.attitude[-1]
            row[T], row[QUAT] = f.att_t_us * 1e-6, f.att_q_nb
            if not row[T] <= last[T]:
                if inner(last[QUAT], row[QUAT]) < 0.0:
                    row[QUAT] *= -1.0
                push(self.attitude, row)
                q[:] = row[QUAT]
        self._move(f, t)
        if updated & UPD_GNSS and between(self.motion, f.gnss_t_us * 1e-6, 0.0, row):
            self._fix[:] = row[VEL] - f.gnss_vel_n
            self._fix_t = t
        if not (updated & UPD_AIR and air is not None) or not f.air_t_us * 1e-6 > self.air_t:
            return False
        self.air_t = row[T] = f.air_t_us * 1e-6
        row[AIR] = air
        push(self.readings, row)
        return True

    def _move(self, f: SensorFrame, t: float) -> None:
        """Dead-reckoned velocity to the frame's time t [s]."""
        m, row, dv = self.motion, self._row, self._dv
        dt = t - float(m[-1, T])
        if dt == 0.0 or not self._q.any():  # no attitude yet
            return
        # the newest attitude is about as old as the middle of the mean
        dcm_from_quat(self._q, self.now)
        row[T], row[VEL] = t, 0.0
        if 0.0 < dt < GAP_S:
            self._f[:] = f.acc_mean_b
            to_parent(self.now, self._f, dv)
            dv[2] += G0
            dv *= dt
            row[VEL] = dv
            row[VEL] += m[-1, VEL]
        else:
            m[:] = np.nan
            self._fix_t = -np.inf
        push(m, row)

    def align(self, V_lag: float, vane_lag: float) -> float:
        """Bring `v` [3] NED, `R` [9] NED to body and the readings `z` [3] to the time the newest airspeed is of; that time [s],
        NaN if something is not held that long. The lags [s] are those of airspeed and vanes."""
        t = self.air_t - V_lag
        if not self.motion[-1, T] - self._fix_t <= FIX_MAX_S:
            return np.nan
        self.z[Z_V] = self.readings[-1, H_AIR + Z_V]
        held = aligned(
            self.motion, self.attitude, self.readings, self._fix, t, vane_lag, self._row, self.v, self.R, self.z
        )
        return t if held else np.nan
