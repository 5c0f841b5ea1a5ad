"""Gust mission of the small UAV, on one page: vane, airspeed, gyro, attitude, height (and GNSS speed, accelerometer) ->
estimator of the wind -> gust load alleviation with flap and elevator, or a pitch and height hold.

50 Hz, every base tick: estimator, law, servos, in this order. The aircraft flies by its own model (model.py) and brings
its own actuators. MAV_CMD_USER_2, param1 chooses the law: 0 hold, 1 alleviation, 2 elevator alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightsw.aircraft import Alexis
from flightsw.missions.base import Mission, MissionSpec, Reports, choices
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimators import ESTIMATORS, GustNavTable, make_gust_nav
from flightsw.missions.gust.laws import LAWS, OTHER, GustCtrlTable, GustLaws
from flightsw.missions.gust.model import GustAircraft
from flightsw.missions.gust.reports import REPORTS, GustModel, GustState, model_of
from flightsw.missions.gust.servo_bank.nav import ServoBankNav
from flightsw.missions.gust.servos import GustServos, Servos
from flightsw.missions.gust.steering import Steering
from flightsw.planar import plane
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    DENIED,
    HF_AIR,
    HF_ATT,
    HF_IMU,
    UPD_ATT,
    UPD_BARO,
    UPD_GNSS,
    UPD_IMU,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
)

MAV_CMD_USER_2 = 31011
INIT, HOLD, ALLEVIATION = PHASES = 0, 16, 17  # WKF_PHASE
(_, ELEVATOR, _, THROTTLE, FLAP, CONTROLS) = range(6)  # in a command: elevator [rad], throttle setting [-], flap [rad]
WORDS = {**dict(enumerate(LAWS)), OTHER: "other"}


@dataclass(frozen=True)
class GustMissionParams:
    """[nav] and [ctrl] of a gust flight file."""

    nav: GustNavTable = field(default_factory=GustNavTable)
    ctrl: GustCtrlTable = field(default_factory=GustCtrlTable)


class GustActuators:
    """The servos as the application steps them: command [5] = (-, elevator [rad], -, throttle setting, flap [rad])."""

    def __init__(self, ac: GustAircraft, delay_ticks: int) -> None:
        self.servos = GustServos(ac, late_steps=delay_ticks)
        self._c = np.zeros(3)

    def reset(self, surfaces: np.ndarray, thrust: float) -> None:
        """All at trim."""
        self.servos.reset()

    def step(self, u: np.ndarray, dt: float) -> None:
        """From the tick at which u was sent to this one, dt [s] later."""
        self._c[[k.ELEVATOR, k.THROTTLE, k.FLAP]] = u[[ELEVATOR, THROTTLE, FLAP]]
        self.servos.send(self._c)
        self.servos.step(dt)


class GustMission(Mission[GustActuators]):
    """Components of the gust mission and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT
    ctrl: GustLaws

    def __init__(self, ac: Alexis, p: GustMissionParams, period_s: float) -> None:
        """Raises DesignError for weights that give no law."""
        self.ac = GustAircraft.of(ac)
        self.cruise = (self.ac.V0_mps, self.ac.H0_m)
        self.nav = make_gust_nav(p.nav, self.ac)
        self.channels = p.nav.channels
        self.p, self._period_s = p, period_s
        self._late = 1
        self.ctrl = self._laws()
        self.steering = Steering(p.nav, p.ctrl.hold, self.ac, self._late)
        trim_N, per_setting_N = self.ac.thrust
        self.span = 2.0 * trim_N / per_setting_N  # settings from no thrust to full, trim half-way
        self.guid = GuidanceCmd(V=self.ac.V0_mps, alt_m=self.ac.H0_m, reason="waiting for readings")
        self._estimator = ESTIMATORS.index(p.nav.estimator)
        self._y = np.zeros(k.NY)
        self._y[[k.Y_VA, k.Y_H, k.Y_GROUND]] = self.ac.V0_mps, self.ac.H0_m, self.ac.V0_mps
        self._u = np.zeros(CONTROLS)
        self._state: GustState | None = None
        self._psi, self._pos_n = 0.0, (0.0, 0.0)
        self._phase_us = -1
        self._texts: list[Text] = []
        self._model: GustModel | None = None

    @property
    def saturated(self) -> bool:
        """Whether elevator or flap is asked for more than its travel."""
        return self.ctrl.saturated

    def step(
        self, f: SensorFrame, act: GustActuators, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 50 Hz step: (nav, guidance, command [5], throttle 0..1)."""
        s, y = act.servos, self._y
        if len(s.queue) != self._late:  # gains belong to a delay
            self._late, law = len(s.queue), self.ctrl.law
            self.ctrl = self._laws()
            self.ctrl.law = law
            self.steering.late(self._late)
        ok = self._read(f, updated)
        if isinstance(self.nav, ServoBankNav):
            self.nav.hear(s.sent, self._late, dt)
        est = self.nav.step(y, ok & self.channels, s.mean, dt, s.now)
        self.steering.trusts(est, dt)
        believed: Servos = s
        if isinstance(self.nav, ServoBankNav):
            believed = self.nav.servos
            if est.servos is not None and est.servos.settled:
                self.ctrl.fit(est.servos.wn_radps, est.servos.late, est.servos.lift)
            self.steering.weigh(est, y, self.nav.open_load() if est.valid else 0.0, self.ctrl.flying != 0, dt)
        c = self.ctrl.step(est.x if self.steering.by(est) else None, y, believed)
        u = self._u
        u[[ELEVATOR, THROTTLE, FLAP]] = c[[k.ELEVATOR, k.THROTTLE, k.FLAP]]
        doubt, why = self.steering.why(est)
        g = self._guide(f.t_us, est.valid, why)
        self._model = None if est.servos is None else model_of(f.t_us, est.servos, self.steering.load.ratio, doubt)
        self._state = state = GustState(
            f.t_us, est.valid, est.reason, tuple(est.x.tolist()), tuple(est.sigma.tolist()),
            est.nis if math.isfinite(est.nis) else 0.0, est.channels, est.scale, est.probabilities,
            float(y[k.Y_AZ]), self.ctrl.a_z, float(u[ELEVATOR]), float(u[FLAP]), self._estimator, self.ctrl.flying,
        )  # fmt: skip
        throttle = min(max(0.5 + float(u[THROTTLE]) / self.span, 0.0), 1.0)
        return self._publish(state), g, u, throttle

    def _laws(self) -> GustLaws:
        bank = self.nav.b if isinstance(self.nav, ServoBankNav) else None
        servos = [(wn, self._late + extra) for wn, extra in bank.models] if bank else []
        lifts = bank.lift_designs if bank else (0.0,)
        return GustLaws(self.p.ctrl, self.ac, self.p.nav.turbulence, self._period_s, self._late, servos, lifts)

    def _read(self, f: SensorFrame, updated: int) -> int:
        """Readings into y [7]; bits of those that are new and good."""
        y, ok = self._y, 0
        if updated & UPD_IMU:
            (_, q, _), (_, _, down) = f.gyro_mean_b, f.acc_mean_b
            y[k.Y_Q], y[k.Y_AZ] = q, -down - self.ac.gravity
            ok |= 1 << k.Y_Q | 1 << k.Y_AZ
        for c, reading in zip((k.Y_VA, k.Y_ALPHA), plane.probe(f, updated), strict=True):
            if reading is not None:
                y[c] = reading
                ok |= 1 << c
        if updated & UPD_ATT:
            self._psi, y[k.Y_TH] = plane.heading_and_pitch(f.att_q_nb)
            ok |= 1 << k.Y_TH
        if updated & UPD_BARO and math.isfinite(f.baro_alt_m):
            y[k.Y_H] = f.baro_alt_m
            ok |= 1 << k.Y_H
        if updated & UPD_GNSS:
            (north, east, _), (v_north, v_east, _) = f.gnss_pos_n, f.gnss_vel_n
            self._pos_n = north, east
            y[k.Y_GROUND] = math.hypot(v_north, v_east)
            ok |= 1 << k.Y_GROUND
        return ok

    def _guide(self, t_us: int, valid: bool, reason: str) -> GuidanceCmd:
        g = self.guid
        phase = 0 if not valid else HOLD if self.ctrl.flying == 0 else ALLEVIATION
        if phase != g.phase or self._phase_us < 0:
            self._phase_us = t_us
        g.phase, g.phase_t_s = phase, (t_us - self._phase_us) * 1e-6
        g.reason = reason or f"law {self.ctrl.words[self.ctrl.flying]}"
        return g

    def _publish(self, s: GustState) -> NavState:
        """The estimate as the state every aircraft publishes. Wind along the heading and down; across it none is known."""
        V0 = self.ac.V0_mps
        V_K, theta = V0 + s.x[k.VK], s.x[k.TH]
        gamma = theta - s.x[k.AK]
        along, climb = V_K * math.cos(gamma), V_K * math.sin(gamma)
        forward, up = along - s.x[k.VW], climb + V0 * s.x[k.AW]
        return plane.publish(
            t_us=s.t_us, valid=s.valid, reason=s.reason, psi=self._psi, theta=theta, q=s.x[k.Q],
            V=math.hypot(forward, up), alpha=theta - math.atan2(up, forward), place=self._pos_n,
            height=self.ac.H0_m + s.x[k.H], along=along, climb=climb, wind_along=s.x[k.VW], wind_down=V0 * s.x[k.AW],
            wind_sigma=(s.sigma[k.VW], s.sigma[k.VW], V0 * s.sigma[k.AW]), pos_sigma=(0.0, 0.0, s.sigma[k.H]),
            pitch_sigma=s.sigma[k.TH], nis=s.nis, nis_dof=s.channels,
        )  # fmt: skip

    @property
    def laws(self) -> Laws:
        """What the command is made of."""
        return self.ctrl.terms

    @property
    def reports(self) -> Reports:
        """The wind felt, and what is done against it."""
        known = {GustState: self._state, GustModel: self._model}
        return {kind: r for kind, r in known.items() if r is not None}

    def first_command(self) -> np.ndarray:
        """Trim command [5] sent until navigation is valid."""
        return np.zeros(CONTROLS)

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        law, why = c.choice(dict(enumerate(self.ctrl.words)), "law")
        if why:
            return DENIED, why
        self.ctrl.select(law)
        self._texts.append(Text(6, f"law {self.ctrl.words[law]}"))
        return ACCEPTED, ""

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, GustMissionParams)
        self.p, self.ctrl.hold.p = params, params.ctrl.hold
        self.steering.adopt(params.nav, params.ctrl.hold)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self._texts = self._texts + self.steering.texts(), []
        return out


def _actuators(ac: Alexis, delay_ticks: int) -> GustActuators:
    """Elevator and flap servos."""
    return GustActuators(GustAircraft.of(ac), delay_ticks)


SPEC = MissionSpec(
    "gust",
    GustMissionParams,
    Alexis,
    "alexis",
    GustMission,
    _actuators,
    phases=PHASES,
    orders=choices(MAV_CMD_USER_2, WORDS, lambda _: PHASES, {"other": "a configuration that names one"}),
    controls=CONTROLS,
    air_used=plane.AIR_USED,
    one_rate=True,  # servos and law are stepped together: their mean and delay are per sample
    reports=REPORTS,
)
