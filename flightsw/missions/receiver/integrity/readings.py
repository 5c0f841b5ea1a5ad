"""Rows of each source for the bank: what it reads of the relative position and rate, and which errors are in it.

A reading is taken at its own time: xi(t - age) = xi - v age, and what the acceleration since then made of it (Past). Source:
separation.md 2.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, to_child, to_parent
from flightsw.missions.receiver.integrity.layout import (
    B_AB,
    B_AT,
    B_G,
    B_GV,
    B_OB,
    B_RC,
    B_RS,
    B_RV,
    B_V,
    B_XI,
    NB,
    ROWS,
)
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.layout import TK, TK_DCM, TK_RATE
from flightsw.types import SensorFrame, Vec3

AXES = range(3)
STEPS = 20  # of the relative acceleration kept


class Past:
    """The relative acceleration of the last steps: by how much a reading's time differs from now."""

    def __init__(self) -> None:
        self._steps: deque[tuple[float, Vec3]] = deque(maxlen=STEPS)  # [s] length, [m/s^2]; newest first

    def add(self, dt: float, acc: Vec3) -> None:
        """A step of dt [s] with acceleration acc [m/s^2] ends now."""
        self._steps.appendleft((dt, acc))

    def since(self, age: float) -> tuple[Vec3, Vec3]:
        """dx [m], dv [m/s]: xi(now - age) = xi - v age + dx, v(now - age) = v - dv."""
        dx, dv, late = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 0.0
        for dt, a in self._steps:
            part = min(dt, age - late)
            if part <= 0.0:
                break
            arm = age - late - 0.5 * part  # [s] what was gained in this part acted so long too little in -v age
            for i in AXES:
                dv[i] += part * a[i]
                dx[i] += part * arm * a[i]
            late += part
        return (dx[0], dx[1], dx[2]), (dv[0], dv[1], dv[2])


class Readings:
    """Rows H [ROWS,NB], y [ROWS], variances r [ROWS] of one source; `count` of them are filled."""

    def __init__(self, p: IntegrityParams, tanker: Aircraft, receiver: Aircraft) -> None:
        self.p, self.boom, self.receptacle = p, tanker.boom, receiver.receptacle
        self.H, self.y, self.r = np.zeros((ROWS, NB)), np.zeros(ROWS), np.zeros(ROWS)
        self.count = 0
        self._tk, self._a, self._b, self._R, self._rel = (
            np.zeros(TK),
            np.zeros(3),
            np.zeros(3),
            np.zeros(9),
            np.zeros(9),
        )

    def _begin(self, age: float, past: Past) -> None:
        """Empty rows, those of the position at `age` [s] before now."""
        self.H[:], self.count = 0.0, 0
        self._dx, self._dv = past.since(age)
        for i in AXES:
            self.H[i, B_XI + i], self.H[i, B_V + i], self.H[i, B_AB + i] = 1.0, -age, 0.5 * age * age
        self._age = age

    def relative(self, f: SensorFrame, past: Past) -> None:
        """Relative sensor: xi + slow + constant error; its rate + slow error."""
        p = self.p
        self._begin((f.t_us - f.rel_t_us) * 1e-6, past)
        for i in AXES:
            self.H[i, B_RS + i] = self.H[i, B_RC + i] = 1.0
            self.H[3 + i, B_V + i] = self.H[3 + i, B_RV + i] = 1.0
            self.H[3 + i, B_AB + i] = -self._age
            self.y[i], self.r[i] = f.rel_pos_t[i] - self._dx[i], p.rel_pos_m * p.rel_pos_m
            self.y[3 + i], self.r[3 + i] = f.rel_vel_t[i] + self._dv[i], p.rel_vel_mps * p.rel_vel_mps
        self.count = 6

    def gnss(self, f: SensorFrame, own_pos: Vec3, own_vel: Vec3, peer: PeerTracker, past: Past) -> None:
        """Difference of both aircraft's raw fixes of one instant, in tanker axes by its transmitted attitude C of that time.

        C dp = xi + C g + xi x a, C dv - w x xi = v + C g_v.
        """
        fix, p = f.fix, self.p
        self._begin((f.t_us - fix.t_us) * 1e-6, past)
        peer.stage(fix.t_us, self._tk)
        C, w = self._tk[TK_DCM], self._tk[TK_RATE]
        self._a[:] = own_pos
        self._a -= fix.pos_n
        to_child(C, self._a, self._b)
        self.y[:3] = self._b
        x, y, z = xi = self._b.tolist()  # where the receiver is, near enough for what turns with it
        self._a[:] = own_vel
        self._a -= fix.vel_n
        to_child(C, self._a, self._b)
        self.y[3:] = self._b
        swing = cross(w.tolist(), xi)
        turn = (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
        for i in AXES:
            self.H[3 + i, B_V + i], self.H[3 + i, B_AB + i] = 1.0, -self._age
            for j in AXES:
                self.H[i, B_G + j] = self.H[3 + i, B_GV + j] = C[3 * i + j]
                self.H[i, B_AT + j] = turn[i][j]
            self.y[i] -= self._dx[i]
            self.y[3 + i] += self._dv[i] - swing[i]
            self.r[i] = 2.0 * p.gnss_pos_m * p.gnss_pos_m
            self.r[3 + i] = 2.0 * p.gnss_vel_mps * p.gnss_vel_mps
        self.count = 6

    def latched(self, f: SensorFrame, peer: PeerTracker, past: Past) -> None:
        """The boom in the receptacle: pivot + L(elevation, azimuth, extension) - the receptacle's lever = xi + fixed error."""
        self._begin((f.t_us - f.boom_t_us) * 1e-6, past)
        boom, receptacle, p = self.boom, self.receptacle, self.p
        if boom is None or receptacle is None:
            return
        length = boom.length_retracted_m + f.boom_extension_m
        ce, se = math.cos(f.boom_elevation), math.sin(f.boom_elevation)
        ca, sa = math.cos(f.boom_azimuth), math.sin(f.boom_azimuth)
        peer.stage(f.boom_t_us, self._tk)
        dcm_from_quat(np.array(f.att_q_nb), self._R)
        mul33_t(self._R, self._tk[TK_DCM], self._rel)  # tanker to own body
        to_parent(self._rel, np.array(receptacle.position_m), self._a)
        arm = (-length * ce * ca, length * ce * sa, -length * se)
        across = p.boom_angle_rad * length
        for i in AXES:
            self.H[i, B_OB + i] = 1.0
            self.y[i] = boom.pivot_m[i] + arm[i] - self._a[i] - self._dx[i]
            self.r[i] = across * across + p.boom_ext_m * p.boom_ext_m
        self.count = 3


def cross(a: Sequence[float], b: Sequence[float]) -> Vec3:
    """a x b, both [3]."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
