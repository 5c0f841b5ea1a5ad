"""The bank kept a fixed time behind, where the motion of both aircraft is known, and carried on from there to now."""

from __future__ import annotations

import numpy as np

from flightsw.felt import Felt
from flightsw.kernels.rotations import added, to_parent
from flightsw.missions.receiver.integrity import horizon_kernel, way_kernel
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.horizon_kernel import STEP_US, VEL, XI
from flightsw.missions.receiver.integrity.layout import BOOM, GNSS, REL, WAKE
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.readings import Offer, Readings, cross
from flightsw.missions.receiver.integrity.unrest import Unrest
from flightsw.missions.receiver.integrity.waiting import Waiting
from flightsw.missions.receiver.integrity.way import Way
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.layout import TK, TK_DCM, TK_RATE
from flightsw.types import UPD_FIX, UPD_IMU, ZERO3, SensorFrame, Vec3


class Horizon:
    """Readings wait here until the bank has come to their time. `feel`, then `advance`, once a step. Source: separation.md 1."""

    def __init__(self, p: IntegrityParams, bank: Bank) -> None:
        self.p, self.bank, self.unrest, self._lag_us = p, bank, Unrest(p), round(p.lag_s * 1e6)
        self._way, self.waiting = Way(), Waiting(bank.n)
        # filter 0 carried on from the bank's time to now (`way_kernel.build`)
        self._path, self._rows = np.zeros((2 + self._lag_us // STEP_US, way_kernel.PATH)), 1
        self._felt, self._last = Felt(), np.zeros(3)  # acceleration of the bank's last step
        self._now = np.zeros(horizon_kernel.NOW)
        self._axes: list[float] = self._now.tolist()  # the tanker at the last step, and the receiver behind it
        self._felt_us = -1  # end of the last step

    def exercise(self, rows: Readings) -> None:
        """All of rows, bank and the way to it that a step calls, once; the bank is to be started then."""
        self.bank.start(0, np.zeros(3), np.zeros(3), ZERO3)
        other, peer = Horizon(self.p, self.bank), PeerTracker()
        for k in range(2):  # a step that is prepared for, and one like it
            other.waiting.wait(other.waiting.place(WAKE, k * STEP_US, 1))
            other.advance(k * STEP_US + self._lag_us, peer, 0)
        other.offer(rows, 1 << REL | 1 << GNSS | 1 << BOOM, SensorFrame(), peer)
        self.bank.exercise()

    def feel(self, f: SensorFrame, new: int) -> float:
        """Take in the accelerations of the step that ends now, new: UPD_* of sound readings; its length [s], 0 for the first."""
        acc = self._felt.acceleration(f, f.acc_mean_b) if new & UPD_IMU and f.gyro_count else None
        before, self._felt_us = self._felt_us, f.t_us
        self._way.own(before, f.t_us, acc)
        if new & UPD_FIX:
            self._way.other(f.fix.gain)
        return (f.t_us - before) * 1e-6 if before >= 0 else 0.0

    @property
    def felt(self) -> bool:
        """Whether the own acceleration of the last step is known."""
        return self._way.felt_now

    def start(self, f: SensorFrame, peer: PeerTracker, excluded: int) -> None:
        """Begin where the relative sensor has the receiver, without the sources `excluded` (mask): d = C' xi, u = C' (xi' + w x
        xi)."""
        tk = np.zeros(TK)
        peer.stage(f.rel_t_us, tk)
        C, swing = tk[TK_DCM], cross(tk[TK_RATE].tolist(), f.rel_pos_t)
        d, u = np.zeros(3), np.zeros(3)
        to_parent(C, np.array(f.rel_pos_t), d)
        to_parent(C, np.add(f.rel_vel_t, swing), u)
        self.bank.start(f.t_us - self._lag_us, d, u, f.rel_pos_t, excluded)
        self.waiting.clear()

    def advance(self, now_us: int, peer: PeerTracker, live: int) -> None:
        """The bank to now_us less its lag, by way of every reading that waits and is older; what it says is of now_us then.

        live: sources heard and believed, a mask; readings of one left out since are dropped.
        """
        to_us, bank, way, p = now_us - self._lag_us, self.bank, self._way, self.p
        while True:
            bank.t_us, end_us, way.felt, way.known = horizon_kernel.advanced(
                bank.t_us, to_us, live, *way.arrays, peer.acceleration, peer.coasting, way.felt, way.known, p.accel_blind,
                p.accel_most, self._last, self.unrest.learnt, *bank.arrays, *self.waiting.arrays,
            )  # fmt: skip
            if bank.t_us >= end_us:
                break
            self._last[:] = acc = way.over(bank.t_us, end_us, peer)
            bank.predict(end_us, acc, self.unrest.density if way.known else self._blind)
        R, w, v, a, _ = peer.sample
        self._rows, felt, known = horizon_kernel.expected(
            bank.t_us, now_us, *way.arrays, a, peer.coasting, bank.X, self._path, R, w, v, peer.t_us, bank.place, self._now
        )  # fmt: skip
        if self._rows > 1:
            way.felt, way.known = felt, known
        self._axes = now = self._now.tolist()
        ahead = max(self.unrest.density, p.accel_ahead) if way.known else self._blind
        bank.stand(now_us, (now[XI], now[XI + 1], now[XI + 2]), ahead)

    @property
    def _blind(self) -> float:
        """Density [m/s^2 per sqrt(Hz)] of a way that was not measured; nothing is known of one that was not felt."""
        return max(self.unrest.density, self.p.accel_blind if self._way.felt else self.p.accel_most)

    def offer(self, rows: Readings, which: int, f: SensorFrame, peer: PeerTracker) -> Offer:
        """Readings of the sources `which` (mask) of a frame, as `Readings.offer`."""
        return rows.offer(which, f, peer, self.waiting, self.bank, self._path, self._rows, self._blind)

    def surprise(self, k: int) -> float:
        """How far the reading at place k of `waiting` lies off what filter 0 expects at its time, the worst row in its sigmas."""
        return self.bank.surprise(self.waiting[k], self._path, self._rows, self._blind)

    def place(self, m: int) -> tuple[Vec3, Vec3]:
        """Position [m] of filter m and its rate [m/s] in tanker axes at the time of the last step: xi' = C u - w x xi."""
        (x, y, z), off = self.bank.apart(m)
        a, b, c = self.bank.xi
        C = self._axes
        xi, u = (a + x, b + y, c + z), added((C[VEL], C[VEL + 1], C[VEL + 2]), off)
        swing = cross(C[TK_RATE], xi)
        return xi, (
            C[0] * u[0] + C[1] * u[1] + C[2] * u[2] - swing[0],
            C[3] * u[0] + C[4] * u[1] + C[5] * u[2] - swing[1],
            C[6] * u[0] + C[7] * u[1] + C[8] * u[2] - swing[2],
        )

    def turned(self, v: Vec3) -> Vec3:
        """v [3] from the tanker's axes of now into NED."""
        C, (x, y, z) = self._axes, v
        return C[0] * x + C[3] * y + C[6] * z, C[1] * x + C[4] * y + C[7] * z, C[2] * x + C[5] * y + C[8] * z
