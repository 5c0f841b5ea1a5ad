"""Rendezvous tanker, on one page: own sensors -> AirframeNav; TACAN and radar -> ReceiverTrack; both -> RendezvousPilot ->
TankerControl. Ahead of the receiver it flies on like the mission `tanker`.

20 Hz (every fifth base tick): navigation, guidance, control, in this order. 100 Hz: actuator model, health, guard (app.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.envelope import Envelope
from flightsw.kernels.rotations import wrap_pi
from flightsw.missions.base import Mission, MissionSpec, Order, Reports
from flightsw.missions.rendezvous.announce import announcements
from flightsw.missions.rendezvous.pilot import PilotParams, RendezvousPilot
from flightsw.missions.rendezvous.reports import REPORTS, RendezvousState
from flightsw.missions.rendezvous.track import ReceiverTrack, TrackParams
from flightsw.missions.tanker.mission import MAV_CMD_DO_CHANGE_SPEED, SPEED, speed_command
from flightsw.missions.tanker.racetrack import LEG, TURN, RacetrackParams, make_path, use_path
from flightsw.refusal import Refusals
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.autopilot import TankerCtrlParams, make_autopilot
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.recovery.cruising import protected
from flightsw.sixdof.recovery.given import Felt, RecoveryParams
from flightsw.sixdof.recovery.protection import Protection
from flightsw.sixdof.turning import compared, make_turning
from flightsw.strict import Range
from flightsw.terms import Laws
from flightsw.types import (
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    TEMPORARILY_REJECTED,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
    Vec3,
)

INIT, RDV_APPROACH, RDV_TURN, RDV_ROLLOUT, RDV_LEG = 0, 13, 14, 15, 26  # WKF_PHASE
PHASE = {
    "approach": RDV_APPROACH,
    "turn": RDV_TURN,
    "rollout": RDV_ROLLOUT,
    "done": RDV_ROLLOUT,
    "leg": RDV_LEG,
}


@dataclass(frozen=True)
class RendezvousParams:
    """[rendezvous] of a flight file."""

    track: TrackParams = field(default_factory=TrackParams)
    pilot: PilotParams = field(default_factory=PilotParams)
    capture_s: Annotated[float, Range(0.0, 120.0)] = 15.0  # on the course of the track before the racetrack takes over


@dataclass(frozen=True)
class RendezvousMissionParams:
    """[nav], [ctrl], [rendezvous], [recovery] and, for what comes after, [guid] of the flight file."""

    nav: NavParams = field(default_factory=NavParams)
    ctrl: TankerCtrlParams = field(default_factory=lambda: TankerCtrlParams(ScheduleParams(V_mps=(190.0, 215.0))))
    guid: RacetrackParams = field(default_factory=RacetrackParams)
    rendezvous: RendezvousParams = field(default_factory=RendezvousParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)


class RendezvousMission(Mission[ActuatorModel]):
    """Components of the rendezvous tanker and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS

    def __init__(self, ac: Aircraft, p: RendezvousMissionParams, period_s: float) -> None:
        self.nav = AirframeNav(ac, p.nav)
        self.turning = make_turning(ac, p.nav)
        self.track = ReceiverTrack(p.rendezvous.track)
        self.pilot = RendezvousPilot(p.rendezvous.pilot)
        self.guid = make_path(p.guid)
        self.turn_rate_degps = p.guid.turn_rate_degps
        self.ctrl = make_autopilot(ac, p.ctrl, period_s, "ctrl", RendezvousMissionParams().ctrl)
        self.envelope = e = Envelope(ac)
        e.speed("guid.V_mps", p.guid.V_mps)
        e.turn("guid.turn_rate_degps", p.guid.turn_rate_degps, p.guid.V_mps)
        g = p.rendezvous.pilot.guidance
        for key in ("bank_max_deg", "steer_bank_deg"):
            e.bank(f"rendezvous.pilot.guidance.{key}", getattr(g, key))
        for speed in (g.speed_mps - g.trim_mps, g.speed_mps + g.trim_mps):
            e.speed("rendezvous.pilot.guidance.speed_mps less or plus trim_mps", speed)
        self.alt_m = p.guid.alt_m
        self.V0 = p.rendezvous.pilot.guidance.speed_mps
        self.guard = Protection(ac, self.alt_m, period_s) if p.recovery.on else None
        self.out = GuidanceCmd(V=self.V0, alt_m=self.alt_m, reason="waiting for navigation")
        self.met: RendezvousState | None = None
        self.t_phase_us = 0
        self.said: list[Text] = []
        self.capture_s = p.rendezvous.capture_s
        self.t_done_us = -1
        self.joined = False  # rendezvous over: the racetrack has the aircraft

    def exercise(self) -> None:
        """The estimator beyond its first range."""
        self.track.exercise()

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 20 Hz step: (nav, guidance, surfaces and thrust [4], throttle)."""
        mean = act.take_mean()
        updated, health = compared(self.turning, self.nav.core, f, mean, self.nav.out, updated, health, dt)
        heard = updated if self.guard is None else self.guard.sound(updated)
        acted = mean if self.guard is None else self.guard.acted(mean)
        nav = self.nav.step(f, acted, health, heard)
        self.met = self.track.step(f, nav, updated)
        if self.joined:
            g = self.guid.step(f, nav, dt)
            self.pilot.follow(g.V, g.psi_dot, self.track.own)
        else:
            g = self._rendezvous(f, nav, dt)
        self.pilot.report(self.met)
        felt = Felt(mean, self.turning)
        taken = protected(self.guard, self.ctrl.terms, f, nav, g, updated, health, felt, dt, self.nav)
        if taken is not None:
            u, throttle = taken
        elif nav.valid:
            u, throttle = self.ctrl.step(nav, g, act, dt)
            u = u if self.guard is None else self.guard.bound(u, f, nav)
        else:
            u, throttle = self.ctrl.trim_command(g.V, self.alt_m)
        return nav, g, u, throttle

    def _rendezvous(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        o, pilot, r = self.out, self.pilot, self.met
        if nav.valid and r is not None:
            e, seen = self.track.est, r.valid
            range_m = r.range_m if seen else math.inf
            c = pilot.step(
                self.track.own, r.mean if seen else None, range_m, dt, e.last_covariance, e.out.left_plan, e.out.sided
            )
            self.said += announcements(c)
            c.announced = 0
            if pilot.phase == "done":
                self.track.closed = True  # the receiver leaves its plan now: it joins up
                self.t_done_us = f.t_us if self.t_done_us < 0 else self.t_done_us
                if f.t_us - self.t_done_us >= self.capture_s * 1e6:
                    return self._join(f, nav, dt)
            phase = PHASE[pilot.phase]
            if phase != o.phase:
                after, o.phase, self.t_phase_us = o.phase, phase, f.t_us
                o.reason = {
                    RDV_APPROACH: "approach, navigation valid",
                    RDV_TURN: f"turn, miss {c.miss_x_m / 1852.0:+.2f} {c.miss_y_m / 1852.0:+.2f} NM",
                    RDV_ROLLOUT: "roll-out, course reached" if after != RDV_LEG else "leg over",
                    RDV_LEG: f"leg, {c.miss_x_m / 1852.0:+.2f} {c.miss_y_m / 1852.0:+.2f} NM off",
                }[phase]
                self.said.append(Text(6, f"rendezvous: {o.reason}"[:50]))
        o.phase_t_s = (f.t_us - self.t_phase_us) * 1e-6
        o.V, o.psi_dot = pilot.V, pilot.psi_dot
        return o

    def _join(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """Ahead of the receiver: straight on, on the course of the refuelling track."""
        self.joined = True
        g = self.guid.step(f, nav, dt)
        course = self.track.frame.heading(self.pilot.guid.out.final_psi)
        psi, _, _ = nav.euler
        self.guid.take_over(psi + wrap_pi(course - psi), self.pilot.V, self.pilot.psi_dot)
        g.V, g.psi_dot = self.pilot.V, self.pilot.psi_dot
        return g

    @property
    def faults(self) -> int:
        """HF_* of the aircraft itself."""
        return 0 if self.guard is None else self.guard.faults

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.ctrl.saturated

    @property
    def reports(self) -> Reports:
        """The receiver's track and the turn planned on it."""
        return {} if self.met is None else {RendezvousState: self.met}

    @property
    def laws(self) -> Laws:
        """What the command is made of."""
        own = (self.pilot.terms, self.ctrl.terms)
        return own if self.guard is None else (*own, self.guard.law.terms)

    @property
    def recovering(self) -> bool:
        """Whether recovery has the command."""
        return self.guard is not None and self.guard.active

    @property
    def refusals(self) -> Refusals | None:
        """What the estimator refuses of its sensors."""
        return self.nav.core.refusals

    def first_command(self) -> np.ndarray:
        """Trim command [4] sent until navigation is valid."""
        command, _ = self.ctrl.trim_command(self.V0, self.alt_m)
        return command

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        if not self.joined:
            return TEMPORARILY_REJECTED, "speed is the rendezvous's until roll-out"
        return speed_command(c, self.guid, self.envelope, self.turn_rate_degps)

    def route(self) -> tuple[Vec3, ...]:
        """The racetrack once it is joined; before, to the control point, where the receiver is met."""
        if self.joined:
            return self.guid.route()
        frame = self.track.frame
        return ((frame.north_m, frame.east_m, -self.alt_m),)

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, RendezvousMissionParams)
        use_path(self.guid, params.guid)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out = self.track.texts + self.said + self.guid.texts
        self.track.texts, self.said, self.guid.texts = [], [], []
        if self.guard is not None and self.guard.texts:
            out, self.guard.texts = out + self.guard.texts, []
        if self.turning is not None and self.turning.texts:
            out, self.turning.texts = out + self.turning.texts, []
        return out


SPEC = MissionSpec(
    "rendezvous",
    RendezvousMissionParams,
    Aircraft,
    "sixdof",
    RendezvousMission,
    ActuatorModel,
    phases=(INIT, RDV_APPROACH, RDV_TURN, RDV_ROLLOUT, RDV_LEG, LEG, TURN),
    orders=(Order(MAV_CMD_DO_CHANGE_SPEED, "speed", frozenset((LEG, TURN)), besides=SPEED),),
    reports=REPORTS,
)
