"""Readings of the transport's sensors as its estimator takes them: along and across the vertical plane of its heading."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.planar import plane
from flightsw.types import UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, SensorFrame


class Readings:
    """`z` [9] (dynamics.py), `psi` heading [rad], `pos_n` north, east [m], as last read."""

    def __init__(self, gravity_mps2: float) -> None:
        self.z = np.zeros(k.NY)
        self.psi, self._pitch = 0.0, math.nan
        self.pos_n = (0.0, 0.0)
        self._g = gravity_mps2

    def take(self, f: SensorFrame, updated: int) -> int:
        """Into z; bits of those that are new and good. Heading, pitch and position keep their last good values."""
        z, ok = self.z, 0
        if updated & UPD_ATT:
            self.psi, self._pitch = plane.heading_and_pitch(f.att_q_nb)
            z[k.Y_TH] = self._pitch
            ok |= 1 << k.Y_TH
        psi, pitch = self.psi, self._pitch
        if updated & UPD_BARO:
            z[k.Y_H] = f.baro_alt_m
            ok |= 1 << k.Y_H
        if updated & UPD_GNSS:
            (north, east, _), (v_north, v_east, sink) = f.gnss_pos_n, f.gnss_vel_n
            self.pos_n = north, east
            z[k.Y_VG] = v_north * math.cos(psi) + v_east * math.sin(psi)
            z[k.Y_HD] = -sink
            ok |= 1 << k.Y_VG | 1 << k.Y_HD
        if updated & UPD_IMU:  # accelerations over ground: specific force turned by the pitch as read, less gravity
            (along, _, down), (_, z[k.Y_Q], _) = f.acc_mean_b, f.gyro_mean_b
            z[k.Y_XDD] = along * math.cos(pitch) + down * math.sin(pitch)
            z[k.Y_HDD] = along * math.sin(pitch) - down * math.cos(pitch) - self._g
            ok |= 1 << k.Y_Q
            if updated & UPD_ATT:
                ok |= 1 << k.Y_XDD | 1 << k.Y_HDD
        for c, reading in zip((k.Y_VA, k.Y_AL), plane.probe(f, updated), strict=True):
            if reading is not None:
                z[c] = reading
                ok |= 1 << c
        return ok
