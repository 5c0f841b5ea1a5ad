"""Free-aircraft estimator: SR-UKF of 12 rigid-body states and 3 wind components (Lee 2011, chapter 4, re-formulated).

Measurements: air data, gyro, attitude, GNSS position and velocity, each when it is new (sixdof/aids.py). Velocity enters as a
direct nonlinear measurement; the printed calculated measurement of wind is not used unless asked for, because its noise repeats
what is already in the measurement vector. Prediction, wind model, noise colour and adaptation: parts (sixdof/parts.py, free.py).
With none of them, and nothing in dispute, a step is one compiled call (free_kernel.py), to the bit the same as step by step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_euler, dcm_from_quat, euler_from_dcm, to_parent
from flightsw.sixdof.aids import PROBES, own_sensors
from flightsw.sixdof.calculated_wind import CalculatedWind, calculated_wind
from flightsw.sixdof.estimator_core import GAP_US, NavParams, channel_sigma, failed_bits
from flightsw.sixdof.free import Aerodynamic, FreeSensors, Sensed, check
from flightsw.sixdof.free_kernel import FREE_OUT, O_SIGMA, free_rows, free_step, free_told
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.judged import DONE, O_END, O_M, O_NIS, O_PROBES, O_RHO, O_SIFTED, O_X, REFUSED, whole
from flightsw.sixdof.layout import (
    AIR,
    EULER,
    FREE_CHANNELS,
    M_WIND,
    NX,
    POS,
    RATE,
    WIND,
    X_ALPHA,
    X_BETA,
    X_PHI,
    X_PSI,
    X_THETA,
    X_V,
    X_Z,
)
from flightsw.sixdof.motion import air_velocity, free_rates
from flightsw.sixdof.parts import Extras, Motion, Parts
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, Health, NavState, SensorFrame

NEEDED = (*rd.AIR, rd.GYRO, rd.ATT, rd.GNSS_POS)  # sensors without which no estimate becomes valid
ROWS = M_WIND + 3  # every reading and the calculated wind


class AirframeNav:
    """State and wind of one aircraft from its own sensors."""

    def __init__(self, ac: Aircraft, params: NavParams) -> None:
        """Raises ConfigError for parameters that a free aircraft cannot obey."""
        check(params)
        e = Extras.of(params, FREE_CHANNELS)
        self.core = c = TrustedCore(ac, params, ROWS, e.total)
        p = c.p  # with noise_scale applied
        motion: Motion = Aerodynamic(c) if p.model == "aero" else Sensed(c)
        self.parts = Parts(c, e, motion, FreeSensors(), channel_sigma(p, len(ac.probe)))
        self.cmw = CalculatedWind(p, M_WIND) if p.cmw else None
        self.t_us = 0
        self.started_us = -1
        self._R, self._fm, self._d = np.zeros(9), np.zeros(9), np.zeros(NX)
        self._e = np.zeros(3)
        self._given, self._told = np.zeros(PROBES + 4 * len(ac.probe)), np.zeros(FREE_OUT)
        self.out = NavState()
        # what free_step works on; None: a variant, which goes step by step
        self._whole: tuple[Any, ...] | None = None
        if self.parts.plain and p.model == "aero" and not p.cmw and c.refusals is not None:
            self._whole = whole(c, np.zeros((5, NX)), self._R, self._fm, self._d, self._told)

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """One estimator step: f the frame at the current tick, u [4] mean controls that acted since the last step,
        `updated` the union of update bits since then. Never raises on bad data: `valid` and `reason` say what is wrong.
        """
        c = self.core
        if self.started_us >= 0 and f.t_us - self.t_us > GAP_US:
            self.begin_again(f"no step for {(f.t_us - self.t_us) * 1e-6:.1f} s, restarting")
        if self.started_us < 0:
            return self._start(f, u, updated, health)
        dt = (f.t_us - self.t_us) * 1e-6
        self.t_us = f.t_us
        c.begin(f.t_us)
        c.burn(f.fuel_kg)
        sound = updated & ~failed_bits(health)
        self._given[:] = own_sensors(c, f, sound, dt, c.p.r_vel)
        if self._whole is not None and c.calm:
            return self._at_once(f, u, sound, dt, self._whole)
        x = c.ukf.x
        rho = density(-x[X_Z])
        if dt > 0.0:
            dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], self._R)
            c.noise_factor(self._R, dt)
            self.parts.predict(f, u, rho, dt)
        free_rates(x, u, rho, c.P, self._R, self._fm, self._d)
        return self._end(f, u, rho, dt, *self._fuse(f, u, sound))

    def _at_once(self, f: SensorFrame, u: np.ndarray, sound: int, dt: float, whole: tuple[Any, ...]) -> NavState:
        """All of a step in one compiled call; what it finds out of the ordinary is gone on with step by step."""
        c = self.core
        free_step(self._given, u, *whole)
        out = self._told.tolist()
        m, end, rho, nis = int(out[O_M]), out[O_END], out[O_RHO], out[O_NIS]
        c.took(m, int(out[O_PROBES]), sound)
        if m and end != REFUSED:
            nis = c.sifted(int(out[O_SIFTED]), nis)
        if end != DONE:
            return self._end(f, u, rho, dt, nis, c.m)
        if c.ears(self.out.valid, dt):
            c.hear(f, self._fm, partial(self._force, u, rho))
            return self._publish(f, nis, m)
        return self._say(f, nis, m, out, out[O_SIGMA:])

    def _end(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float, nis: float, m: int) -> NavState:
        """After the correction by m rows."""
        c = self.core
        if why := c.lost(self.out.valid):
            self.begin_again(why)
            return self.out
        free_rates(c.ukf.x, u, rho, c.P, self._R, self._fm, self._d)
        if c.ears(self.out.valid, dt):
            c.hear(f, self._fm, partial(self._force, u, rho))
        return self._publish(f, nis, m)

    def begin_again(self, why: str) -> None:
        """Forget the estimate and start from the sensors as soon as they are there."""
        self.started_us = -1
        self.out.valid, self.out.reason = False, why

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        need = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU
        have = updated & ~failed_bits(health)
        c = self.core
        c.w_air[:] = f.gyro_b
        if have & need != need or c.take_air(f) == 0:
            self.out.valid, self.out.reason = False, "waiting for air data, attitude, GNSS and gyro"
            self.out.t_us = f.t_us
            return self.out
        x = c.ukf.x
        dcm_from_quat(np.array(f.att_q_nb), self._R)
        euler_from_dcm(self._R, self._e)
        x[AIR], x[RATE], x[EULER] = c.air, f.gyro_b, self._e
        x[POS] = np.array(f.gnss_pos_n) + np.array(f.gnss_vel_n) * (
            (f.t_us - f.gnss_t_us) * 1e-6
        )  # the fix is of before
        ua = np.array(air_velocity(x[X_V], x[X_BETA], x[X_ALPHA]))
        to_parent(self._R, ua, self._e)
        x[WIND] = np.array(f.gnss_vel_n) - self._e
        c.start_factor()
        self.t_us = self.started_us = f.t_us
        c.restart(f.t_us)
        self.out.valid = False
        free_rates(x, u, density(-x[X_Z]), c.P, self._R, self._fm, self._d)
        self._publish(f, 0.0, 0)
        self.parts.start(f)
        if self.cmw is not None:
            self.cmw.reset()
        return self.out

    def _fuse(self, f: SensorFrame, u: np.ndarray, updated: int) -> tuple[float, int]:
        """Queue what is new, and correct; NIS and how many rows were used."""
        c = self.core
        m, probes = free_rows(
            self._given, c.tune, c.ukf.x, self._d, self._fm, self._R, c.probe_pos, c.w_air, c.air, *c.rows
        )
        c.took(m, probes, updated)
        if c.m == 0:
            return 0.0, 0
        if self.cmw is not None:
            self.cmw.queue(c, calculated_wind(f, c.air))
        return self.parts.correct(f, u), c.m

    def _force(self, u: np.ndarray, rho: float, x: np.ndarray) -> np.ndarray:
        """Specific force [3] of the model at state x, body axes [m/s^2]."""
        fm = np.zeros(9)
        free_rates(x, u, rho, self.core.P, np.zeros(9), fm, np.zeros(NX))
        return fm[:3]

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        free_told(self.core.ukf.x, self._d, self._fm, self._R, self._told)
        return self._say(f, nis, m, self._told.tolist(), self.core.ukf.sigmas())

    def _say(self, f: SensorFrame, nis: float, m: int, out: list[float], sigma: Sequence[float]) -> NavState:
        """What is published, by the outputs of free_told and the 1-sigma [>=15] of the state."""
        c, o = self.core, self.out
        o.t_us = f.t_us
        o.reason = c.earned(o, self.started_us, *NEEDED, rd.GNSS_VEL if c.p.velocity else rd.GNSS_POS)
        o.valid = not o.reason
        (
            o.V, o.beta, o.alpha, wx, wy, wz, psi, theta, phi, px, py, pz, north, east, down,
            vx, vy, vz, ax, ay, az, qw, qx, qy, qz,
        ) = out[O_X:O_SIGMA]  # fmt: skip
        o.w_b, o.euler, o.q_nb = (wx, wy, wz), (psi, theta, phi), (qw, qx, qy, qz)
        o.pos_n, o.vel_n, o.acc_n, o.wind_n = (px, py, pz), (vx, vy, vz), (ax, ay, az), (north, east, down)
        c.publish_sigma(o, sigma)
        lasting = c.lasting(rd.GNSS_POS, c.p.bias_pos)
        n, e, d = o.scatter
        o.pos_sigma = (math.hypot(n, lasting), math.hypot(e, lasting), math.hypot(d, lasting))
        c.publish_trust(o)
        o.nis, o.nis_dof = nis, m
        return o
