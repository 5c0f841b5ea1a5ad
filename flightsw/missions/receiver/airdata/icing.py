"""A fault of every airspeed at once, as ice makes: what they say together against what does without them (probe-offsets.md 5)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.types import SensorFrame, Vec3

FAST_S, SLOW_S = 1.0, 60.0  # [s] over which a difference is looked at, and is remembered
FIRST_S = 10.0  # [s] of memory before anything is said
AGAINST, FOR = 5.0, 2.5  # [-] of a witness's sigma
DOUBT = 3.5  # [-] beyond which nothing is learnt
BACK_S = 5.0  # [s] of agreement before airspeeds are taken again
PEER, GNSS, LIFT = range(3)
# 1-sigma [m/s] of a change that a witness shows though nothing is wrong: in still air, and per intensity of the turbulence
STILL, ROUGH = (0.3, 0.3, 2.5), (0.5, 1.0, 2.0)
OLD_US = 500_000  # [us]


class Icing:
    """Three witnesses, of which two decide: the tanker's airspeed with the relative motion and the wake; GNSS velocity with the
    wind remembered; lift by incidence and accelerometers. Each is compared with the airspeed as it used to be: what is fixed
    drops out.

    `bad`: every airspeed is wrong; `V` [m/s]: what is flown by then, None without GNSS."""

    def __init__(self, ac: Aircraft) -> None:
        self._aero, self._S, self._empty = ac.aero, ac.geometry.S_m2, ac.mass.empty_kg
        self.reset()

    def reset(self) -> None:
        """Forget everything, as at a start."""
        self.bad = False
        self.V: float | None = None
        self._now: list[float] = [math.nan] * 3
        self._past: list[float] = [0.0] * 3
        self._age: list[float] = [0.0] * 3
        self._wind = np.zeros(3)  # [m/s, NED] remembered
        self._wind_s = self._calm_s = 0.0

    def step(
        self, V: float, peer: float, wind: Vec3, alpha: float, f: SensorFrame, rho: float, rough: float, dt: float
    ) -> None:  # fmt: skip
        """dt [s] after the last: V [m/s] mean of the airspeeds in use, peer [m/s] the one expected from the tanker's without any
        wind of one's own, wind [m/s, NED] as estimated now, alpha [rad], rho [kg/m^3], rough [m/s] turbulence."""
        fix = f.gnss_t_us > 0 and f.t_us - f.gnss_t_us < OLD_US
        if fix and not self.bad:
            self._wind_s = min(self._wind_s + dt, SLOW_S)
            if not self._doubted(rough):
                self._wind += min(dt / self._wind_s, 1.0) * (np.array(wind) - self._wind)
        v = math.dist(f.gnss_vel_n, self._wind.tolist()) if fix and self._wind_s > 0.0 else math.nan
        self.V = None if math.isnan(v) else v + self._past[GNSS]
        for k, seen in enumerate((peer, v, self._lift(alpha, f, rho))):
            off = V - seen
            if not math.isfinite(off):
                self._now[k] = math.nan
                continue
            if math.isnan(self._now[k]):
                self._now[k] = off
            self._now[k] += min(dt / FAST_S, 1.0) * (off - self._now[k])
            if not self.bad and not self._doubted(rough):
                self._age[k] = min(self._age[k] + dt, SLOW_S)
                self._past[k] += min(dt / self._age[k], 1.0) * (off - self._past[k])
        self._judge(rough, dt)

    def changes(self, rough: float) -> list[float]:
        """How many sigmas each witness says the airspeeds have changed by; NaN: it says nothing."""
        return [
            (now - past) / math.hypot(STILL[k], ROUGH[k] * rough) if age >= FIRST_S else math.nan
            for k, (now, past, age) in enumerate(zip(self._now, self._past, self._age, strict=True))
        ]

    def _doubted(self, rough: float) -> bool:
        return _two(self.changes(rough), DOUBT)

    def _judge(self, rough: float, dt: float) -> None:
        said = self.changes(rough)
        if not self.bad:
            self.bad, self._calm_s = _two(said, AGAINST), 0.0
            return
        agree = [abs(c) < FOR for c in said if math.isfinite(c)]
        self._calm_s = self._calm_s + dt if sum(agree) >= 2 else 0.0
        self.bad = self._calm_s < BACK_S

    def _lift(self, alpha: float, f: SensorFrame, rho: float) -> float:
        """Airspeed [m/s] that carries the aircraft at this incidence; NaN where lift says nothing."""
        cl = self._aero.CL0 + self._aero.CL_alpha * alpha
        _, _, down = f.acc_mean_b
        pull = -down * (self._empty + max(f.fuel_kg, 0.0))
        if not (cl > 0.05 and pull > 0.0):
            return math.nan
        return math.sqrt(2.0 * pull / (rho * self._S * cl))


def _two(said: list[float], limit: float) -> bool:
    """Whether two witnesses say more than `limit`, the same way."""
    return max(sum(c > limit for c in said), sum(c < -limit for c in said)) >= 2


def mean_of(y: np.ndarray, use: int, first: int) -> float | None:
    """Mean of those of the readings y [9] of one variable, from `first` on, that are in the mask `use`; None: there is none."""
    good = [float(y[c]) for c in range(first, first + 3) if use >> c & 1]
    return math.fsum(good) / len(good) if good else None
