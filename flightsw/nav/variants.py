"""Free-aircraft estimator with the choices of Lee (2011) and of this project selectable by parameter.

Prediction from aerodynamics, accelerometers ("hybrid") or inertial sensors alone; wind from inertial velocity or from the
calculated measurement (CMW); Gauss-Markov wind; coloured measurement noise by scaled R, differencing or noise states; wind
intensity adapted to the innovations. With every choice at its default this is AirframeNav, step for step.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.filters.adaptive import NoiseAdapter
from flightsw.filters.coloured import Differencer, NoiseStates, scaled_sigma
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_quat
from flightsw.models.airframe import air_velocity, propagate_free
from flightsw.models.measure import measure_free
from flightsw.models.sensed import measure_differenced, propagate_sensed
from flightsw.nav.airframe import AirframeNav
from flightsw.nav.common import NavParams
from flightsw.nav.gusts import GUSTS, GustStates
from flightsw.types import Health, NavState, SensorFrame

CHANNELS = 15  # twelve states and inertial velocity: one noise state each
CMW_CODE = 15  # first code of the calculated wind in models.measure


def make_airframe_nav(ac: Aircraft, p: NavParams) -> AirframeNav:
    """The plain estimator, or the variant its parameters ask for."""
    rw = p.wind_model == "random_walk"
    plain = rw and p.model == "aero" and not p.cmw and not p.colour_tau_s and not p.adapt_wind
    return AirframeNav(ac, p) if plain else AirframeVariant(ac, p)


def channel_sigma(p: NavParams) -> np.ndarray:
    """1-sigma [15] of the measurement channels in code order (single probe)."""
    return np.array([p.r_V, p.r_beta, p.r_alpha, *[p.r_rate] * 3, *[p.r_euler] * 3, *[p.r_pos] * 3, *[p.r_vel] * 3])


class AirframeVariant(AirframeNav):
    """AirframeNav with other prediction, wind measurement, noise colour or adaptation."""

    def __init__(self, ac: Aircraft, params: NavParams) -> None:
        p = params
        self.colour = p.colour if p.colour_tau_s > 0.0 else "ignored"
        coloured = CHANNELS if self.colour == "augmented" else 0
        self.gusts = GustStates(15 + coloured, p) if p.wind_model == "dryden" else None
        super().__init__(ac, p, coloured + (GUSTS if self.gusts else 0))
        s, tau = channel_sigma(p), np.full(CHANNELS, max(p.colour_tau_s, 1e-9))
        angle = np.array([0] * 6 + [1] * 3 + [0] * 6)
        self.noise = NoiseStates(15, 18, s, tau) if self.colour == "augmented" else None
        self.diff = Differencer(s, tau, angle=angle) if self.colour == "removed" else None
        self.adapter = NoiseAdapter(p.q_wind, 12, 3) if p.adapt_wind else None
        self._cmw: deque[np.ndarray] = deque(maxlen=p.cmw_samples)
        self._sensed = np.zeros(6)
        self._acc, self._gyro = np.zeros(3), np.zeros(3)
        self._dt, self._reading = 0.0, np.zeros(CHANNELS)

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        out = super()._start(f, u, updated, health)
        if self.started_us >= 0:
            self._acc[:], self._gyro[:] = f.acc_b, f.gyro_mean_b
            self._cmw.clear()
            S = self.core.ukf.S.copy()
            if self.noise is not None:
                self.noise.start(self.core.ukf.x, S)
            if self.gusts is not None:
                self.gusts.start(self.core.ukf.x, S)
            self.core.ukf.set_factor(S)
            if self.diff is not None:
                self.diff.reset()
            if self.adapter is not None:
                self.adapter.reset()
        return out

    def _propagate(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        c, p = self.core, self.core.p
        X = c.ukf.X
        self._dt = dt
        if p.model == "aero":
            propagate_free(X, u, rho, c.P, dt, c.work)
        else:
            acc, gyro = np.array(f.acc_b), np.array(f.gyro_mean_b)
            self._sensed[:3] = 0.5 * (self._acc + acc)
            self._sensed[3:] = (gyro - self._gyro) / dt
            self._acc, self._gyro = acc, gyro
            propagate_sensed(X, u, rho, c.P, self._sensed, p.model == "inertial", dt, c.work)
        if p.wind_model == "gauss_markov":
            X[:, 12:15] *= math.exp(-dt / p.wind_tau_s)
        if self.gusts is not None:
            self.gusts.propagate(X, c.ukf.SQ, c.ukf.x, c.wind_jacobian, dt)
        if self.noise is not None:
            self.noise.propagate(X, dt)
            self.noise.fill(c.ukf.SQ, dt)

    def _correct(self, f: SensorFrame, u: np.ndarray) -> float:
        c, p = self.core, self.core.p
        if p.cmw:
            self._queue_cmw(f)
        if self.diff is not None:
            nis = self._correct_differenced(u)
        else:
            if self.colour == "scaled" and self._dt > 0.0:
                c.r[: c.m] *= scaled_sigma(1.0, self._dt, p.colour_tau_s)
            c.ukf.draw()
            measure_free(c.ukf.X, c.codes, c.m, c.ukf.Y)
            if self.noise is not None:
                for j in range(c.m):
                    if c.codes[j] < CHANNELS:
                        self.noise.add(c.ukf.X, c.ukf.Y, j, int(c.codes[j]))
                        c.r[j] *= 1e-2  # the noise is a state now; what is left keeps the update regular
            nis = c.ukf.correct(c.y, c.r, c.m)
        if self.adapter is not None:
            c.q_wind = self.adapter.update(c.ukf, c.m, self._dt)
        return nis

    def _correct_differenced(self, u: np.ndarray) -> float:
        """Measurement differencing on the channels present (Lee, sections 3.5 and 4.4); airdata rows carry the wind increment."""
        c, d = self.core, self.diff
        assert d is not None
        self._reading[c.codes[: c.m]] = c.y[: c.m]
        if not d.push(self._reading, self._dt):
            return 0.0
        q = np.zeros(CHANNELS)
        q[0], q[1:3] = c.q_wind, c.q_wind / c.ukf.x[0]
        r = d.inflated(q, self._dt)
        for j in range(c.m):
            k = int(c.codes[j])
            c.y[j], c.r[j] = d.y[k], r[k]
        c.ukf.draw()
        measure_differenced(
            c.ukf.X, c.codes, c.m, u, density(-c.ukf.x[11]), c.P, float(d.cf[0]), float(d.cx[0]), c.ukf.Y
        )
        return c.ukf.correct(c.y, c.r, c.m)

    def _queue_cmw(self, f: SensorFrame) -> None:
        """Calculated measurement of wind: causal mean of v - R_BI^T u_a from measured quantities (Lee 4.7, 4.8)."""
        c, p = self.core, self.core.p
        self._q[:] = f.att_q_nb
        dcm_from_quat(self._q, self._R)
        ua = np.array(air_velocity(*c.air))
        self._cmw.append(np.array(f.gnss_vel_n) - self._R.reshape(3, 3).T @ ua)
        n = len(self._cmw)
        mean = sum(self._cmw) / n
        one = p.r_vel**2 + p.r_V**2 / 3 + c.air[0] ** 2 * ((p.r_beta**2 + p.r_alpha**2) / 2 + p.r_euler**2) * 2 / 3
        for i in range(3):
            c.add(CMW_CODE + i, float(mean[i]), math.sqrt(one / n))
