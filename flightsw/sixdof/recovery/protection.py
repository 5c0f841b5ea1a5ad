"""Envelope protection around whatever law flies: takes the command when the aircraft leaves its envelope, nothing is left for
the law to fly by, or the air is too rough for it; brings it back to level flight, and gives it back (docs/sources/recovery.md 7,
docs/sources/rough-air.md 3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.sixdof.load_limit import LoadLimit
from flightsw.sixdof.recovery.answer import Answer
from flightsw.sixdof.recovery.beyond import Beyond
from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.law import RecoveryLaw, Wanted
from flightsw.sixdof.recovery.motion import from_reference
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.rough import RoughAirLaw
from flightsw.sixdof.recovery.turbulence import RoughAirParams, Turbulence
from flightsw.types import HF_ENGINE, HF_GNSS, HF_IMU, UPD_ATT, GuidanceCmd, Health, NavState, SensorFrame, Text

LEVEL = math.radians(5.0)  # [rad] of bank and path
APART, TOGETHER = math.radians(20.0), math.radians(5.0)  # [rad] estimated attitude from the reference
SPEED_BACK, SPEED_APART = 3.0, 10.0  # [m/s] inside the limits; estimate from the probes
ANCHOR_S = 10.0  # [s] on the gyro alone
LEVEL_S, READY_S = 5.0, 2.0  # [s] level; and all there is to fly by
TURN_MOST, K_TURN = math.radians(20.0), 0.15  # [rad] of bank, [1/s]
# thrust beyond command: [rad per m/s] of path for the airspeed it makes; [rad]
K_CLIMB, CLIMB_MOST = 0.01, math.radians(8.0)
CLIMB_RATE = math.radians(1.0)  # [rad/s] at which that path comes; it goes three times as fast
TELL_S = 5.0  # [s] without it, before it is told again
CLIMB_AGE_US = 500_000  # [us] of a rate of climb by GNSS
OUT, RECOVERING, HOLDING, RIDING = range(4)  # riding: rough air


@dataclass
class Protection:
    """One aircraft's. `step` at every mission step; while `active`, `fly` has the command."""

    ac: Aircraft
    h_m: float  # taken for the height until one is measured
    period_s: float  # of `step`
    rough: RoughAirParams | None = None  # None: no air is too rough
    texts: list[Text] = field(default_factory=list)
    why: str = ""
    active: bool = False
    began: bool = False  # in this step
    ended: bool = False  # in this step
    anew: bool = False  # in this step: the estimate is to begin again from its sensors

    def __post_init__(self) -> None:
        self.readings = Readings(self.ac, self.h_m)
        self.law = RecoveryLaw(self.ac)
        self.answer = Answer(self.ac, self.period_s)
        self._load = LoadLimit(self.ac)
        self._told_s = 0.0  # until another elevator that is held back is told
        self.air = None if self.rough is None else Turbulence(self.rough)
        self._ride = None if self.rough is None else RoughAirLaw(self.ac, self.rough, self.law.terms)
        self._climb: float | None = None  # [m/s]
        self._nav_R = np.zeros(9)
        self._phase = OUT
        self._beyond = Beyond(self.ac, (self.law.load_low, self.law.load_high))
        self._suspect = False
        self._good_s = self._ready_s = 0.0
        self._V_taken, self._slope = 0.0, 0.0  # [m/s] when it took the command; [rad] path that is flown since
        limits = self.ac.limits
        self._V_keep = 0.5 * (limits.V_min_mps + limits.V_max_mps)

    def sound(self, updated: int) -> int:
        """Of the UPD_* bits of a step those an estimator may use: an attitude that does not turn with the aircraft is none."""
        return updated & ~UPD_ATT if self.readings.motion.doubted else updated

    @property
    def faults(self) -> int:
        """HF_* of what it finds wrong of the aircraft itself, beside an upset."""
        return HF_ENGINE if self.answer.weak else 0

    def acted(self, u: np.ndarray) -> np.ndarray:
        """Mean controls u [4] believed to have acted, with a surface that does not answer where it is."""
        j = self.answer.failed
        if j < 0:
            return u
        out = u.copy()
        out[j] = self.answer.at[j]
        return out

    def step(
        self, f: SensorFrame, nav: NavState, updated: int, health: Health, rejoin: Rejoin, felt: Felt, dt: float
    ) -> bool:
        """Look at frame f and estimate nav, dt [s] after the last; whether `fly` has the command now."""
        s = self.readings
        doubted = s.motion.doubted
        s.step(f, updated, health, dt, nav.V if nav.valid else None)
        self._answering(felt, nav, health, dt)
        if s.motion.doubted != doubted:
            again, not_now = Text(5, "attitude reference good again"), Text(4, "attitude reference does not turn along")
            self.texts.append(again if doubted else not_now)
        self.began = self.ended = self.anew = False
        self._told_s -= dt
        if self.air is not None:
            fresh = f.t_us - f.gnss_t_us < CLIMB_AGE_US and f.gnss_t_us > 0 and not health.failed & HF_GNSS
            self._climb = -f.gnss_vel_n[2] if fresh else None
            self.air.step(s, self._phase != RECOVERING, dt)
            if self.air.texts:
                self.texts += self.air.tell()
        self._beyond.was_valid |= nav.valid
        apart = self._apart(nav)
        if self._phase == OUT:
            if s.trusted and s.coasting_s > ANCHOR_S and nav.valid and not apart:
                s.anchor(self._nav_R)  # the estimate knows the reference to be wrong, and the gyro drifts
            why = self._beyond.step(s, nav, self.answer, apart, rejoin.strange, dt)
            if not why and self.answer.surplus and rejoin.path < 0.0:
                why = "thrust does not answer"  # what is close ahead is run up to, and no law of station keeping can help it
            if why and s.known:
                self._take(why)
            elif self._too_rough:
                self.active = self.began = True
                self._go_riding()
        elif self._phase == RIDING:
            self._riding(nav, dt)
        else:
            self._come_back(nav, apart, rejoin, dt)
        return self.active

    def _answering(self, felt: Felt, nav: NavState, health: Health, dt: float) -> None:
        """Whether surfaces and thrust do; where not, the comparison of gyro and reference has no moments to judge by. Nobody is
        judged by an airspeed that the estimate does not share: all probes may lie."""
        a, s, turning = self.answer, self.readings, felt.turning
        shared = not nav.valid or abs(nav.V - s.V) < SPEED_APART
        sound = shared and not s.motion.doubted and not health.failed & HF_IMU
        a.step(s, felt.u, sound, turning, dt)
        if turning is not None:
            turning.moments_hold = a.failed < 0
        if a.texts:
            self.texts += a.texts
            a.texts = []

    def bound(self, u: np.ndarray, f: SensorFrame, nav: NavState) -> np.ndarray:
        """LoadLimit.bound of a law's command u [4], told when it begins to hold back."""
        out = self._load.bound(u, f, nav)
        if self._load.acting and self._told_s <= 0.0:
            self.texts.append(Text(4, f"elevator held back: {self._load.asked:.1f} g ahead"))
        self._told_s = TELL_S if self._load.acting else self._told_s
        return out

    def command(self, g: GuidanceCmd, rejoin: Rejoin, dt: float) -> tuple[np.ndarray, float] | None:
        """`fly`, and why in the guidance's reason, while it has the command; else None."""
        if not self.active:
            return None
        g.reason = self.why
        return self.fly(rejoin, dt)

    def fly(self, rejoin: Rejoin, dt: float) -> tuple[np.ndarray, float]:
        """Command (surfaces [rad] and thrust [N] [4], throttle 0..1) of the recovery law."""
        s = self.readings
        if self._phase == RIDING and self._ride is not None:
            return self._ride.step(s, self._climb, rejoin.path, dt)
        want = Wanted(self._V_keep)
        if self.answer.failed >= 0:
            want.path, want.side = rejoin.path, rejoin.side
        elif self.answer.surplus:
            want.V, want.bank = self._V_taken, rejoin.side * TURN_MOST if rejoin.path < 0.0 else 0.0
            wanted = rejoin.path or min(max(K_CLIMB * (s.V - self._V_taken), 0.0), CLIMB_MOST)
            most = CLIMB_RATE * dt
            self._slope = want.path = min(max(wanted, self._slope - 3.0 * most), self._slope + most)
        elif self._phase == HOLDING:
            if rejoin.V is not None:
                want.V = rejoin.V
            if rejoin.away is not None:
                want.V, want.bank = self._towards(*rejoin.away)
            want.path = rejoin.path
        lo, hi = self.ac.limits.V_min_mps, self.ac.limits.V_max_mps
        want.V = min(max(want.V, lo + SPEED_APART), hi - SPEED_APART)
        return self.law.step(s, want, self.answer, dt)

    def _towards(self, north: float, east: float) -> tuple[float, float]:
        """Airspeed [m/s] and bank [rad] that take on a change of velocity [m/s, NED]."""
        s = self.readings
        n, e = float(s.R[0]), float(s.R[1])  # the nose
        h = max(math.hypot(n, e), 1e-3)
        n, e = s.V * n / h, s.V * e / h
        left = math.atan2(n * (e + east) - e * (n + north), n * (n + north) + e * (e + east))
        bank = math.atan(K_TURN * left * s.V / 9.80665)
        return math.hypot(n + north, e + east), min(max(bank, -TURN_MOST), TURN_MOST)

    def _apart(self, nav: NavState) -> bool:
        """Whether the estimate's attitude or airspeed is not that of the sensors."""
        s = self.readings
        if not nav.valid or not s.trusted:
            return False
        off = from_reference(*nav.q_nb, self._nav_R, s.R)
        limit = APART if self._phase == OUT else TOGETHER
        return off > limit or (self._phase != OUT and s.V_measured and abs(nav.V - s.V) > SPEED_APART)

    def _take(self, why: str) -> None:
        self._phase, self.active, self.began, self.why = RECOVERING, True, True, f"recovery: {why}"
        self._suspect = not why.startswith("navigation")
        self._good_s = self._ready_s = 0.0
        self._V_taken, self._slope = self.readings.V, 0.0
        self._beyond.clear()
        self.law.reset()
        self.texts.append(Text(4, self.why[:50]))

    @property
    def riding(self) -> bool:
        """Whether the aircraft rides gusts that are too rough for the law."""
        return self._phase == RIDING

    @property
    def _too_rough(self) -> bool:
        return self.air is not None and self.air.rough

    def _go_riding(self) -> None:
        """Ride the gusts from here on."""
        if self.air is not None and self._ride is not None:
            self._phase, self.why = RIDING, self.air.why
            self._beyond.clear()
            self._ride.begin(self.readings, 0.0 if self._climb is None else self._climb / self.readings.V)

    def _riding(self, nav: NavState, dt: float) -> None:
        """Until the air is calm enough to go back to the law, or the envelope is left."""
        why = self._beyond.step(self.readings, nav, self.answer, False, "", dt, lost=False)
        if why:
            self._take(why)
        elif not self._too_rough:
            self._phase, self.why = HOLDING, "recovery: air calm again"
            self._good_s = self._ready_s = 0.0

    def _come_back(self, nav: NavState, apart: bool, rejoin: Rejoin, dt: float) -> None:
        """Level for long enough, then all there is to fly by for long enough; back to recovering where it goes beyond again."""
        s, law, limits = self.readings, self.law, self.ac.limits
        banked = abs(law.bank) < (LEVEL if self._phase == RECOVERING else TURN_MOST + 2.0 * LEVEL)
        flat = abs(law.path) < (LEVEL if self._phase == RECOVERING else 2.0 * LEVEL)
        inside = limits.V_min_mps + SPEED_BACK < s.V < limits.V_max_mps - SPEED_BACK or not s.V_measured
        low = abs(s.alpha) < math.radians(limits.alpha_max_deg)
        good = banked and flat and inside and low
        self._good_s = self._good_s + dt if good else 0.0
        if self._phase == RECOVERING:
            if self._good_s >= LEVEL_S:
                self._phase, self.anew = HOLDING, self._suspect
                self._suspect = False
                self.texts.append(Text(5, "recovery: level"))
            return
        if self._too_rough:
            self._go_riding()
            return
        if not good and (abs(law.bank) > 2.0 * TURN_MOST or abs(law.path) > 3.0 * LEVEL):
            self._phase, self._suspect = RECOVERING, True
        straight = abs(law.bank) < 2.0 * LEVEL
        answers = self.answer.failed < 0 and not self.answer.surplus
        ready = answers and good and straight and nav.valid and not apart and rejoin.ready
        self._ready_s = self._ready_s + dt if ready else 0.0
        if self._ready_s >= READY_S:
            self._phase, self.active, self.ended, self.why = OUT, False, True, ""
            self.law.terms.open()
            self.texts.append(Text(5, "recovery: control given back"))
