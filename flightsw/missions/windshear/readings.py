"""Readings of the transport's sensors as its estimator takes them: along and across the vertical plane of its heading."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.planar import plane
from flightsw.types import UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, UPD_RADALT, SensorFrame

PAST = 50  # samples of the acceleration's integral that are kept: a velocity older than that is taken as it is


class Readings:
    """`z` [10] (dynamics.py), `psi` heading [rad], `pos_n` north, east [m], as last read; `satellite_m` height [m] by satellite,
    NaN unless new.

    A velocity of the satellites comes late: what the accelerations have added since its time stamp is added to it.
    """

    def __init__(self, gravity_mps2: float) -> None:
        self.z = np.zeros(k.NZ)
        self.satellite_m = math.nan
        self._gained = (0.0, 0.0)  # [m/s] integral of the accelerations along and up
        self._past: deque[tuple[int, float, float]] = deque(maxlen=PAST)  # its values by time, latest last
        self._t_us = 0
        self.psi, self._pitch = 0.0, math.nan
        self.pos_n = (0.0, 0.0)
        self._g = gravity_mps2

    def take(self, f: SensorFrame, updated: int) -> int:
        """Into z; bits of those that are new and good. Heading, pitch and position keep their last good values."""
        z, ok = self.z, 0
        self.satellite_m = math.nan
        if updated & UPD_ATT:
            self.psi, self._pitch = plane.heading_and_pitch(f.att_q_nb)
            z[k.Y_TH] = self._pitch
            ok |= 1 << k.Y_TH
        psi, pitch = self.psi, self._pitch
        if updated & UPD_BARO:
            z[k.Y_H] = f.baro_alt_m
            ok |= 1 << k.Y_H
        if updated & UPD_IMU:  # accelerations over ground: specific force turned by the pitch as read, less gravity
            (along, _, down), (_, z[k.Y_Q], _) = f.acc_mean_b, f.gyro_mean_b
            z[k.Y_XDD] = along * math.cos(pitch) + down * math.sin(pitch)
            z[k.Y_HDD] = along * math.sin(pitch) - down * math.cos(pitch) - self._g
            ok |= 1 << k.Y_Q
            if updated & UPD_ATT:
                ok |= 1 << k.Y_XDD | 1 << k.Y_HDD
        self._integrate(f.t_us)
        if updated & UPD_GNSS:
            (north, east, below), (v_north, v_east, sink) = f.gnss_pos_n, f.gnss_vel_n
            self.pos_n, self.satellite_m = (north, east), -below
            along, up = self._since(f.gnss_t_us) if f.gnss_t_us < f.t_us else (0.0, 0.0)
            z[k.Y_VG] = v_north * math.cos(psi) + v_east * math.sin(psi) + along
            z[k.Y_HD] = up - sink
            ok |= 1 << k.Y_VG | 1 << k.Y_HD
        if updated & UPD_RADALT:
            z[k.Y_RA] = f.radalt_m
            ok |= 1 << k.Y_RA
        for c, reading in zip((k.Y_VA, k.Y_AL), plane.probe(f, updated), strict=True):
            if reading is not None:
                z[c] = reading
                ok |= 1 << c
        return ok

    def _integrate(self, t_us: int) -> None:
        """The accelerations as last read, over the time since the sample before."""
        dt = (t_us - self._t_us) * 1e-6 if self._past else 0.0
        along, up = self._gained
        a, b = float(self.z[k.Y_XDD]), float(self.z[k.Y_HDD])
        if math.isfinite(a) and math.isfinite(b):
            self._gained = along + a * dt, up + b * dt
        self._past.append((t_us, *self._gained))
        self._t_us = t_us

    def _since(self, t_us: int) -> tuple[float, float]:
        """Velocity gained [m/s], along and up, from t_us to now."""
        along, up = self._gained
        for then, a, b in reversed(self._past):
            if then <= t_us:
                return along - a, up - b
        return 0.0, 0.0
