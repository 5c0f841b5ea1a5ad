"""Tanker mission, on one page: air data, gyro, attitude, GNSS -> AirframeNav -> RacetrackGuidance -> TankerControl.

20 Hz (every fifth base tick): navigation, guidance, control, in this order. 100 Hz: actuator model, health, guard (app.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.ctrl.common import ScheduleParams
from flightsw.ctrl.tanker import TankerControl, TankerCtrlParams
from flightsw.guid.racetrack import RacetrackGuidance, RacetrackParams
from flightsw.missions.base import Mission
from flightsw.models.actuators import ActuatorModel
from flightsw.nav.common import NavParams
from flightsw.nav.refusal import Refusals
from flightsw.nav.variants import make_airframe_nav
from flightsw.types import HF_AIR, HF_ATT, HF_GNSS, HF_IMU, Command, GuidanceCmd, Health, NavState, SensorFrame, Text

MAV_CMD_DO_CHANGE_SPEED = 178


@dataclass(frozen=True)
class TankerParams:
    """[nav], [ctrl] and [guid] of a tanker flight file."""

    nav: NavParams = field(default_factory=NavParams)
    ctrl: TankerCtrlParams = field(default_factory=lambda: TankerCtrlParams(ScheduleParams()))
    guid: RacetrackParams = field(default_factory=RacetrackParams)


class TankerMission(Mission):
    """Components of the tanker and their order."""

    params_type = TankerParams
    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS

    def __init__(self, ac: Aircraft, p: TankerParams, period_s: float) -> None:
        self.nav = make_airframe_nav(ac, p.nav)
        self.guid = RacetrackGuidance(p.guid)
        self.ctrl = TankerControl(ac, p.ctrl, period_s)
        self.limits = ac.limits
        self.alt_m = p.guid.alt_m

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 20 Hz step: (nav, guidance, surfaces and thrust [4], throttle)."""
        nav = self.nav.step(f, act.take_mean(), health, updated)
        g = self.guid.step(f, nav, dt)
        if nav.valid:
            u, throttle = self.ctrl.step(nav, g, act, dt)
        else:
            u, throttle = self.ctrl.trim_command(g.V, self.alt_m)
        return nav, g, u, throttle

    @property
    def refusals(self) -> Refusals | None:
        """What the estimator refuses of its sensors."""
        return self.nav.core.refusals

    def first_command(self) -> np.ndarray:
        """Trim command [4] sent until navigation is valid."""
        return self.ctrl.trim_command(self.guid.V, self.alt_m)[0]

    def command(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for a ground command."""
        if c.command == MAV_CMD_DO_CHANGE_SPEED:
            ok, why = self.guid.set_speed(c.params[1], self.limits.V_min_mps, self.limits.V_max_mps)
            return (0 if ok else 2), why
        return 3, "command not supported by this mission"

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self.guid.texts = self.guid.texts, []
        return out
