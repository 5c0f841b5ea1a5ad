"""The bank kept a fixed time behind, where the motion of both aircraft is known, and carried on from there to now."""

from __future__ import annotations

import numpy as np

from flightsw.felt import Felt
from flightsw.kernels.rotations import added, to_parent
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.readings import Reading, cross
from flightsw.missions.receiver.integrity.unrest import RATED, Unrest
from flightsw.missions.receiver.integrity.way import Ahead, Way
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.layout import TK, TK_DCM, TK_RATE
from flightsw.types import UPD_FIX, UPD_IMU, ZERO3, SensorFrame, Vec3

STEP_US = 50_000  # [us] longest step of the bank


class Horizon:
    """Readings wait here until the bank has come to their time. `feel`, then `advance`, once a step. Source: separation.md 1."""

    def __init__(self, p: IntegrityParams, bank: Bank) -> None:
        self.p, self.bank, self.unrest, self._lag_us = p, bank, Unrest(p), round(p.lag_s * 1e6)
        self._way, self._ahead = Way(), Ahead(self._lag_us, STEP_US)
        self._felt, self._tk, self._last = Felt(), np.zeros(TK), ZERO3
        self._axes: list[float] = self._tk.tolist()  # the tanker at the last step
        self._waiting: list[Reading] = []
        self._felt_us = -1  # end of the last step

    def exercise(self) -> None:
        """All of the bank and of the way to it that a step calls, once; the bank is to be started then."""
        self.bank.exercise()
        way, peer = Way(), PeerTracker()
        way.over(0, STEP_US, peer)
        Ahead(self._lag_us, STEP_US).build(0, self._lag_us, way, peer, self.bank.X)

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
        peer.stage(f.rel_t_us, self._tk)
        C, swing = self._tk[TK_DCM], cross(self._tk[TK_RATE].tolist(), f.rel_pos_t)
        d, u = np.zeros(3), np.zeros(3)
        to_parent(C, np.array(f.rel_pos_t), d)
        to_parent(C, np.add(f.rel_vel_t, swing), u)
        self.bank.start(f.t_us - self._lag_us, d, u, f.rel_pos_t, excluded)
        self._waiting.clear()

    def advance(self, now_us: int, peer: PeerTracker, live: int) -> None:
        """The bank to now_us less its lag, by way of every reading that waits and is older; what it says is of now_us then.

        live: sources heard and believed, a mask; readings of one left out since are dropped.
        """
        to_us = now_us - self._lag_us
        self._waiting.sort(key=lambda r: r.t_us)
        while self._waiting and self._waiting[0].t_us <= to_us:
            reading = self._waiting.pop(0)
            self._predict(reading.t_us, peer)
            reading.seen_from(self.bank.t_us, self._last)
            self.bank.correct(reading)
            self.unrest.hear(reading.source, self.bank.z, (bool(live >> RATED[0] & 1), bool(live >> RATED[1] & 1)))
        self._predict(to_us, peer)
        self._ahead.build(self.bank.t_us, now_us, self._way, peer, self.bank.X)
        peer.stage(now_us, self._tk)
        self._axes = self._tk.tolist()
        ahead = max(self.unrest.density, self.p.accel_ahead) if self._way.known else self._blind
        self.bank.stand(now_us, self._ahead.at(now_us)[0], self._tk[TK_DCM], ahead)

    def _predict(self, t_us: int, peer: PeerTracker) -> None:
        while self.bank.t_us < t_us:
            to_us = min(t_us, self.bank.t_us + STEP_US)
            self._last = self._way.over(self.bank.t_us, to_us, peer)
            self.bank.predict(to_us, self._last, self.unrest.density if self._way.known else self._blind)

    @property
    def _blind(self) -> float:
        """Density [m/s^2 per sqrt(Hz)] of a way that was not measured; nothing is known of one that was not felt."""
        return max(self.unrest.density, self.p.accel_blind if self._way.felt else self.p.accel_most)

    def surprise(self, reading: Reading) -> float:
        """How far a reading lies off what filter 0 expects at its time, the worst row in its sigmas."""
        return self.bank.surprise(reading, self._ahead.path, self._ahead.rows, self._blind)

    def wait(self, reading: Reading) -> None:
        """Let a reading wait for the bank."""
        self._waiting.append(reading)

    def drop(self, source: int) -> None:
        """Readings of a source that wait are not used."""
        self._waiting = [r for r in self._waiting if r.source != source]

    def at(self, t_us: int) -> Vec3:
        """Position [m] NED expected at t_us, from the bank's time to now."""
        return self._ahead.at(t_us)[0]

    def place(self, t_us: int, m: int) -> tuple[Vec3, Vec3]:
        """Position [m] of filter m and its rate [m/s] in tanker axes at now, t_us: xi' = C u - w x xi."""
        (x, y, z), off = self.bank.apart(m)
        a, b, c = self.bank.xi
        C = self._axes
        xi, u = (a + x, b + y, c + z), added(self._ahead.at(t_us)[1], off)
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
