"""Windshear mission of the twin-jet transport, on one page: height, ground speed, climb rate, airspeed, incidence, pitch,
pitch rate, accelerations -> wind, its rates, scales of lift and drag -> hazard index, approach or escape -> thrust and elevator.

50 Hz, every base tick: estimator, monitor, guidance, control. The aircraft flies by its own model (model.py).
MAV_CMD_DO_GO_AROUND gives the approach up; MAV_CMD_USER_3, param1 chooses the escape law.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import TwinJet
from flightsw.envelope import Envelope
from flightsw.missions.base import Mission, MissionSpec, Order, Reports, choices
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import monitor_kernel as kk
from flightsw.missions.windshear.actuators import ELEVATOR, THRUST, WindshearActuators
from flightsw.missions.windshear.continuous import make_nav
from flightsw.missions.windshear.control import PathLaw, make_law, use_law
from flightsw.missions.windshear.estimator import CONTINUOUS, WindshearEstimate
from flightsw.missions.windshear.guidance import LAWS, PHASES
from flightsw.missions.windshear.model import MODES, PathDemand, approach_trim, parameter_vector
from flightsw.missions.windshear.monitor import WindshearMonitor
from flightsw.missions.windshear.path import make_path, use_path
from flightsw.missions.windshear.readings import Readings
from flightsw.missions.windshear.reports import REPORTS, WORDS, WindshearErrors, WindshearState
from flightsw.missions.windshear.supervision import Supervision
from flightsw.missions.windshear.tables import WindshearMissionParams
from flightsw.planar import plane
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    DENIED,
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
    Vec3,
)

MAV_CMD_DO_GO_AROUND, MAV_CMD_USER_3 = 191, 31012
FIRST_PHASE = 22  # WKF_PHASE of PHASES[0]
ON_THE_WIRE = (0, *range(FIRST_PHASE, FIRST_PHASE + len(PHASES)))
GIVEN_UP = ("escape", "clear")  # phases of an approach that has been: no way back
ESTIMATORS = ("ekf", "ukf", "srckf", "srukf", *CONTINUOUS)  # index goes down in WINDSHEAR_STATE
BLIND = "no estimate: full thrust, pitch held"


class WindshearMission(Mission[WindshearActuators]):
    """Components and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS
    cruise = (75.0, 350.0)
    ctrl: PathLaw

    def __init__(self, ac: TwinJet, p: WindshearMissionParams, period_s: float) -> None:
        """Raises ValueError for parameters no filter can run."""
        self.p = p
        self.nav, self.monitor = make_nav(p.nav, ac), WindshearMonitor(p.nav.monitor)
        self.guidance, self.ctrl = make_path(p.guid), make_law(p.ctrl, ac)
        a, escape = p.guid.approach, p.guid.escape
        e = self.envelope = Envelope(ac)
        for key in ("speed_min_mps", "speed_max_mps"):
            e.speed(f"guid.approach.{key}", getattr(a, key))
        e.incidence("guid.approach.alpha_max_rad", a.alpha_max_rad)
        for key in ("alpha_max_rad", "managed_alpha_max_rad"):
            e.incidence(f"guid.escape.{key}", getattr(escape, key))
        e.incidence("guid.engine_out.alpha_max_rad", p.guid.engine_out.alpha_max_rad)
        e.speed("guid.escape.protect_mps", escape.protect_mps)
        self._trim = approach_trim(ac, a.ground_mps, -math.radians(a.slope_deg), p.nav.lift_scale, p.nav.drag_scale)
        self.ctrl.reset(*self._trim)
        self.full_kN = ac.engine.thrust_N / 1e3
        self.guid = GuidanceCmd(V=a.ground_mps, reason="waiting for readings")
        self._estimator = ESTIMATORS.index(p.nav.filter)
        self.readings, self._u = Readings(ac.air.gravity_mps2), self.first_command()
        self._state: WindshearState | None = None
        self._valid = False
        self._words, self._without = WORDS["approach"], ""
        self._x, self._blind_s = np.zeros(len(self.nav.x)), 0.0
        self._phase_us = -1
        self._texts: list[Text] = []
        self.supervision = Supervision(p.nav.trust, p.guid.engine_out, self.nav.errs, parameter_vector(ac))

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.ctrl.saturated

    @property
    def laws(self) -> Laws:
        """What the command is made of."""
        return (self.ctrl.terms,)

    def step(
        self, f: SensorFrame, act: WindshearActuators, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 50 Hz step: (nav, guidance, command [4], throttle 0..1 of the thrust at rest)."""
        z = self.readings.z
        ok = self.readings.take(f, updated)
        watch, nav = self.supervision, self.nav
        e = nav.step(z, ok & ~watch.mask, watch.in_force(act.now), dt)
        if e.valid and not self._valid:  # a start: no reading of the filter gives the place along the track
            psi, (north, east) = self.readings.psi, self.readings.pos_n
            e.x[k.X] = north * math.cos(psi) + east * math.sin(psi)
            nav.place(float(e.x[k.X]))
        self._valid = e.valid
        runs, thrust = self.monitor.step(z, ok & watch.sound, dt), float(act.now[k.TC])
        accused = runs and e.valid and self.monitor.compare(e.x, e.sigma, dt)
        distrust = watch.step(z, ok, self.readings.satellite_m, e, accused, thrust, nav.gate.score, dt)
        self._texts += watch.texts()
        if distrust and self.guidance.phase not in GIVEN_UP and self.guidance.law != "continue":
            self.guidance.abort()
        self.guidance.engine_out = watch.engine_out
        before, cautions = self.guidance.phase, self.guidance.cautions
        demand = self.guidance.step(e.x, e.F, dt, e.valid)
        self._tell(before, self.guidance.cautions > cautions, e)
        c = self._steer(e, z, ok, thrust, demand, dt)
        u = self._u
        u[ELEVATOR], u[THRUST] = c[k.DE], min(max(float(c[k.TC]), 0.0), self.full_kN) * 1e3
        g = self._guide(f.t_us, e)
        h, m = self.guidance.state, self.monitor.x
        self._state = state = WindshearState(
            f.t_us, e.valid, e.reason, tuple(e.x[: k.NX].tolist()), tuple(e.sigma[: k.NX].tolist()), h.F, h.quick, h.slow,
            e.F if e.valid else 0.0, self.monitor.F if runs else math.nan,
            (float(m[kk.K_WX]), float(m[kk.K_WH])) if runs else (math.nan, math.nan),
            e.nis if math.isfinite(e.nis) else 0.0, e.channels, self.p.nav.states, self.nav.turbulence, demand.climb_mps,
            demand.speed_mps, demand.pitch_rad, MODES.index(demand.mode), u[THRUST] * 1e-3, u[ELEVATOR], self._estimator,
            LAWS.index(self.guidance.law), PHASES.index(self.guidance.phase), h.caution, h.abort, accused,
        )  # fmt: skip
        return self._publish(state), g, u, u[THRUST] * 1e-3 / self.full_kN

    def _tell(self, before: str, new_caution: bool, e: WindshearEstimate) -> None:
        """Texts for what has changed."""
        phase = self.guidance.phase
        if phase != before:
            behind = phase == "clear" and before == "escape"
            self._words = WORDS[phase] if phase != "clear" or behind else "climbing away"
            if phase != "caution" or new_caution:
                self._texts.append(Text(4 if phase in ("caution", "escape") else 6, self._words))
        without = e.reason if e.valid else ""
        if without != self._without:
            self._without = without
            self._texts.append(Text(4 if without else 6, f"estimator: {without or 'all readings again'}"))

    def _steer(
        self, e: WindshearEstimate, z: np.ndarray, ok: int, thrust_kN: float, demand: PathDemand, dt: float
    ) -> np.ndarray:
        """Controls [2]. A short gap of the estimate holds what was commanded; a longer one gives the approach up, at full thrust
        and the pitch of the pitch law, on the last state renewed by what readings there are."""
        if e.valid:
            self._x[:] = e.x
            self._blind_s = 0.0
            return self.ctrl.step(e.x, demand)
        self._blind_s += dt
        if not self._x[k.VA] > 0.0 or self._blind_s < self.p.guid.blind_s:
            return self.ctrl.hold()
        if self._blind_s < self.p.guid.blind_s + dt:
            self._texts.append(Text(3, BLIND))
            self.guidance.abort()
        x, esc = self._x, self.p.guid.escape
        x[k.WX : k.KL] = 0.0
        x[k.T] = thrust_kN
        for reading, state in ((k.Y_VA, k.VA), (k.Y_AL, k.AL), (k.Y_Q, k.Q)):
            if ok >> reading & 1:
                x[state] = z[reading]
        if ok >> k.Y_TH & 1:
            x[k.GA] = z[k.Y_TH] - x[k.AL]
        pitch = PathDemand("pitch", pitch_rad=math.radians(esc.pitch_deg), alpha_max_rad=esc.alpha_max_rad)
        return self.ctrl.step(x, pitch)

    def _guide(self, t_us: int, e: WindshearEstimate) -> GuidanceCmd:
        g, name = self.guid, self.guidance.phase
        phase = FIRST_PHASE + PHASES.index(name) if self._valid or self._phase_us >= 0 else 0
        if phase != g.phase or self._phase_us < 0:
            self._phase_us = t_us if phase else -1
        g.phase, g.phase_t_s = phase, (t_us - self._phase_us) * 1e-6 if phase else 0.0
        g.reason = self._words if e.valid else e.reason
        g.V = self.guidance.demand.speed_mps
        slope = self.guidance.slope_height(float(e.x[k.X]))
        g.alt_m = slope if math.isfinite(slope) else float(e.x[k.H])
        return g

    def _publish(self, s: WindshearState) -> NavState:
        """The estimate as the state every aircraft publishes. Wind along the heading and down; across it none is known."""
        x, sigma, P = s.x, s.sigma, self.nav.P
        pitch_sigma = math.sqrt(max(P[k.GA, k.GA] + 2.0 * P[k.GA, k.AL] + P[k.AL, k.AL], 0.0))
        V, gamma = x[k.VA], x[k.GA]
        return plane.publish(
            t_us=s.t_us, valid=s.valid, reason=s.reason, psi=self.readings.psi, theta=gamma + x[k.AL], q=x[k.Q], V=V,
            alpha=x[k.AL], place=self.readings.pos_n, height=x[k.H],
            along=V * math.cos(gamma) + x[k.WX], climb=V * math.sin(gamma) + x[k.WH],
            wind_along=x[k.WX], wind_down=-x[k.WH], wind_sigma=(sigma[k.WX], sigma[k.WX], sigma[k.WH]),
            pos_sigma=(sigma[k.X], sigma[k.X], sigma[k.H]), pitch_sigma=pitch_sigma if s.valid else math.inf, nis=s.nis,
            nis_dof=s.channels,
        )  # fmt: skip

    @property
    def reports(self) -> Reports:
        """The wind, the hazard in it, and what is done about it; errors learnt, where they are."""
        s = self._state
        out: Reports = {} if s is None else {WindshearState: s}
        return (
            out if s is None or self.nav.errs is None else out | {WindshearErrors: self.supervision.report(s, self.nav)}
        )

    @property
    def faults(self) -> int:
        """HF_* of what this mission finds wrong: an engine, its own estimate."""
        return self.supervision.faults

    def first_command(self) -> np.ndarray:
        """Command [4] of steady flight on the slope in still air, sent until navigation is valid."""
        thrust_kN, elevator = self._trim
        return np.array([0.0, elevator, 0.0, thrust_kN * 1e3])

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        if c.command == MAV_CMD_DO_GO_AROUND:
            if self.guidance.law == "continue":
                return DENIED, "law continue does not escape; choose another"
            self.guidance.abort()
            self._texts.append(Text(4, "go around, by command"))
            return ACCEPTED, ""
        law, why = c.choice(dict(enumerate(LAWS)), "law")
        if why:
            return DENIED, why
        if LAWS[law] == "continue" and self.guidance.phase in GIVEN_UP:
            return DENIED, "law continue: the approach has been given up"
        self.guidance.choose(LAWS[law])
        self._texts.append(Text(6, f"escape law {LAWS[law]}"))
        return ACCEPTED, ""

    def route(self) -> tuple[Vec3, ...]:
        """The approach slope: where it was taken up, and where it meets the ground."""
        ends = self.guidance.slope_ends()
        c, s = math.cos(self.readings.psi), math.sin(self.readings.psi)
        north, east = self.readings.pos_n
        across = east * c - north * s  # of the track, which is straight
        return tuple((x * c - across * s, x * s + across * c, -h) for x, h in ends)

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, WindshearMissionParams)
        a, escape = params.guid.approach, params.guid.escape
        for key in ("alpha_max_rad", "managed_alpha_max_rad"):
            self.envelope.incidence(f"guid.escape.{key}", getattr(escape, key))
        self.envelope.incidence("guid.engine_out.alpha_max_rad", params.guid.engine_out.alpha_max_rad)
        self.envelope.speed("guid.escape.protect_mps", escape.protect_mps)
        if a.climb_min_mps > a.climb_max_mps:
            raise ValueError(
                f"guid.approach.climb_min_mps = {a.climb_min_mps:g}: allowed: climb_max_mps = {a.climb_max_mps:g} or less"
            )
        use_path(self.guidance, params.guid)
        self.supervision.engines.p = params.guid.engine_out
        use_law(self.ctrl, params.ctrl)
        self.p = params

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self._texts = self._texts, []
        return out


def _law_phases(law: str) -> list[int]:
    """WKF_PHASE in which a law may be chosen."""
    barred = GIVEN_UP if law == "continue" else ()
    return [p for p in ON_THE_WIRE if p < FIRST_PHASE or PHASES[p - FIRST_PHASE] not in barred]


def _actuators(ac: TwinJet, delay_ticks: int) -> WindshearActuators:
    """Thrust command and elevator on their way."""
    return WindshearActuators(delay_ticks)


SPEC = MissionSpec(
    "windshear",
    WindshearMissionParams,
    TwinJet,
    "twinjet",
    WindshearMission,
    _actuators,
    phases=ON_THE_WIRE,
    orders=(
        Order(MAV_CMD_DO_GO_AROUND, "go-around", frozenset(ON_THE_WIRE), besides="another law than `continue`"),
        *choices(MAV_CMD_USER_3, dict(enumerate(LAWS)), _law_phases),
    ),
    air_used=plane.AIR_USED,
    one_rate=True,  # readings and commands are per sample
    reports=REPORTS,
)
