"""Rows of each source for the bank: what it reads of the relative position and velocity, and which errors are in it.

A reading waits until the bank has come to its time; one that is older than the bank is taken at its age. Source: separation.md 2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.missions.receiver.airdata.witness import WakeRows
from flightsw.missions.receiver.integrity import rows_kernel
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.layout import B_FW, B_OW, BOOM, GNSS, REL, WAKE, D
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.waiting import Waiting
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.layout import TK
from flightsw.types import SensorFrame, Vec3

FIXES = 12  # own fixes kept for the other's of the same instant
# of every source with a reading: which, time of the sample [us], its place in Waiting, how far it lies off
Offer = tuple[tuple[int, int, int, float], ...]


class Readings:
    """What a source reads as rows."""

    def __init__(self, p: IntegrityParams, tanker: Aircraft, receiver: Aircraft) -> None:
        self.boom, self.receptacle = tanker.boom, receiver.receptacle
        self._tk, self._latched = np.zeros(TK), np.zeros(rows_kernel.LATCHED)
        if self.boom is not None and self.receptacle is not None:
            self._latched[: rows_kernel.QUAT] = *self.boom.pivot_m, *self.receptacle.position_m
        self._fixes, self._number = np.zeros((FIXES, rows_kernel.FIX)), 0
        self._noise = np.array([
            p.rel_pos_m * p.rel_pos_m, p.rel_vel_mps * p.rel_vel_mps, p.rate_radps * p.rate_radps,
            2.0 * p.gnss_pos_m * p.gnss_pos_m, 2.0 * p.gnss_vel_mps * p.gnss_vel_mps, p.boom_ext_m * p.boom_ext_m,
            p.boom_angle_rad, 0.0 if self.boom is None else self.boom.length_retracted_m,
        ])  # fmt: skip

    @property
    def latches(self) -> bool:
        """Whether a boom in the receptacle tells anything: both aircraft have one."""
        return self.boom is not None and self.receptacle is not None

    def own(self, f: SensorFrame) -> None:
        """A new own fix, kept for the tanker's of the same instant."""
        self._fixes[self._number % FIXES] = (f.gnss_t_us, *f.gnss_pos_n, *f.gnss_vel_n)
        self._number += 1

    def offer(
        self, which: int, f: SensorFrame, peer: PeerTracker, to: Waiting, bank: Bank, path: np.ndarray, steps: int, density: float
    ) -> Offer:  # fmt: skip
        """Readings of the sources `which` (mask of REL, GNSS, BOOM) into places of `to`, where they do not wait yet, and how far
        they lie off (`Bank.surprise`, of path, steps, density). Of the relative sensor: xi + slow + constant error; its rate
        xi' = C u - w x xi, + slow error. Of both aircraft's raw fixes of one instant: their difference, d + slow error, u + slow
        error; none where no own fix is near. Of the boom in the receptacle: pivot + L(elevation, azimuth, extension) - the
        receptacle's lever = xi + fixed error."""
        fix, (R, w, v, a, _) = f.fix, peer.sample
        while True:
            room, rel, off_rel, both, off_both, boom, off_boom = rows_kernel.offered(
                which, f.rel_t_us, *f.rel_pos_t, *f.rel_vel_t, fix.t_us, *fix.pos_n, *fix.vel_n, f.boom_t_us, f.boom_elevation,
                f.boom_azimuth, f.boom_extension_m, *f.att_q_nb, peer.t_us, R, w, v, a, self._fixes, self._number, self._noise,
                self._latched, self._tk, path, steps, bank.t_us, density * density, *bank.judging, *to.arrays,
            )  # fmt: skip
            if room:
                break
            to.grow()
        all_of = (REL, f.rel_t_us, rel, off_rel), (GNSS, fix.t_us, both, off_both), (BOOM, f.boom_t_us, boom, off_boom)
        return tuple(x for x in all_of if x[2] >= 0)

    def wake(self, w: WakeRows, to: Waiting) -> int:
        """The air data in the wake, two rows of d + lasting + passing error; its place in `to`. The tanker's attitude is not in
        them: their axes lie along its way through the air."""
        k = to.place(WAKE, w.t_us, 2)
        out = to[k]
        out.H[:2, D], out.y[:2], out.r[:2] = w.H, w.y, w.r
        for i in range(2):
            out.H[i, B_OW + i] = out.H[i, B_FW + i] = 1.0
        return k


def cross(a: Sequence[float], b: Sequence[float]) -> Vec3:
    """a x b, both [3]."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
