"""Tanker mission, on one page: air data, gyro, attitude, GNSS -> AirframeNav -> RacetrackGuidance -> TankerControl.

20 Hz (every fifth base tick): navigation, guidance, control, in this order. 100 Hz: actuator model, health, guard (app.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.envelope import Envelope
from flightsw.missions.base import Mission, MissionSpec, Order, Reports, report
from flightsw.missions.tanker.racetrack import INIT, LEG, TURN, PathGuidance, RacetrackParams, make_path, use_path
from flightsw.refusal import Refusals
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.autopilot import TankerCtrlParams, make_autopilot
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.excitation import Excitation, ExcitationParams
from flightsw.sixdof.recovery.cruising import protected
from flightsw.sixdof.recovery.given import Felt, RecoveryParams
from flightsw.sixdof.recovery.protection import Protection
from flightsw.sixdof.recovery.turbulence import Turbulence, TurbulenceParams
from flightsw.sixdof.turning import compared, make_turning
from flightsw.sixdof.windcal.feed import make_wind_calibration
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.sixdof.windcal.record import WindReport, report_values
from flightsw.strict import ConfigError, changed
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    DENIED,
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_ROUGH,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
    Vec3,
)

MAV_CMD_DO_CHANGE_SPEED = 178
PHASES = (INIT, LEG, TURN)
SPEED = "an airspeed the aircraft can fly on its racetrack"


@dataclass(frozen=True)
class TankerAirParams(TurbulenceParams):
    """[rough_air] of a tanker flight file: what intensity of turbulence is announced, and how it is learnt."""

    on: bool = True  # false: nothing is announced, whatever else is set


@dataclass(frozen=True)
class TankerParams:
    """[nav], [ctrl], [guid], [wind_calibration], [recovery], [rough_air] and [excitation] of a tanker flight file."""

    nav: NavParams = field(default_factory=NavParams)
    ctrl: TankerCtrlParams = field(default_factory=lambda: TankerCtrlParams(ScheduleParams()))
    guid: RacetrackParams = field(default_factory=RacetrackParams)
    wind_calibration: WindCalParams = field(default_factory=WindCalParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)
    rough_air: TankerAirParams = field(default_factory=TankerAirParams)
    excitation: ExcitationParams = field(default_factory=ExcitationParams)


class TankerMission(Mission[ActuatorModel]):
    """Components of the tanker and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS

    def __init__(self, ac: Aircraft, p: TankerParams, period_s: float) -> None:
        self.nav = AirframeNav(ac, p.nav)
        self.wind = make_wind_calibration(ac, p.wind_calibration)
        self.guid = make_path(p.guid)
        self.turn_rate_degps = p.guid.turn_rate_degps
        self.ctrl = make_autopilot(ac, p.ctrl, period_s, "ctrl", TankerParams().ctrl)
        self.envelope = e = Envelope(ac)
        e.speed("guid.V_mps", p.guid.V_mps)
        e.turn("guid.turn_rate_degps", p.guid.turn_rate_degps, p.guid.V_mps)
        self.alt_m = p.guid.alt_m
        self.guard = Protection(ac, self.alt_m, period_s) if p.recovery.on else None
        self.air = _turbulence(p)
        self.turning = make_turning(ac, p.nav)
        self.tests = Excitation(ac, p.excitation, period_s) if p.excitation.on else None

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 20 Hz step: (nav, guidance, surfaces and thrust [4], throttle)."""
        mean = act.take_mean()
        updated, health = compared(self.turning, self.nav.core, f, mean, self.nav.out, updated, health, dt)
        heard = updated if self.guard is None else self.guard.sound(updated)
        acted = mean if self.guard is None else self.guard.acted(mean)
        nav = self.nav.step(f, acted, health, heard)
        g = self.guid.step(f, nav, dt)
        felt = Felt(mean, self.turning)
        taken = protected(self.guard, self.ctrl.terms, f, nav, g, updated, health, felt, dt, self.nav)
        # told, not acted on: the receiver leaves, the tanker flies on
        if self.guard is not None and self.air is not None:
            self.air.step(self.guard.readings, not self.guard.active, dt)
        if taken is not None:
            u, throttle = taken
        elif nav.valid:
            u, throttle = self.ctrl.step(nav, g, act, dt)
            if self.tests is not None:
                u, throttle = self.tests.step(u, throttle, f.t_us)
            u = u if self.guard is None else self.guard.bound(u, f, nav)
        else:
            u, throttle = self.ctrl.trim_command(g.V, self.alt_m)
        if self.tests is not None and (taken is not None or not nav.valid):
            self.tests.stop("recovery" if taken is not None else "navigation")
        if self.wind is not None:  # after the law: that goes by the estimator's own wind
            self.wind.feed(f, updated, health, self.nav.core)
            self.wind.publish(nav)
        return nav, g, u, throttle

    @property
    def recovering(self) -> bool:
        """Whether recovery has the command."""
        return self.guard is not None and self.guard.active

    @property
    def faults(self) -> int:
        """HF_* of what this mission finds wrong: the air, the aircraft."""
        own = 0 if self.guard is None else self.guard.faults
        return own | (HF_ROUGH if self.air is not None and self.air.rough else 0)

    @property
    def reports(self) -> Reports:
        """What the wind estimate says of the sensors, where there is one."""
        return {} if self.wind is None else {WindReport: self.wind.report()}

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.ctrl.saturated

    @property
    def laws(self) -> Laws:
        """What the command is made of."""
        return (self.ctrl.terms,) if self.guard is None else (self.ctrl.terms, self.guard.law.terms)

    @property
    def refusals(self) -> Refusals | None:
        """What the estimator refuses of its sensors."""
        return self.nav.core.refusals

    def first_command(self) -> np.ndarray:
        """Trim command [4] sent until navigation is valid."""
        return self.ctrl.trim_command(self.guid.V, self.alt_m)[0]

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        return speed_command(c, self.guid, self.envelope, self.turn_rate_degps)

    def route(self) -> tuple[Vec3, ...]:
        """The racetrack."""
        return self.guid.route()

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, TankerParams)
        use_path(self.guid, params.guid)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self.guid.texts = self.guid.texts, []
        if self.guard is not None:
            out, self.guard.texts = out + self.guard.texts, []
        if self.air is not None:
            out = out + self.air.tell()
        if self.turning is not None and self.turning.texts:
            out, self.turning.texts = out + self.turning.texts, []
        if self.tests is not None:
            out, self.tests.texts = out + self.tests.texts, []
        return out if self.wind is None else out + self.wind.tell()


def _turbulence(p: TankerParams) -> Turbulence | None:
    """What learns the roughness of the air, None: nothing does. Raises ConfigError for keys nothing would obey: it goes by
    the readings of recovery."""
    air = p.rough_air
    if not air.on:
        return None
    if not p.recovery.on:
        if (idle := changed(air, TankerAirParams())) is not None:
            raise ConfigError(f"rough_air.{idle[0]} = {idle[1]!r}: nothing obeys it without recovery.on = true")
        return None
    return Turbulence(air)


def speed_command(c: Command, guid: PathGuidance, envelope: Envelope, turn_rate_degps: float) -> tuple[int, str]:
    """MAV_RESULT and reason for MAV_CMD_DO_CHANGE_SPEED on a path with turns of that rate: airspeed only, no throttle."""
    kind, speed, throttle = c.params[:3]
    if kind != 0.0:
        return DENIED, f"speed type {kind:g}: allowed 0 airspeed"
    if throttle not in (-1.0, 0.0) and not math.isnan(throttle):
        return DENIED, f"throttle {throttle:g}: allowed -1 no change"
    ok, why = guid.set_speed(speed, envelope.limits.V_min_mps, envelope.fastest(turn_rate_degps))
    return (ACCEPTED if ok else DENIED), why


SPEC = MissionSpec(
    "tanker",
    TankerParams,
    Aircraft,
    "sixdof",
    TankerMission,
    ActuatorModel,
    phases=PHASES,
    orders=(Order(MAV_CMD_DO_CHANGE_SPEED, "speed", frozenset(PHASES), besides=SPEED),),
    reports=(report("WIND_CALIBRATION", WindReport, report_values, rate_hz=1.0, offset=7),),
)
