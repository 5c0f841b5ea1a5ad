"""Receiver mission from en route to refuelling: AirframeNav -> JoinUpGuidance -> free-flight control until the tanker is
near, then the components of ReceiverMission. Both estimators run over the last stretch, so that the second one has settled.

20 Hz (every fifth base tick): navigation, guidance, control, in this order. 100 Hz: actuator model, health, guard (app.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.envelope import Envelope
from flightsw.kernels.rotations import euler_from_dcm, to_parent, vec3
from flightsw.missions.base import Mission, MissionSpec, Reports
from flightsw.missions.receiver.airdata.reports import REPORTS
from flightsw.missions.receiver.guidances import make_join_path
from flightsw.missions.receiver.integrity.report import REPORTS as INTEGRITY
from flightsw.missions.receiver.joinup import ENROUTE, INIT, JOIN_UP, JoinUpParams, Sight
from flightsw.missions.receiver.mission import ORDERS, ReceiverMission, ReceiverParams, files_of
from flightsw.missions.receiver.refuel import NAMES, OBSERVATION, RefuelGuidance
from flightsw.missions.receiver.sequence import Sequence, SequenceParams
from flightsw.missions.receiver.station_keeping import StationKeepingLaw
from flightsw.missions.receiver.tanker_link import PeerTracker, turn_rate
from flightsw.refusal import Refusals
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.autopilot import AutopilotLaw, TankerCtrlParams, make_autopilot
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams, failed_bits
from flightsw.sixdof.layout import TK, TK_DCM, TK_VEL
from flightsw.sixdof.recovery.cruising import protected
from flightsw.sixdof.recovery.given import Felt
from flightsw.sixdof.turning import compared, make_turning
from flightsw.strict import Range
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_PEER,
    HF_REL,
    TEMPORARILY_REJECTED,
    UPD_REL,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
    Vec3,
)

OWN = HF_IMU | HF_AIR | HF_ATT | HF_GNSS
SIGHT_AGE_S = 0.5  # [s] of the relative sensor and of the data link, for the tanker to count as seen
Pos = Annotated[float, Range(1e-9)]


def _free_control() -> TankerCtrlParams:
    return TankerCtrlParams(ScheduleParams(V_mps=(185.0, 215.0), h_m=6800.0))


@dataclass(frozen=True)
class JoinTable:
    """[join]: the flight up to station keeping, and what follows by rule."""

    guid: JoinUpParams = field(default_factory=JoinUpParams)
    nav: NavParams = field(default_factory=NavParams)
    ctrl: TankerCtrlParams = field(default_factory=_free_control)
    sequence: SequenceParams = field(default_factory=SequenceParams)
    settle_from_m: Pos = 300.0  # distance from which the relative estimator runs along
    settle_s: Pos = 10.0  # and for how long before it may take over


@dataclass(frozen=True)
class JoinParams(ReceiverParams):
    """Tables of a receiver flight file, and [join]."""

    join: JoinTable = field(default_factory=JoinTable)


class JoinMission(Mission[ActuatorModel]):
    """Components of the receiver on its way to the tanker, and the refuelling mission it becomes."""

    halves = 2

    def __init__(self, ac: Aircraft, p: JoinParams, period_s: float) -> None:
        j = p.join
        self.p = j
        e, g = Envelope(ac), j.guid
        for key in ("V_mps", "V_min_mps", "V_max_mps"):
            e.speed(f"join.guid.{key}", getattr(g, key))
        e.turn("join.guid.turn_max_degps", g.turn_max_degps, g.V_max_mps)
        self.nav = AirframeNav(ac, j.nav)
        self.guid = make_join_path(j.guid)
        self.free = make_autopilot(ac, j.ctrl, period_s, "join.ctrl", _free_control())
        self.refuel = ReceiverMission(ac, p, period_s)
        self.sequence = Sequence(j.sequence)
        self.ctrl: AutopilotLaw | StationKeepingLaw = self.free
        self.cruise = (j.guid.V_mps, j.guid.alt_m)
        self.joined = False
        self._refused = (0, 0)  # phase and action of the sequence's order that was refused
        self.turning = make_turning(ac, j.nav)
        self.peer = PeerTracker()
        self.sight = Sight()
        self._settled_s = 0.0
        self._tk, self._e, self._v = np.zeros(TK), np.zeros(3), np.zeros(3)
        self._texts: list[Text] = []

    @property
    def may_watch(self) -> int:
        """See Mission."""
        return OWN | HF_REL | HF_PEER

    @property
    def watch(self) -> int:  # type: ignore[override]
        """HF_* flags of what the aircraft depends on: the tanker's only from join-up on."""
        return OWN | HF_REL | HF_PEER if self.joined or self.guid.phase == JOIN_UP else OWN

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 20 Hz step: (nav, guidance, surfaces and thrust [4], throttle)."""
        if self.joined:
            guid = self.refuel.guid
            action = self.sequence.step(f, guid.phase, guid.at_rest, dt)
            if action and not self.recovering:
                self._by_rule(action)
            return self.refuel.step(f, act, updated, health, dt)
        mean = act.take_mean()
        updated, health = compared(self.turning, self.nav.core, f, mean, self.nav.out, updated, health, dt)
        nav = self.nav.step(f, mean, health, updated)
        self._look(f, nav, updated & ~failed_bits(health))
        g = self.guid.step(f.t_us, nav, self.sight, dt)
        self._settle(f, mean, updated, health, dt)
        guard, both = self.refuel.guard, (self.nav, self.refuel.nav)
        felt = Felt(mean, self.turning)
        taken = protected(guard, self.free.terms, f, nav, g, updated, health, felt, dt, *both)
        if taken is not None:
            return nav, g, *taken
        if nav.valid:
            u, throttle = self.free.step(nav, g, act, dt)
            u = u if guard is None else guard.bound(u, f, nav)
        else:
            u, throttle = self.free.trim_command(g.V, g.alt_m)
        if self.guid.ready and self._settled_s >= self.p.settle_s:
            self._join()
            self._texts.append(Text(6, f"station keeping from {math.hypot(*self.sight.pos):.0f} m"))
        return nav, g, u, throttle

    @property
    def recovering(self) -> bool:
        """Whether recovery has the command."""
        return self.refuel.recovering

    def _by_rule(self, action: int) -> None:
        """An order of the sequence. One that is refused comes again with the next step, and is told once."""
        before = self.refuel.guid.phase
        ok, why = self.refuel.guid.command(action)
        if ok:
            self._refused = (0, 0)
        elif self._refused != (before, action):
            self._refused = before, action
            self._texts.append(Text(4, f"sequence waits: {why}"))

    @property
    def faults(self) -> int:
        """HF_* of the aircraft itself."""
        return self.refuel.faults

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.ctrl.saturated

    @property
    def laws(self) -> Laws:
        """Those of both halves; one that does not fly is open."""
        return self.guid.terms, self.free.terms, *self.refuel.laws

    @property
    def reports(self) -> Reports:
        """Those of the refuelling, once joined up."""
        return self.refuel.reports if self.joined else {}

    def exercise(self) -> None:
        """See Mission."""
        self.refuel.exercise()

    @property
    def refusals(self) -> Refusals | None:
        """What the estimator in force refuses of its sensors."""
        return (self.refuel.nav if self.joined else self.nav).core.refusals

    def rehearse(self) -> None:
        """Go on as if joined up: the application's warm-up runs the second half of the mission too."""
        self._join()

    def _join(self) -> None:
        self.joined, self.ctrl = True, self.refuel.ctrl
        if isinstance(self.refuel.guid, RefuelGuidance):
            self.refuel.guid.handed_over()
        self.guid.terms.open()
        self.free.terms.open()

    def first_command(self) -> np.ndarray:
        """Trim command [4] sent until navigation is valid."""
        p = self.p.guid
        return self.free.trim_command(p.V_mps, p.alt_m)[0]

    def _look(self, f: SensorFrame, nav: NavState, updated: int) -> None:
        """The tanker from the relative sensor and its transmitted state, into `sight` and the published state."""
        s, tk = self.sight, self._tk
        self.peer.take(f.peer)
        if updated & UPD_REL:
            s.seen = f.rel_valid
        age = (f.t_us - f.rel_t_us) * 1e-6
        nav.peer_age_s = (f.t_us - f.peer.t_us) * 1e-6 if f.peer.t_us > 0 else 1e9
        if age > SIGHT_AGE_S or nav.peer_age_s > SIGHT_AGE_S:
            s.seen = False
        nav.rel_valid, nav.rel_age_s = s.seen and nav.valid, age if f.rel_t_us > 0 else 1e9
        if not s.seen:
            return
        self.peer.stage(f.t_us, tk)
        euler_from_dcm(tk[TK_DCM], self._e)
        s.psi = float(self._e[0])
        s.turn_rate = turn_rate(tk.tolist())
        c, sn = math.cos(s.psi), math.sin(s.psi)
        self._v[:] = f.rel_pos_t
        to_parent(tk[TK_DCM], self._v, self._e)
        x, y, z = self._e.tolist()
        s.pos = (c * x + sn * y, c * y - sn * x, z)
        s.vel_n = vec3(tk[TK_VEL])
        v = [nav.vel_n[i] - s.vel_n[i] for i in range(3)]
        s.vel = (c * v[0] + sn * v[1], c * v[1] - sn * v[0], v[2])
        nav.rel_pos_t, nav.rel_vel_t = f.rel_pos_t, f.rel_vel_t
        p = self.refuel.nav.core.p
        nav.rel_sigma = (math.hypot(p.r_pos, p.bias_rel),) * 3

    def _settle(self, f: SensorFrame, mean: np.ndarray, updated: int, health: Health, dt: float) -> None:
        """Let the relative estimator run along over the last stretch."""
        s = self.sight
        near = s.seen and self.guid.phase == JOIN_UP and math.hypot(*s.pos) < self.p.settle_from_m
        if not near and self.refuel.nav.started_us < 0:
            return
        nav = self.refuel.navigate(f, mean, updated, health)
        self._settled_s = self._settled_s + dt if nav.valid and nav.rel_valid else 0.0

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        if not self.joined:
            return TEMPORARILY_REJECTED, "not joined up yet"
        result, why = self.refuel.obey(c)
        if result == ACCEPTED:
            self.sequence.on = False
        return result, why

    def route(self) -> tuple[Vec3, ...]:
        """The way to contact once joined up; before, the control point on its own track."""
        if self.joined:
            return self.refuel.route()
        g = self.p.guid
        return ((*g.track_point_m, -g.alt_m),)

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, JoinParams)
        self.refuel.adopt(params)
        self.p, self.sequence.p = params.join, params.join.sequence

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out = self._texts + self.guid.texts + self.refuel.texts()
        self._texts, self.guid.texts = [], []
        if self.turning is not None and self.turning.texts:
            out, self.turning.texts = out + self.turning.texts, []
        return out


SPEC = MissionSpec(
    "receiver_rendezvous",
    JoinParams,
    Aircraft,
    "sixdof",
    JoinMission,
    ActuatorModel,
    phases=(INIT, ENROUTE, JOIN_UP, *range(OBSERVATION, len(NAMES))),
    orders=ORDERS,
    reports=(*REPORTS, *INTEGRITY),
    sends_relative=True,
    files=("tanker",),
    data=files_of,
)
