"""Sensor health: age, range and stuck checks per group. A bad sample is taken out of the frame, never passed on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter, ne
from typing import Annotated

from flightsw.strict import IN_FLIGHT, ConfigError, Range
from flightsw.types import (
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_PEER,
    HF_REL,
    UPD_AIR,
    UPD_ATT,
    UPD_FIX,
    UPD_GNSS,
    UPD_IMU,
    UPD_PEER,
    UPD_RADALT,
    UPD_REL,
    Health,
    PeerFix,
    SensorFrame,
    Text,
    Vec3,
    copied,
)

SENSORS = HF_IMU | HF_AIR | HF_ATT | HF_GNSS | HF_REL | HF_PEER
WHOLE_PROBE, AIR_V, AIR_BETA, AIR_ALPHA = 0, 1, 2, 4
RADALT_MAX_M = 762.0  # [m] 2500 ft: no such set measures beyond
FAR_M = 1e7  # [m] no local position is farther away
START_US = 5_000_000  # [us] grace before a group that never came counts as lost
Age = Annotated[float, Range(0.01, 60.0), IN_FLIGHT]


NAMES = {
    HF_IMU: "IMU",
    HF_AIR: "air data",
    HF_ATT: "attitude",
    HF_GNSS: "GNSS",
    HF_REL: "relative nav",
    HF_PEER: "data link",
}


@dataclass(frozen=True)
class HealthParams:
    """Limits of age [s], of a sample by its stamp and of a group since its last good one; of range (SI); the number of identical
    samples that mean a stuck sensor."""

    imu_age_s: Age = 0.1
    air_age_s: Age = 0.3
    att_age_s: Age = 0.3
    gnss_age_s: Age = 0.5
    rel_age_s: Age = 0.5
    peer_age_s: Age = 0.5
    stuck_samples: Annotated[int, Range(2, 1000), IN_FLIGHT] = 10
    rate_max_radps: float = 6.0
    acc_max_mps2: float = 150.0
    V_min_mps: float = 20.0
    V_max_mps: float = 400.0
    flow_max_rad: float = 0.7
    speed_max_mps: float = 600.0
    rel_max_m: float = 5000.0


OF_GROUP = {
    HF_IMU: ("imu_age_s",),
    HF_AIR: ("air_age_s",),
    HF_ATT: ("att_age_s",),
    HF_GNSS: ("gnss_age_s",),
    HF_REL: ("rel_age_s", "rel_max_m"),
    HF_PEER: ("peer_age_s",),
}


def refuse_unwatched(p: HealthParams, watch: int) -> None:
    """Raise ConfigError for a limit of a group that a mission watching `watch` (HF_* flags) never judges by it."""
    for flag, keys in OF_GROUP.items():
        for key in keys:
            if not watch & flag and getattr(p, key) != getattr(HealthParams, key):
                raise ConfigError(f"health.{key} = {getattr(p, key):g}: this mission does not depend on {NAMES[flag]}")


def _inside(v: Vec3, lim: float) -> bool:
    """Whether every component lies within +-lim (never true of NaN)."""
    x, y, z = v
    return -lim <= x <= lim and -lim <= y <= lim and -lim <= z <= lim


def _unit(q: tuple[float, ...]) -> bool:
    """Whether a quaternion has about unit length (never true of NaN)."""
    w, x, y, z = q
    return 0.9 < math.fsum((w * w, x * x, y * y, z * z)) < 1.1


class HealthMonitor:
    """Judges each new sample, takes the refused ones out of the frame, and keeps the failed flags."""

    NAMES = NAMES

    def __init__(self, p: HealthParams, watch: int, air_used: int = WHOLE_PROBE) -> None:
        """`watch`: HF_* flags of the groups this aircraft depends on; others are not reported. `air_used`: AIR_* bits of the
        readings the mission takes one by one, or WHOLE_PROBE: only a probe good in all three serves.
        """
        self.watch, self.air_used = watch, air_used
        self.out = Health()
        self._last_us: dict[int, int] = {}  # of each group its last good sample; from the first frame on
        # of each channel the last value; those of the air data in a row: airspeeds, sideslips, incidences
        self._value: dict[str, float | tuple[float, ...]] = {"gyro": (), "accelerometer": ()}
        self._air_row: tuple[float, ...] = ()
        self._same: dict[str | int, int] = {}
        self._air_bad = 0  # SensorFrame.air_bad of the last air data
        self.texts: list[Text] = []
        self.use(p)

    def use(self, p: HealthParams) -> None:
        """Judge by other limits from now on."""
        self.p = p
        self._sound_us, self._watched = 0.0, 0  # [us] before it no group of this mask can have been silent for too long
        # flag, UPD_*, age [us], stamp of a sample [us], who judges it
        self._groups = (
            (HF_AIR, UPD_AIR, p.air_age_s * 1e6, attrgetter("air_t_us"), self._air),
            (HF_ATT, UPD_ATT, p.att_age_s * 1e6, attrgetter("att_t_us"), self._attitude),
            (HF_GNSS, UPD_GNSS, p.gnss_age_s * 1e6, attrgetter("gnss_t_us"), self._gnss),
            (HF_REL, UPD_REL, p.rel_age_s * 1e6, attrgetter("rel_t_us"), self._relative),
            (HF_PEER, UPD_PEER, p.peer_age_s * 1e6, attrgetter("peer.t_us"), self._peer),
        )
        self._ages_us = ((HF_IMU, p.imu_age_s * 1e6), *((g[0], g[2]) for g in self._groups))

    def step(self, f: SensorFrame) -> tuple[SensorFrame, Health]:
        """The frame without the groups that are refused and with the air data's refused readings marked, and the health. `f`
        itself stays as it came. Ages run from the first frame."""
        h, t_us, new, watch, last_us = self.out, f.t_us, f.updated, self.watch, self._last_us
        if not last_us:
            # a group never seen gets START_S: the tanker's link opens only when its own navigation is valid
            last_us.update(dict.fromkeys(self.NAMES, t_us + START_US))
        updated = new
        if new & UPD_IMU:  # what it tells is of the step that ends now: no sample is too old
            if self._imu(f):
                last_us[HF_IMU] = t_us
            else:
                updated &= ~UPD_IMU
                h.rejected += 1
        if new & ~UPD_IMU:
            updated = self._others(f, updated)
        failed = 0 if t_us < self._sound_us and watch == self._watched else self._silent(t_us, watch)
        before = h.failed & SENSORS
        if failed != before:
            self._report(failed, before)
            h.failed = (h.failed & ~SENSORS) | failed
            h.reason = ", ".join(n for b, n in self.NAMES.items() if failed & b)
        if updated != new or self._air_bad != f.air_bad:
            sifted = copied(f)
            sifted.updated, sifted.air_bad = updated, self._air_bad
            return sifted, h
        return f, h

    def _others(self, f: SensorFrame, updated: int) -> int:
        """`updated` without the groups that are refused, all but the IMU."""
        new, h, t_us = f.updated, self.out, f.t_us
        for flag, upd, age_us, stamp, good in self._groups:
            if new & upd:
                if good(f) and t_us - stamp(f) <= age_us:
                    self._last_us[flag] = t_us
                else:
                    updated &= ~upd
                    h.rejected += 1
        if new & UPD_RADALT and self._refuses_radalt(f):
            updated &= ~UPD_RADALT
            h.rejected += 1
        if new & UPD_FIX and not self._takes_fix(f.fix):
            updated &= ~UPD_FIX
            h.rejected += 1
        return updated

    def _silent(self, t_us: int, watch: int) -> int:
        """HF_* of the groups in the mask `watch` that have been silent for too long; if none has been, until when none can be."""
        failed, sound_us = 0, math.inf
        for flag, age_us in self._ages_us:
            if flag & watch:
                last = self._last_us[flag]
                failed |= flag if t_us - last > age_us else 0
                sound_us = min(sound_us, last + age_us)
        self._sound_us, self._watched = 0.0 if failed else sound_us, watch
        return failed

    # Whether the new sample of a group is in range and alive. Every channel is looked at, whatever the others are.

    def _imu(self, f: SensorFrame) -> bool:
        gyro, acc, last = f.gyro_b, f.acc_b, self._value
        if last["gyro"] != gyro and last["accelerometer"] != acc and not self._same:
            last["gyro"], last["accelerometer"] = gyro, acc  # 100 times a second: as `_moving`, without calls
        elif not self._moving("gyro", gyro) & self._moving("accelerometer", acc):
            return False
        (p, q, r), (x, y, z), w, a = gyro, acc, self.p.rate_max_radps, self.p.acc_max_mps2  # and as `_inside`
        return -w <= p <= w and -w <= q <= w and -w <= r <= w and -a <= x <= a and -a <= y <= a and -a <= z <= a

    def _attitude(self, f: SensorFrame) -> bool:
        return self._moving("attitude", f.att_q_nb) and _unit(f.att_q_nb)

    def _gnss(self, f: SensorFrame) -> bool:
        alive = self._moving("gnss", f.gnss_pos_n + f.gnss_vel_n)
        return alive and _inside(f.gnss_vel_n, self.p.speed_max_mps) and _inside(f.gnss_pos_n, FAR_M)

    def _relative(self, f: SensorFrame) -> bool:
        p = self.p
        alive = self._moving("relative", f.rel_pos_t + f.rel_vel_t)
        return alive and f.rel_valid and _inside(f.rel_pos_t, p.rel_max_m) and _inside(f.rel_vel_t, p.speed_max_mps)

    def _peer(self, f: SensorFrame) -> bool:
        p, q = self.p, f.peer
        alive = self._moving("peer", q.vel_n + q.q_nb)
        state = _inside(q.vel_n, p.speed_max_mps) and _inside(q.pos_n, FAR_M) and _unit(q.q_nb)
        return alive and state and _inside(q.acc_n, p.acc_max_mps2) and _inside(q.w_b, p.rate_max_radps)

    def _takes_fix(self, q: PeerFix) -> bool:
        """Whether another aircraft's fix is in range and alive. No mission depends on it, so it has no age here."""
        alive = self._moving("peer's fix", q.pos_n + q.vel_n)
        flown = _inside(q.gain.vel_n, self.p.acc_max_mps2 * q.gain.span_s)
        return alive and flown and _inside(q.vel_n, self.p.speed_max_mps) and _inside(q.pos_n, FAR_M)

    def _air(self, f: SensorFrame) -> bool:
        """Mark each refused reading; the group is good while one probe is good in all three, or where readings
        are taken one by one, while one that is used is."""
        p, alive, serving, air_bad = self.p, self._alive, 0, 0
        low, high, most = p.V_min_mps, p.V_max_mps, p.flow_max_rad
        n, row, before = len(f.air_V), f.air_V + f.air_beta + f.air_alpha, self._air_row
        self._air_row = row
        moved = list(map(ne, row, before)) if len(row) == len(before) else [True] * len(row)
        if n and all(moved) and not self._same:  # as nearly always: nothing to be counted, what is left are ranges
            flow, total = row[n:], sum(row)
            fast = low <= min(f.air_V) and max(f.air_V) <= high
            if fast and -most < min(flow) and max(flow) < most and total == total:  # the last: none is NaN
                self._air_bad = 0
                return f.air_mask & (1 << n) - 1 > 0
        for i, v in enumerate(f.air_V):
            b, a = f.air_beta[i], f.air_alpha[i]
            lost = 0  # AIR_*
            if not alive(i, moved[i]) or not low <= v <= high:
                lost, air_bad = AIR_V, air_bad | 1 << i
            if not alive(n + i, moved[n + i]) or not -most < b < most:
                lost, air_bad = lost | AIR_BETA, air_bad | 8 << i
            if not alive(2 * n + i, moved[2 * n + i]) or not -most < a < most:
                lost, air_bad = lost | AIR_ALPHA, air_bad | 64 << i
            if self.air_used & ~lost if self.air_used else not lost:
                serving |= f.air_mask >> i & 1
        self._air_bad = air_bad
        return serving > 0

    def _refuses_radalt(self, f: SensorFrame) -> bool:
        """Whether the radio altimeter's new sample is out of range or stuck; said when it begins and ends. No mission depends
        on it, and above its range it is silent: it has no age."""
        alive = self._moving("radio altimeter", f.radalt_m)
        bad = not (alive and 0.0 <= f.radalt_m <= RADALT_MAX_M)
        if bad != self.out.radalt_bad:
            self.out.radalt_bad = bad
            self.texts.append(Text(4, "radio altimeter refused") if bad else Text(5, "radio altimeter back"))
        return bad

    def _moving(self, channel: str, value: float | tuple[float, ...]) -> bool:
        """Whether a channel is alive; `value` is its new one."""
        moved = self._value.get(channel) != value
        if moved:
            self._value[channel] = value
        return self._alive(channel, moved)

    def _alive(self, channel: str | int, moved: bool) -> bool:
        """False once the same bits have come `stuck_samples` times in a row: real noise never repeats."""
        if moved:
            if self._same:
                self._same.pop(channel, None)
            return True
        same = self._same[channel] = self._same.get(channel, 0) + 1
        return same < self.p.stuck_samples

    def _report(self, now: int, before: int) -> None:
        for bit, name in self.NAMES.items():
            if now & bit and not before & bit:
                self.texts.append(Text(3, f"{name} lost"))
            elif before & bit and not now & bit:
                self.texts.append(Text(5, f"{name} back"))
