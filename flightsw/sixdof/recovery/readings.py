"""What recovery goes by: attitude, rates, load factor, airspeed and flow as far as they are trusted, without any filter of wind
or position (docs/sources/recovery.md 1)."""

from __future__ import annotations

import math

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.aircraft.base import PROBES
from flightsw.kernels.atmosphere import G0
from flightsw.sixdof.params import IX, IY, IZ, M, parameter_vector, set_mass
from flightsw.sixdof.recovery import readings_kernel as rk
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
NO_PROBES = (0.0,) * PROBES


class Readings:
    """Step it at every mission step, in recovery or not; the fields are what is known then.

    down [3]: the vertical in body axes; w [3] rad/s; load [-]; V [m/s]; alpha, beta [rad]; q [Pa]; h_m [m]; mass [kg];
    inertia [3]: Ixx, Iyy, Izz [kg m^2]. x [BLOCK]: these and more for kernels (readings_kernel.py); R [9]: NED to
    body.
    """

    def __init__(self, ac: Aircraft, h_m: float) -> None:
        """h_m [m]: height taken until one is measured."""
        self.ac = ac
        self._P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._fuel_kg = ac.mass.default_fuel_kg
        self._numbers, self.x = rk.numbers(ac), np.zeros(rk.BLOCK)
        self._weigh()
        self._vanes = (1 << len(ac.probe)) - 1  # bits
        self.V, self.V_measured = self._numbers.item(rk.BETWEEN), False
        self.x[[rk.SPEED, rk.V_FELT]] = self.V
        self.alpha = self.beta = 0.0
        self.alpha_measured = False
        self.h_m = h_m
        self.load, self.down, self.w = 1.0, (0.0, 0.0, 1.0), ZERO3
        self.x[[rk.LOAD, rk.DOWN]] = self.load, -G0
        self.R = np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1])
        self.known = False  # an attitude has been taken
        self.trusted = False  # of the reference, now
        self.coasting_s = 0.0  # on the gyro alone
        self.motion = Motion()  # whether the reference turns with the aircraft
        self.q = 0.0

    @property
    def V_beyond_felt(self) -> float:
        """[m/s] the probes' airspeed beyond what the accelerometers make of it over SETTLE_V_S."""
        return self.V - self.x.item(rk.V_FELT)

    def _weigh(self) -> None:
        self.mass = float(self._P[M])
        self.inertia = float(self._P[IX]), float(self._P[IY]), float(self._P[IZ])
        self.x[rk.MASS : rk.IZZ + 1] = self.mass, *self.inertia

    def step(self, f: SensorFrame, updated: int, health: Health, dt: float, V: float | None = None) -> None:
        """Take in the frame f of which `updated` (UPD_*) is new, dt [s] after the last. What the estimate keeps out of air data
        (health.kept_out) is not gone by; V [m/s]: its airspeed, for the one it keeps out, None: it knows none."""
        good = updated & ~_lost(health) if health.failed else updated
        if f.fuel_t_us > 0 and f.fuel_kg != self._fuel_kg:
            self._fuel_kg = f.fuel_kg
            set_mass(self._P, self.ac, self.ac.mass.empty_kg + f.fuel_kg)
            self._weigh()
        felt = 0 if health.failed & HF_IMU else f.gyro_count
        if felt:
            self.w = f.gyro_mean_b
        self._attitude(f, bool(good & UPD_ATT), f.gnss_vel_n if good & UPD_GNSS else None, dt)
        if updated & UPD_BARO and -1e3 < f.baro_alt_m < 20e3:
            self.h_m = f.baro_alt_m
        out, speeds, up, side, air = health.kept_out, 0, 0, 0, NO_PROBES * 3
        if good & UPD_AIR:
            mask, bad = f.air_mask, f.air_bad
            speeds, up, side = mask & ~bad, mask & ~(bad >> 6) & self._vanes, mask & ~(bad >> 3) & self._vanes
            none = NO_PROBES[len(f.air_V) :]
            air = (*f.air_V, *none, *f.air_alpha, *none, *f.air_beta, *none)
        given = math.nan
        if out:
            speeds, given = (0, math.nan if V is None else V) if out >> rd.V & 1 else (speeds, given)
            up, side = 0 if out >> rd.ALPHA & 1 else up, 0 if out >> rd.BETA & 1 else side
        self.load, self.V, self.alpha, self.beta, self.q, measured, vanes = rk.read(
            self.x, self._numbers, self.R, felt, *self.w, *f.acc_mean_b, self.h_m, dt, given, speeds, up, side, *air
        )
        self.V_measured, self.alpha_measured = measured != 0.0, vanes != 0.0

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
        self.R[:] = R
        self.coasting_s = 0.0


def _lost(health: Health) -> int:
    """UPD_* bits of what health has given up."""
    pairs = ((HF_AIR, UPD_AIR), (HF_ATT, UPD_ATT), (HF_GNSS, UPD_GNSS))
    return sum(upd for flag, upd in pairs if health.failed & flag)
