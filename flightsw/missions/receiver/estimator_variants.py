"""Receiver estimator with the choices of Lee (2011) and of this project selectable by parameter.

Rotational wind as three Gauss-Markov states; every probe a measurement of its own; coloured measurement noise by scaled R,
differencing or noise states; wind from the calculated measurement (chapter 6, errata E5-E7 corrected) instead of velocity;
Gauss-Markov or Dryden wind; adapted wind intensity. With every choice at its default this is RelativeNav, step for step.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.filters.gauss_markov import first_order
from flightsw.kernels.atmosphere import density
from flightsw.kernels.linalg import inner
from flightsw.kernels.rotations import to_parent, vec3
from flightsw.missions.receiver.aids import AidParams
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.missions.receiver.rotational import PROBE_CODE, WIND_CODE, differenced_relative, measure_local
from flightsw.sixdof.calculated_wind import CalculatedWind
from flightsw.sixdof.coloured_noise import Colour, colour_states
from flightsw.sixdof.estimator_core import POS, ROT, NavParams
from flightsw.sixdof.gust_states import GUSTS, GustStates
from flightsw.sixdof.measure import measure_relative
from flightsw.sixdof.motion import air_velocity, propagate_relative
from flightsw.sixdof.wind_noise import WindNoise
from flightsw.strict import ConfigError
from flightsw.types import Health, NavState, SensorFrame

CHANNELS = 18  # codes of models.measure.measure_relative


def make_relative_nav(ac: Aircraft, p: NavParams, aid: AidParams | None = None) -> RelativeNav:
    """The plain receiver estimator, or the variant its parameters ask for. Raises ConfigError for what it cannot do."""
    if p.model != "aero":
        raise ConfigError(f"nav.model = {p.model!r}: allowed for a receiver: aero")
    if p.state_form != "wind":
        raise ConfigError(f"nav.state_form = {p.state_form!r}: allowed for a receiver: wind")
    if p.bias_pos != NavParams.bias_pos:
        raise ConfigError(
            f"nav.bias_pos = {p.bias_pos:g}: a receiver knows its place by the tanker's; allowed: left out"
        )
    if p.local_probes and p.colour == "removed" and p.colour_tau_s:
        raise ConfigError("nav.local_probes = true: allowed with colour = scaled, augmented or ignored")
    rw = p.wind_model == "random_walk"
    choices = p.rotational_wind or p.local_probes or p.cmw or p.colour_tau_s
    plain = rw and not choices and p.adapt_wind == "off"
    return RelativeNav(ac, p, aid=aid) if plain else RelativeVariant(ac, p, aid)


def channel_sigma(p: NavParams, probes: int) -> np.ndarray:
    """1-sigma [18] of the measurement channels in code order; air data averaged over `probes`."""
    air = np.array([p.r_V, p.r_beta, p.r_alpha]) / math.sqrt(probes)
    own = [math.hypot(p.r_vel, p.r_own_vel)] * 3  # as RelativeNav queues it
    return np.array([*air, *[p.r_rate] * 3, *[p.r_euler] * 3, *[p.r_pos] * 3, *[p.r_vel] * 3, *own])


class RotationalWind:
    """Effective rotational wind: Gauss-Markov states 15..17, noise columns 18..20."""

    def __init__(self, p: NavParams) -> None:
        self.p = p

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """Zero mean, stationary spread, into x and S in place."""
        x[ROT] = 0.0
        S[ROT, :] = S[:, ROT] = 0.0
        S[ROT, ROT] = np.eye(3) * self.p.rot_sigma

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """Decay of the points X over dt [s], and process noise into SQ."""
        phi, q = first_order(dt, self.p.rot_tau_s, self.p.rot_sigma)
        X[:, ROT] *= phi
        SQ[ROT, 18:21] = np.eye(3) * q


class RelativeVariant(RelativeNav):
    """RelativeNav with other states, measurements, noise colour or adaptation."""

    def __init__(self, ac: Aircraft, params: NavParams, aid: AidParams | None = None) -> None:
        p, probes = params, len(ac.probe)
        first = 18 if p.rotational_wind else 15
        channels = PROBE_CODE + 3 * probes if p.local_probes else CHANNELS
        noise = colour_states(p, channels)
        gusts = GUSTS if p.wind_model == "dryden" else 0
        super().__init__(
            ac, p, first - 15 + noise + gusts, CHANNELS + 3 * int(p.cmw) + 3 * probes * int(p.local_probes), aid
        )
        self.nx = first
        self.core.work = np.zeros((5, first))
        self.rot = RotationalWind(p) if p.rotational_wind else None
        sigma = channel_sigma(p, probes)
        if p.local_probes:
            single = np.tile(channel_sigma(p, 1)[:3], probes)
            sigma = np.concatenate((sigma, [p.r_vel] * 3, single))
        self.colour = Colour(p, sigma, slice(6, 9), first)
        self.gusts = GustStates(first + noise, p) if gusts else None
        self.wind_noise = WindNoise(self.core, first + noise + 3, gusts)
        self.cmw = CalculatedWind(p, WIND_CODE)
        self._dt = 0.0
        self._fresh_air = False

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        out = super()._start(f, u, updated, health)
        if self.started_us >= 0:
            ukf = self.core.ukf
            S = ukf.S.copy()
            if self.rot is not None:
                self.rot.start(ukf.x, S)
            self.colour.start(ukf.x, S)
            if self.gusts is not None:
                self.gusts.start(ukf.x, S)
            ukf.set_factor(S)
            self.cmw.reset()
            self.wind_noise.reset()
        return out

    def _propagate(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        c, p = self.core, self.core.p
        X, SQ = c.ukf.X, c.ukf.SQ
        self._dt = dt
        propagate_relative(X, u, rho, c.P, self._tks, dt, c.work)
        if p.wind_model == "gauss_markov":
            X[:, 12:15] *= math.exp(-dt / p.wind_tau_s)
        if self.rot is not None:
            self.rot.propagate(X, SQ, dt)
        if self.gusts is not None:
            psi = math.atan2(self._Rn[1], self._Rn[0])  # own heading: R_BI of the step's start
            self.gusts.propagate(X, SQ, c.ukf.x, c.wind_jacobian, dt, psi)
        self.colour.propagate(X, SQ, dt)
        self.wind_noise.fill(SQ)

    def _queue_air(self, f: SensorFrame, n: int) -> None:
        self._fresh_air = True
        if self.core.p.local_probes:
            self._queue_probes(f)
        else:
            super()._queue_air(f, n)

    def _correct(self, f: SensorFrame, u: np.ndarray) -> float:
        c, p, tk = self.core, self.core.p, self._tks[2]
        if p.cmw and self._fresh_air:
            self.cmw.queue(c, self.calculated_wind(f))
        self._fresh_air = False
        self._sort_rows()
        # The tanker's rates are taken as exact in w_T x xi. Beside velocity readings known to a hundredth of their noise
        # their scatter would be regressed on xi and pull it towards zero, by metres (errors in variables).
        self.colour.floor[12:15] = p.r_peer_rate * math.sqrt(inner(c.ukf.x[POS], c.ukf.x[POS]))
        rot = self.rot is not None
        ukf = c.ukf

        def measure() -> None:
            m = int((c.codes[: c.m] < CHANNELS).sum())
            measure_relative(ukf.X, c.codes, m, tk, ukf.Y)
            measure_local(ukf.X, rot, c.codes, m, c.m, tk, c.probe_pos, ukf.Y)

        def rates(cf: float, cx: float, m: int) -> None:
            a_t = (tk[15:18] - self._tks[0, 15:18]) / self._dt  # the data link's acceleration
            rho = density(self._altitude(f))
            differenced_relative(ukf.X, self.nx, c.codes, m, u, rho, c.P, tk, a_t, cf, cx, ukf.Y)

        nis = self.colour.correct(c, self._dt, f.gyro_count, measure, rates)
        self.wind_noise.update(self._dt)
        return nis

    def _sort_rows(self) -> None:
        """Rows of the common measurements first: two kernels share the columns."""
        c = self.core
        local = c.codes[: c.m] >= CHANNELS
        if local.any():
            c.pick(np.argsort(local, kind="stable"))

    def calculated_wind(self, f: SensorFrame) -> np.ndarray:
        """Wind [3] NED [m/s] from measured quantities: r_T' + R_BTI^T (xi' - S(w_T) xi - R^T R_BW V).

        Lee (6.14) with errata E7: xi carries its dot, R_BW is not transposed, S(w) = -[w x]. Position, velocity and air data
        are the frame's, attitude is the frame's relative to the tanker's.
        """
        tk = self._tks[2]
        self._relative_euler(f, tk)
        w_t, xi = tk[9:12], np.array(f.rel_pos_t)
        u_a, out = np.zeros(3), np.zeros(3)
        to_parent(self._Rn, np.array(air_velocity(*self.core.air)), u_a)  # R_BRBT, measured
        to_parent(tk[:9], np.array(f.rel_vel_t) + np.cross(w_t, xi) - u_a, out)
        return tk[15:18] + out

    def _queue_probes(self, f: SensorFrame) -> None:
        """Every valid probe's airspeed, sideslip and incidence, carried forward with the rates of the mean air data."""
        c, p, d = self.core, self.core.p, self._d
        age = (f.t_us - f.air_t_us) * 1e-6
        for i in range(min(len(f.air_V), len(c.probe_pos))):
            if (f.air_mask >> i) & 1:
                k = PROBE_CODE + 3 * i
                readings = (f.air_V[i], f.air_beta[i], f.air_alpha[i])
                for j, (y, r) in enumerate(zip(readings, (p.r_V, p.r_beta, p.r_alpha), strict=True)):
                    if not f.air_bad >> (3 * j + i) & 1:
                        c.add(k + j, y + d[j] * age, r, j)

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        o = super()._publish(f, nis, m)
        if self.rot is not None:
            o.wind_rot = vec3(self.core.ukf.x[ROT])
            o.wind_rot_sigma = vec3(np.array(self.core.ukf.sigmas()[ROT]))
        return o
