"""What recovery goes by: attitude, rates, load factor, airspeed and flow as far as they are trusted, without any filter of wind
or position (docs/sources/recovery.md 1)."""

from __future__ import annotations

import math

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.sixdof.params import IX, IY, IZ, M, parameter_vector, set_mass
from flightsw.sixdof.recovery.motion import Motion
from flightsw.types import (
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_GNSS,
    ZERO3,
    Health,
    SensorFrame,
    Vec3,
)

TURN_GATE, GATE_GROWS = math.radians(8.0), math.radians(1.0)  # [rad], [rad/s] attitude reference against the gyro
RATE_GATE = 0.15  # [-] of the rate: latency and sampling
COAST_S = 30.0  # [s] after which the gyro alone is no better than a reference that disagrees
V_GATE, V_COAST_S = 20.0, 10.0  # [m/s] against what the accelerometers make of the last one; [s] it is carried on
FLOW_MOST = 0.6  # [rad]
SETTLE_V_S = 4.0  # [s] over which the accelerometers' airspeed takes over the probes'
SHARE_V = 0.6  # [-] of the range of airspeeds, where none is known
TAU_V_S = 20.0  # [s] over which an airspeed that is carried on is given up for that
HEIGHT_AGE_US = 1_000_000


class Readings:
    """Step it at every mission step, in recovery or not; the fields are what is known then.

    down [3]: the vertical in body axes; w [3] rad/s; force [3] m/s^2, specific; load [-]; V [m/s]; alpha, beta [rad]; q [Pa];
    h_m [m]; mass [kg]; inertia [3]: Ixx, Iyy, Izz [kg m^2].
    """

    def __init__(self, ac: Aircraft, h_m: float) -> None:
        """h_m [m]: height taken until one is measured."""
        self.ac = ac
        self._P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._fuel_kg = ac.mass.default_fuel_kg
        self._weigh()
        self._vanes = tuple((i, *probe.position_m[:2]) for i, probe in enumerate(ac.probe))  # [m] ahead, right
        lo, hi = ac.limits.V_min_mps, ac.limits.V_max_mps
        self._V_between = lo + SHARE_V * (hi - lo)
        self._slowest, self._fastest = 0.3 * self._V_between, 2.0 * self._V_between  # taken for an airspeed
        self.V, self.V_measured = self._V_between, False
        self.alpha = self.beta = 0.0
        self.alpha_measured = False
        self.h_m = h_m
        self.load, self.down, self.w = 1.0, (0.0, 0.0, 1.0), ZERO3
        self.force: Vec3 = (0.0, 0.0, -G0)
        self.R = np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1])
        self.known = False  # an attitude has been taken
        self.trusted = False  # of the reference, now
        self.coasting_s = 0.0  # on the gyro alone
        self.motion = Motion()  # whether the reference turns with the aircraft
        self._V_age = self._baro_us = 0.0
        self._V_felt = self.V  # [m/s] by the accelerometers, slowly brought to the probes
        self._given = False  # the airspeed has last been the estimate's: the probes' has to come near it first
        self.q = 0.0

    @property
    def V_beyond_felt(self) -> float:
        """[m/s] the probes' airspeed beyond what the accelerometers make of it over SETTLE_V_S."""
        return self.V - self._V_felt

    def _weigh(self) -> None:
        self.mass = float(self._P[M])
        self.inertia = float(self._P[IX]), float(self._P[IY]), float(self._P[IZ])

    def step(self, f: SensorFrame, updated: int, health: Health, dt: float, V: float | None = None) -> None:
        """Take in the frame f of which `updated` (UPD_*) is new, dt [s] after the last. What the estimate keeps out of air data
        (health.kept_out) is not gone by; V [m/s]: its airspeed, for the one it keeps out, None: it knows none."""
        good = updated & ~_lost(health) if health.failed else updated
        if f.fuel_t_us > 0 and f.fuel_kg != self._fuel_kg:
            self._fuel_kg = f.fuel_kg
            set_mass(self._P, self.ac, self.ac.mass.empty_kg + f.fuel_kg)
            self._weigh()
        if f.gyro_count and not health.failed & HF_IMU:
            self.w = f.gyro_mean_b
            self.load, self.force = -f.acc_mean_b[2] / G0, f.acc_mean_b
        self._attitude(f, bool(good & UPD_ATT), f.gnss_vel_n if good & UPD_GNSS else None, dt)
        if updated & UPD_BARO and -1e3 < f.baro_alt_m < 20e3:
            self.h_m = f.baro_alt_m
        rho = density(self.h_m)
        out = health.kept_out
        kept = out >> rd.V & 1
        self._airspeed(f, bool(good & UPD_AIR) and not kept, dt, V if kept else None)
        self.q = 0.5 * rho * self.V * self.V
        self._flow(f, bool(good & UPD_AIR), out)

    def _attitude(self, f: SensorFrame, fresh: bool, v: Vec3 | None, dt: float) -> None:
        """Turn on with the gyro; take the reference where it agrees with that and turns with it, or where there is nothing
        better. v [3] m/s NED: a new GNSS velocity."""
        m, rate = self.motion, math.hypot(*self.w)
        self.coasting_s += dt
        off = m.step(self.R, self.known, f.att_q_nb if fresh else None, self.w, rate, f.acc_mean_b, v, dt)
        if m.began:
            self.R[:] = m.R
        if fresh and not m.doubted:
            limit = TURN_GATE + GATE_GROWS * self.coasting_s + RATE_GATE * rate
            if not self.known or self.coasting_s > COAST_S or off < limit:
                self.R[:] = m.reference
                self.known, self.coasting_s = True, 0.0
        self.trusted = self.known and self.coasting_s < COAST_S
        _, _, x, _, _, y, _, _, z = self.R.tolist()
        self.down = (x, y, z)

    def anchor(self, R: np.ndarray) -> None:
        """Go on with the gyro from attitude R [9], NED to body."""
        self.R = R.copy()
        self.coasting_s = 0.0

    def _airspeed(self, f: SensorFrame, fresh: bool, dt: float, given: float | None) -> None:
        """The middle one of the probes' airspeeds; between them and after, what gravity and the accelerometers make of it, or
        what is `given` [m/s]."""
        self._V_age += dt
        if given is not None:
            self.V = self._V_felt = given
            self._V_age, self.V_measured, self._given = 0.0, False, True
            return
        (ahead, _, below), (forward, _, down) = f.acc_mean_b, self.down
        ca, sa = math.cos(self.alpha), math.sin(self.alpha)
        gained = dt * (ca * (ahead + G0 * forward) + sa * (below + G0 * down))
        self.V += gained
        self._V_felt += gained
        good = f.air_mask & ~f.air_bad if fresh else 0
        if seen := [v for i, v in enumerate(f.air_V) if good >> i & 1]:
            V = _middle(seen)
            if not self.V_measured and not self._given:
                self._V_felt = V
            off = V - self._V_felt
            if abs(off) < V_GATE:
                self.V, self._V_age, self.V_measured, self._given = V, 0.0, True, False
                self._V_felt += min(dt / SETTLE_V_S, 1.0) * off
            elif self._V_age <= dt:
                self.V = self._V_felt  # it has run away, not leapt: what has been taken of it is wrong too
        if self._V_age > V_COAST_S:
            self.V_measured = False
            self.V += min(dt / TAU_V_S, 1.0) * (self._V_between - self.V)
        if not self._slowest <= self.V <= self._fastest:
            self.V = min(max(self.V, self._slowest), self._fastest)

    def _flow(self, f: SensorFrame, fresh: bool, out: int) -> None:
        """Incidence and sideslip: the middle vane less what the rates make at it, else, as where it is kept `out` (bit =
        WKF_READING), what the specific force says."""
        c, S, V, (p, q, r) = self.ac.aero, self.ac.geometry.S_m2, self.V, self.w
        vanes = f.air_mask if fresh else 0
        up = 0 if out >> rd.ALPHA & 1 else vanes & ~(f.air_bad >> 6)
        side = 0 if out >> rd.BETA & 1 else vanes & ~(f.air_bad >> 3)
        alpha = [f.air_alpha[i] - (p * y - q * x) / V for i, x, y in self._vanes if up >> i & 1] if up else []
        beta = [f.air_beta[i] - r * x / V for i, x, _ in self._vanes if side >> i & 1] if side else []
        self.alpha_measured = bool(alpha)
        a = _middle(alpha) if alpha else (self.load * self.mass * G0 / (self.q * S) - c.CL0) / c.CL_alpha
        b = _middle(beta) if beta else f.acc_mean_b[1] * self.mass / (self.q * S * c.CY_beta)
        self.alpha, self.beta = min(max(a, -FLOW_MOST), FLOW_MOST), min(max(b, -FLOW_MOST), FLOW_MOST)


def _lost(health: Health) -> int:
    """UPD_* bits of what health has given up."""
    pairs = ((HF_AIR, UPD_AIR), (HF_ATT, UPD_ATT), (HF_GNSS, UPD_GNSS))
    return sum(upd for flag, upd in pairs if health.failed & flag)


def _middle(v: list[float]) -> float:
    """The middle one of v, which is sorted by this."""
    v.sort()
    k = len(v) // 2
    return v[k] if len(v) % 2 else 0.5 * (v[k - 1] + v[k])
