"""Free-aircraft estimator: SR-UKF of 12 rigid-body states and 3 wind components (Lee 2011, chapter 4, re-formulated).

Measurements: air data, gyro, attitude, GNSS position and velocity, each when it is new. Velocity enters as a direct
nonlinear measurement; the printed calculated measurement of wind is not used, because its noise repeats what is already
in the measurement vector.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    quat4,
    quat_from_euler,
    to_parent,
    vec3,
    wrap_pi,
)
from flightsw.sixdof.estimator_core import NavParams, failed_bits
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.measure import measure_free
from flightsw.sixdof.motion import air_velocity, free_rates, propagate_free
from flightsw.types import (
    UPD_AIR,
    UPD_ATT,
    UPD_GNSS,
    UPD_IMU,
    Health,
    NavState,
    SensorFrame,
)

NEEDED = (*rd.AIR, rd.GYRO, rd.ATT, rd.GNSS_POS)  # sensors without which no estimate becomes valid


class AirframeNav:
    """State and wind of one aircraft from its own sensors."""

    def __init__(self, ac: Aircraft, params: NavParams, extra: int = 0) -> None:
        """`extra`: states a variant carries beyond the 15."""
        self.core = TrustedCore(ac, params, 18, extra)
        self.t_us = 0
        self.started_us = -1
        self._R, self._fm, self._d = np.zeros(9), np.zeros(9), np.zeros(15)
        self._e, self._q = np.zeros(3), np.zeros(4)
        self.out = NavState()

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """One estimator step: f the frame at the current tick, u [4] mean controls that acted since the last step,
        `updated` the union of update bits since then. Never raises on bad data: `valid` and `reason` say what is wrong.
        """
        c = self.core
        if self.started_us < 0:
            return self._start(f, u, updated, health)
        dt = (f.t_us - self.t_us) * 1e-6
        self.t_us = f.t_us
        c.begin(f.t_us)
        c.burn(f.fuel_kg)
        x = c.ukf.x
        rho = density(-x[11])
        if dt > 0.0:
            dcm_from_euler(x[6], x[7], x[8], self._R)
            c.noise_factor(self._R, dt)
            self._predict(f, u, rho, dt)
        free_rates(x, u, rho, c.P, self._R, self._fm, self._d)
        nis, m = self._fuse(f, u, updated & ~failed_bits(health))
        if why := c.lost(self.out.valid):
            self.started_us = -1
            self.out.valid, self.out.reason = False, why
            return self.out
        free_rates(x, u, rho, c.P, self._R, self._fm, self._d)
        if c.ears(self.out.valid, dt):
            c.hear(f, self._fm, partial(self._force, u, rho))
        return self._publish(f, nis, m)

    def _predict(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """Time update over dt [s]; the noise factor is filled."""
        ukf = self.core.ukf
        ukf.draw()
        self._propagate(f, u, rho, dt)
        ukf.recombine()

    def _propagate(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """Carry the drawn points over dt [s]."""
        c = self.core
        propagate_free(c.ukf.X, u, rho, c.P, dt, c.work)

    def _correct(self, f: SensorFrame, u: np.ndarray) -> float:
        """Measurement update with the queued measurements; returns NIS."""
        c = self.core
        c.ukf.draw()
        measure_free(c.ukf.X, c.codes, c.m, c.ukf.Y)
        return c.update()

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        need = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU
        have = updated & ~failed_bits(health)
        c = self.core
        c.w_air[:] = f.gyro_b
        if have & need != need or c.take_air(f) == 0:
            self.out.valid, self.out.reason = False, "waiting for air data, attitude, GNSS and gyro"
            self.out.t_us = f.t_us
            return self.out
        x, p = c.ukf.x, c.p
        dcm_from_quat(np.array(f.att_q_nb), self._R)
        euler_from_dcm(self._R, self._e)
        x[0:3], x[3:6], x[6:9], x[9:12] = c.air, f.gyro_b, self._e, f.gnss_pos_n
        ua = np.array(air_velocity(x[0], x[1], x[2]))
        to_parent(self._R, ua, self._e)
        x[12:15] = np.array(f.gnss_vel_n) - self._e
        s = [p.r_V, p.r_beta, p.r_alpha, *[p.r_rate] * 3, *[p.r_euler] * 3, *[2 * p.r_pos] * 3, *[p.wind_sigma0] * 3]
        c.ukf.set_factor(np.diag([*s, *[1.0] * (len(x) - 15)]))
        self.t_us = self.started_us = f.t_us
        c.restart(f.t_us)
        self.out.valid = False
        free_rates(x, u, density(-x[11]), c.P, self._R, self._fm, self._d)
        return self._publish(f, 0.0, 0)

    def _fuse(self, f: SensorFrame, u: np.ndarray, updated: int) -> tuple[float, int]:
        c, p = self.core, self.core.p
        c.m = 0
        c.w_air[:] = c.ukf.x[3:6]
        x, d = c.ukf.x.tolist(), self._d.tolist()  # plain floats are quicker
        if updated & UPD_AIR and (n := c.take_air(f)):
            c.add_air(n, d[0], d[1], d[2], (f.t_us - f.air_t_us) * 1e-6)
        if updated & UPD_IMU and f.gyro_count:
            c.add_gyro(f, d[3:6])
        if updated & UPD_ATT:
            self._q[:] = f.att_q_nb
            dcm_from_quat(self._q, self._R)
            euler_from_dcm(self._R, self._e)
            e = self._e.tolist()
            age, lost = (f.t_us - f.att_t_us) * 1e-6, c.drift(rd.ATT, p.bias_gyro)
            for i in range(3):
                # the measured angle is brought near the state: psi stays unwrapped, only the innovation is wrapped
                y = x[6 + i] + wrap_pi(e[i] + d[6 + i] * age - x[6 + i])
                c.add(6 + i, y, p.r_euler, rd.ATT, lost)
        if updated & UPD_GNSS:
            age = (f.t_us - f.gnss_t_us) * 1e-6
            acc, lost = self.acceleration().tolist(), c.drift(rd.GNSS_POS, p.bias_vel)
            for i in range(3):
                c.add(9 + i, f.gnss_pos_n[i] + d[9 + i] * age, p.r_pos, rd.GNSS_POS, lost)
            if p.velocity:
                for i in range(3):
                    c.add(12 + i, f.gnss_vel_n[i] + acc[i] * age, p.r_vel, rd.GNSS_VEL)
        if c.m == 0:
            return 0.0, 0
        return self._correct(f, u), c.m

    def _force(self, u: np.ndarray, rho: float, x: np.ndarray) -> np.ndarray:
        """Specific force [3] of the model at state x, body axes [m/s^2]."""
        fm = np.zeros(9)
        free_rates(x, u, rho, self.core.P, np.zeros(9), fm, np.zeros(15))
        return fm[:3]

    def acceleration(self) -> np.ndarray:
        """Inertial acceleration [3] NED [m/s^2] at the current estimate (specific force rotated, plus gravity)."""
        x = self.core.ukf.x
        dcm_from_euler(x[6], x[7], x[8], self._R)
        a = np.zeros(3)
        to_parent(self._R, self._fm, a)
        a[2] += G0
        return a

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        c, o = self.core, self.out
        x = c.ukf.x
        o.t_us = f.t_us
        o.reason = c.earned(o, self.started_us, *NEEDED, rd.GNSS_VEL if c.p.velocity else rd.GNSS_POS)
        o.valid = not o.reason
        o.V, o.beta, o.alpha = float(x[0]), float(x[1]), float(x[2])
        o.w_b = vec3(x[3:6])
        o.euler = vec3(x[6:9])
        quat_from_euler(x[6], x[7], x[8], self._q)
        o.q_nb = quat4(self._q)
        o.pos_n = vec3(x[9:12])
        o.vel_n = vec3(self._d[9:12])
        o.acc_n = vec3(self.acceleration())
        o.wind_n = vec3(x[12:15])
        c.publish_sigma(o)
        lasting = c.lasting(rd.GNSS_POS, c.p.bias_pos)
        o.pos_sigma = (
            math.hypot(o.scatter[0], lasting),
            math.hypot(o.scatter[1], lasting),
            math.hypot(o.scatter[2], lasting),
        )
        c.publish_trust(o)
        o.nis, o.nis_dof = nis, m
        return o
