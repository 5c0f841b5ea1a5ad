"""Free-aircraft estimator with the choices of Lee (2011) and of this project selectable by parameter.

Prediction from aerodynamics, accelerometers ("hybrid") or inertial sensors alone; wind from inertial velocity or from the
calculated measurement (CMW); Gauss-Markov wind; coloured measurement noise by scaled R, differencing or noise states; wind
intensity adapted to the innovations. With every choice at its default this is AirframeNav, step for step.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_quat, to_parent
from flightsw.refusal import GateParams
from flightsw.sixdof.calculated_wind import CalculatedWind
from flightsw.sixdof.coloured_noise import Colour, colour_states
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.gust_states import GUSTS, GustStates
from flightsw.sixdof.measure import measure_free
from flightsw.sixdof.motion import air_velocity, propagate_free
from flightsw.sixdof.sensed import measure_differenced, propagate_sensed
from flightsw.sixdof.velocity_form import VelocityForm
from flightsw.sixdof.velocity_form_kernel import exchange
from flightsw.sixdof.wind_noise import WindNoise
from flightsw.strict import ConfigError
from flightsw.types import Health, NavState, SensorFrame

CHANNELS = 15  # twelve states and inertial velocity: one noise state each
CMW_CODE = 15  # first code of the calculated wind in models.measure


def make_airframe_nav(ac: Aircraft, p: NavParams) -> AirframeNav:
    """The plain estimator, or the variant its parameters ask for. Raises ConfigError for what only a receiver has."""
    for name in ("rotational_wind", "local_probes"):
        if getattr(p, name):
            raise ConfigError(f"nav.{name} = true: allowed for a receiver only")
    for name in ("r_own_vel", "rot_sigma", "rot_tau_s", "rot_q_rate", "r_peer_rate", "bias_rel", "peer_att"):
        if getattr(p, name) != getattr(NavParams, name):
            raise ConfigError(f"nav.{name} = {getattr(p, name):g}: allowed for a receiver only")
    if p.gate.peer_wind_sigma != GateParams.peer_wind_sigma:
        raise ConfigError(f"nav.gate.peer_wind_sigma = {p.gate.peer_wind_sigma:g}: allowed for a receiver only")
    if p.state_form == "velocity" and p.adapt_wind != "off":
        raise ConfigError(f"nav.adapt_wind = {p.adapt_wind!r}: allowed with state_form = velocity: off")
    rw = p.wind_model == "random_walk" and p.state_form == "wind"
    plain = rw and p.model == "aero" and not p.cmw and not p.colour_tau_s and p.adapt_wind == "off"
    return AirframeNav(ac, p) if plain else AirframeVariant(ac, p)


def channel_sigma(p: NavParams, probes: int = 1) -> np.ndarray:
    """1-sigma [15] of the measurement channels in code order; air data averaged over `probes`."""
    air = np.array([p.r_V, p.r_beta, p.r_alpha]) / math.sqrt(probes)
    return np.array([*air, *[p.r_rate] * 3, *[p.r_euler] * 3, *[p.r_pos] * 3, *[p.r_vel] * 3])


class AirframeVariant(AirframeNav):
    """AirframeNav with other prediction, wind measurement, noise colour or adaptation."""

    def __init__(self, ac: Aircraft, params: NavParams) -> None:
        p = params
        noise = colour_states(p, CHANNELS)
        self.gusts = GustStates(15 + noise, p) if p.wind_model == "dryden" else None
        super().__init__(ac, p, noise + (GUSTS if self.gusts else 0))
        p = self.core.p  # with noise_scale applied
        self.colour = Colour(p, channel_sigma(p, len(ac.probe)), slice(6, 9), 15)
        self.wind_noise = WindNoise(self.core, 18 + noise, GUSTS if self.gusts else 0)
        self.cmw = CalculatedWind(p, CMW_CODE)
        self.form = VelocityForm(self.core.ukf) if p.state_form == "velocity" else None
        self._sensed = np.zeros(6)
        self._acc, self._gyro = np.zeros(3), np.zeros(3)
        self._dt = 0.0

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        out = super()._start(f, u, updated, health)
        if self.started_us >= 0:
            ukf = self.core.ukf
            self._acc[:], self._gyro[:] = f.acc_b, f.gyro_mean_b
            S = ukf.S.copy()
            if self.form is not None:
                self.form.start(S, self.colour.sigma)
            self.colour.start(ukf.x, S, read=self.form is not None)
            if self.gusts is not None:
                self.gusts.start(ukf.x, S)
            ukf.set_factor(S)
            self.cmw.reset()
            self.wind_noise.reset()
        return out

    def _predict(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        form = self.form
        if form is not None:
            form.enter()
        super()._predict(f, u, rho, dt)
        if form is not None:
            form.leave()

    def _propagate(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        c, p = self.core, self.core.p
        X = c.ukf.X
        self._dt = dt
        if self.form is not None:
            exchange(X, -1.0)
        if p.model == "aero":
            propagate_free(X, u, rho, c.P, dt, c.work)
        else:
            acc, gyro = np.array(f.acc_b), np.array(f.gyro_mean_b)
            self._sensed[:3] = 0.5 * (self._acc + acc)
            self._sensed[3:] = (gyro - self._gyro) / dt if p.model == "inertial" else 0.0
            self._acc, self._gyro = acc, gyro
            propagate_sensed(X, u, rho, c.P, self._sensed, p.model != "hybrid", dt, c.work)
        if p.wind_model == "gauss_markov":
            X[:, 12:15] *= math.exp(-dt / p.wind_tau_s)
        if self.form is not None:
            exchange(X, 1.0)
        if self.gusts is not None:
            self.gusts.propagate(X, c.ukf.SQ, c.ukf.x, c.wind_jacobian, dt, wind=self.form is None)
        self.colour.propagate(X, c.ukf.SQ, dt)
        self.wind_noise.fill(c.ukf.SQ)
        if self.form is not None:
            self.form.noise(c.ukf.SQ)

    def _correct(self, f: SensorFrame, u: np.ndarray) -> float:
        c = self.core
        if c.p.cmw:
            self._q[:] = f.att_q_nb
            dcm_from_quat(self._q, self._R)
            # v - R_BI^T u_a from measured quantities (Lee 4.7)
            ua = np.zeros(3)
            to_parent(self._R, np.array(air_velocity(*c.air)), ua)
            self.cmw.queue(c, np.array(f.gnss_vel_n) - ua)
        ukf, form = c.ukf, self.form

        def measure() -> None:
            measure_free(ukf.X if form is None else form.wind_points(), c.codes, c.m, ukf.Y)

        def rates(cf: float, cx: float, m: int) -> None:
            X = ukf.X if form is None else form.wind_points()
            measure_differenced(X, c.codes, m, u, density(-ukf.x[11]), c.P, cf, cx, ukf.Y)

        if form is not None:
            form.enter()
        nis = self.colour.correct(c, self._dt, f.gyro_count, measure, rates)
        if form is not None:
            form.leave()
        self.wind_noise.update(self._dt)
        return nis
