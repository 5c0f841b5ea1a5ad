"""Rows of each source for the bank: what it reads of the relative position and velocity, and which errors are in it.

A reading waits until the bank has come to its time; one that is older than the bank is taken at its age. Source: separation.md 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import less
from flightsw.missions.receiver.airdata.witness import WakeRows
from flightsw.missions.receiver.integrity import rows_kernel
from flightsw.missions.receiver.integrity.layout import (
    AB,
    B_FW,
    B_OW,
    BOOM,
    GNSS,
    GV,
    NB,
    REL,
    ROWS,
    WAKE,
    D,
    G,
    U,
)
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.layout import TK
from flightsw.types import SensorFrame, Vec3

EYE = np.eye(3)


@dataclass(slots=True)
class Reading:
    """Rows H [ROWS,n] at the time of the sample, y [ROWS], variances r [ROWS] of one source; `count` of them are filled: three
    of the position, then three of the velocity."""

    source: int
    t_us: int
    H: np.ndarray
    y: np.ndarray
    r: np.ndarray
    count: int

    def seen_from(self, t_us: int, acc: Vec3) -> None:
        """Let the rows be of the state at t_us, `age` after the sample, with acceleration acc [3] m/s^2 NED since:
        d(t - age) = d - u age + a age^2 / 2, u(t - age) = u - a age."""
        age = (t_us - self.t_us) * 1e-6
        if age > 0.0:
            gained = np.array(acc)
            at, by = self.H[:, D].copy(), self.H[:, U].copy()
            self.H[:, U] -= age * at
            self.H[:, AB] += 0.5 * age * age * at - age * by
            self.y += ((age * by - 0.5 * age * age * at) * gained).sum(axis=1)


class Readings:
    """What a source reads as rows."""

    def __init__(self, p: IntegrityParams, tanker: Aircraft, receiver: Aircraft, n: int = NB) -> None:
        """n: states of the bank."""
        self.p, self.boom, self.receptacle, self._n = p, tanker.boom, receiver.receptacle, n
        self._tk, self._latched = np.zeros(TK), np.zeros(rows_kernel.LATCHED)
        if self.boom is not None and self.receptacle is not None:
            self._latched[: rows_kernel.QUAT] = *self.boom.pivot_m, *self.receptacle.position_m
        self._ones = np.ones(ROWS)
        self._gnss_H, self._gnss_r = np.zeros((ROWS, n)), np.empty(ROWS)
        self._gnss_H[:3, D] = self._gnss_H[:3, G] = self._gnss_H[3:, U] = self._gnss_H[3:, GV] = EYE
        self._gnss_r[:3], self._gnss_r[3:] = 2.0 * p.gnss_pos_m * p.gnss_pos_m, 2.0 * p.gnss_vel_mps * p.gnss_vel_mps

    def _empty(self, source: int, t_us: int) -> Reading:
        """Without a row filled in, three of a position."""
        return Reading(source, t_us, np.zeros((ROWS, self._n)), np.zeros(ROWS), self._ones.copy(), 3)

    def relative(self, f: SensorFrame, peer: PeerTracker, d: Vec3) -> Reading:
        """Relative sensor: xi + slow + constant error; its rate xi' = C u - w x xi, + slow error; d [3] m: where the receiver is,
        NED, near enough for what turns with it."""
        p, out = self.p, self._empty(REL, f.rel_t_us)
        R, w, v, a, _ = peer.sample
        rows_kernel.relative(
            R, w, v, a, (f.rel_t_us - peer.t_us) * 1e-6, *d, *f.rel_pos_t, *f.rel_vel_t, p.rel_pos_m * p.rel_pos_m,
            p.rel_vel_mps * p.rel_vel_mps, p.rate_radps * p.rate_radps, self._tk, out.H, out.y, out.r,
        )  # fmt: skip
        out.count = 6
        return out

    def gnss(self, f: SensorFrame, own_pos: Vec3, own_vel: Vec3) -> Reading:
        """Difference of both aircraft's raw fixes of one instant: d + slow error, u + slow error."""
        fix = f.fix
        y = np.array((*less(own_pos, fix.pos_n), *less(own_vel, fix.vel_n)))
        return Reading(GNSS, fix.t_us, self._gnss_H.copy(), y, self._gnss_r.copy(), 6)

    def wake(self, w: WakeRows) -> Reading:
        """The air data in the wake: two rows of d + lasting + passing error. The tanker's attitude is not in them: their axes lie
        along its way through the air."""
        out = self._empty(WAKE, w.t_us)
        out.H[:2, D], out.y[:2], out.r[:2] = w.H, w.y, w.r
        for i in range(2):
            out.H[i, B_OW + i] = out.H[i, B_FW + i] = 1.0
        out.count = 2
        return out

    def latched(self, f: SensorFrame, peer: PeerTracker, d: Vec3) -> Reading | None:
        """The boom in the receptacle: pivot + L(elevation, azimuth, extension) - the receptacle's lever = xi + fixed error, d as
        above; None where either aircraft has none."""
        boom, p = self.boom, self.p
        if boom is None or self.receptacle is None:
            return None
        out = self._empty(BOOM, f.boom_t_us)
        length = boom.length_retracted_m + f.boom_extension_m
        ce, se = math.cos(f.boom_elevation), math.sin(f.boom_elevation)
        ca, sa = math.cos(f.boom_azimuth), math.sin(f.boom_azimuth)
        across = p.boom_angle_rad * length
        R, w, v, a, _ = peer.sample
        self._latched[rows_kernel.QUAT : rows_kernel.ATT] = f.att_q_nb
        rows_kernel.latched(
            R, w, v, a, (f.boom_t_us - peer.t_us) * 1e-6, *d, -length * ce * ca, length * ce * sa, -length * se,
            across * across + p.boom_ext_m * p.boom_ext_m, self._latched, self._tk, out.H, out.y, out.r,
        )  # fmt: skip
        return out


def cross(a: Sequence[float], b: Sequence[float]) -> Vec3:
    """a x b, both [3]."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
