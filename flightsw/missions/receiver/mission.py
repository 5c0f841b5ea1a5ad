"""Receiver mission: own sensors and the tanker's data link -> AirData -> RelativeNav -> RefuelGuidance -> ReceiverControl.

20 Hz (every fifth base tick): navigation, guidance, control, in this order. 100 Hz: actuator model, health, guard (app.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.envelope import Envelope
from flightsw.kernels.rotations import to_parent, vec3
from flightsw.missions.base import Files, Mission, MissionSpec, Reports, choices
from flightsw.missions.receiver.airdata.airdata import AirData
from flightsw.missions.receiver.airdata.airdata_params import AirDataParams
from flightsw.missions.receiver.airdata.contour.choice import maps_of
from flightsw.missions.receiver.airdata.reports import REPORTS
from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.missions.receiver.guidances import make_refuel_path, use_refuel_path
from flightsw.missions.receiver.integrity.integrity import Integrity
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.report import REPORTS as INTEGRITY
from flightsw.missions.receiver.integrity.report import IntegrityReport
from flightsw.missions.receiver.refuel import ACTIONS, BREAKAWAY, FROM, NAMES, TAKES, RefuelParams
from flightsw.missions.receiver.rejoin import behind
from flightsw.missions.receiver.relative import publish_own_sigma
from flightsw.missions.receiver.station_keeping import ReceiverCtrlParams, make_station_keeping
from flightsw.missions.receiver.tanker_link import turn_rate
from flightsw.refusal import Refusals
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.layout import TK, TK_DCM, TK_VD, TK_VE, TK_VN
from flightsw.sixdof.recovery.given import Felt, RecoveryParams, Rejoin
from flightsw.sixdof.recovery.protection import Protection
from flightsw.sixdof.recovery.turbulence import RoughAirParams
from flightsw.sixdof.turning import compared, make_turning
from flightsw.sixdof.windcal.feed import make_wind_calibration
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.sixdof.windcal.record import WindReport
from flightsw.strict import ConfigError, changed
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    DENIED,
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_PEER,
    HF_REL,
    TEMPORARILY_REJECTED,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
    Vec3,
)

MAV_CMD_USER_1 = 31010


@dataclass(frozen=True)
class ReceiverParams:
    """[nav], [ctrl], [guid], [airdata], [integrity], [wind_calibration], [recovery] and [rough_air] of a receiver flight file."""

    tanker: str = "kc135r"
    nav: NavParams = field(default_factory=lambda: NavParams(q_rate=0.1, q_wind=0.40))
    ctrl: ReceiverCtrlParams = field(default_factory=lambda: ReceiverCtrlParams(ScheduleParams()))
    guid: RefuelParams = field(default_factory=RefuelParams)
    airdata: AirDataParams = field(default_factory=AirDataParams)
    integrity: IntegrityParams = field(default_factory=IntegrityParams)
    wind_calibration: WindCalParams = field(default_factory=WindCalParams)
    recovery: RecoveryParams = field(default_factory=RecoveryParams)
    rough_air: RoughAirParams = field(default_factory=RoughAirParams)


class ReceiverMission(Mission[ActuatorModel]):
    """Components of the receiver and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS | HF_REL | HF_PEER

    def __init__(self, ac: Aircraft, p: ReceiverParams, period_s: float) -> None:
        """Raises ConfigError for way-points that cannot be flown."""
        self.nav = RelativeNav(ac, p.nav, p.airdata.aid if p.airdata.on else None)
        self.wind = make_wind_calibration(ac, p.wind_calibration, behind=True)
        self.air: AirData | None = None
        if p.airdata.on:
            self.air = AirData(ac, p.airdata)
        elif p.airdata.on is None and (idle := changed(p.airdata, AirDataParams())) is not None:
            raise ConfigError(f"airdata.{idle[0]} = {idle[1]!r}: nothing obeys it without airdata.on = true")
        tanker = load_aircraft(p.tanker)
        if p.integrity.on is None and (idle := changed(p.integrity, IntegrityParams())) is not None:
            raise ConfigError(f"integrity.{idle[0]} = {idle[1]!r}: nothing obeys it without integrity.on = true")
        if p.integrity.wake and not p.airdata.on:
            raise ConfigError("integrity.wake = true: allowed with airdata.on = true")
        self.integrity = Integrity(p.integrity, tanker, ac, bool(p.airdata.on)) if p.integrity.on else None
        self.guid = make_refuel_path(p.guid, Surroundings(tanker, ac))
        self.ctrl = make_station_keeping(ac, tanker, p.ctrl, period_s, ReceiverParams().ctrl)
        self.V0 = float(np.mean(p.ctrl.schedule.V_mps))
        self.h0 = p.ctrl.schedule.h_m
        rough = _rough_air(p, Envelope(ac))
        self.guard = Protection(ac, self.h0, period_s, rough) if p.recovery.on else None
        self.turning = make_turning(ac, p.nav)
        self._tk = np.zeros(TK)
        self._lost = self._weak = False
        self._t_us = 0

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One 20 Hz step: (nav, guidance, surfaces and thrust [4], throttle)."""
        mean = act.take_mean()
        updated, health = compared(self.turning, self.nav.core, f, mean, self.nav.out, updated, health, dt)
        heard = updated if self.guard is None else self.guard.sound(updated)
        nav = self.navigate(f, mean if self.guard is None else self.guard.acted(mean), heard, health)
        rejoin = self._guarded(f, nav, updated, health, mean, dt)
        if (self._lost or self.nav.rejoined) and nav.valid and not self.recovering:
            self.guid.recapture(nav)
        self._lost = self.guid.phase != 0 and not nav.valid
        self._t_us = f.t_us
        g = self.guid.step(f, nav, dt)
        taken = None if self.guard is None else self.guard.command(g, rejoin, dt)
        if taken is not None:
            u, throttle = taken
        elif nav.valid:
            psi_dot, V_t = self._tanker_condition(f.t_us, nav)
            u, throttle = self.ctrl.step(nav, g, act, psi_dot, V_t, -nav.pos_n[2], dt)
            u = u if self.guard is None else self.guard.bound(u, f, nav)
        else:
            u, throttle = self.ctrl.trim_command(self.V0, self.h0)
        if self.wind is not None:  # after the law: that goes by the estimator's own wind
            self.wind.publish(nav)
        return nav, g, u, throttle

    def _guarded(self, f: SensorFrame, nav: NavState, updated: int, health: Health, u: np.ndarray, dt: float) -> Rejoin:
        """Let the protection look; it leaves the boom when it takes the command and when it gives it back. The way back to the
        tanker's velocity, for the recovery law."""
        guard = self.guard
        if guard is None:
            return Rejoin()
        rejoin = behind(f, nav)
        guard.step(f, nav, updated, health, rejoin, Felt(u, self.turning), dt)
        if guard.air is not None:  # its gusts come here a fifth of a second later
            bound = "" if self.integrity is None else self.integrity.over
            nav.rel_doubt = bound or ("the tanker's air is too rough" if self.nav.peer.rough else "")
        if self.integrity is not None and guard.air is not None:
            self.integrity.out.turbulence, self.integrity.out.turbulence_max = guard.air.sigma, guard.air.p.bear_mps
        if guard.active:
            self.ctrl.terms.open()
        elsewhere = guard.active and self.guid.phase != BREAKAWAY  # the first valid estimate, an order on its way
        if (guard.began or guard.ended or elsewhere) and self.guid.phase != 0 and nav.valid:
            self.guid.recapture(nav, guard.why or "recovered")
        self._weak = self._weak and guard.answer.weak
        if guard.answer.weak and not self._weak and not guard.active and self.guid.phase != 0 and nav.valid:
            self._weak = True
            self.guid.recapture(nav, "thrust does not answer")
        if guard.ended:
            self._lost = False
        if guard.anew:
            self.nav.begin_again("restarting after recovery")
        return rejoin

    @property
    def recovering(self) -> bool:
        """Whether recovery has the command."""
        return self.guard is not None and self.guard.active

    def navigate(self, f: SensorFrame, mean: np.ndarray, updated: int, health: Health) -> NavState:
        """One estimator step; mean [4]: mean controls that acted since the last one."""
        guard = self.integrity
        if guard is not None:
            told = None if self.air is None else self.air.rows
            f, updated, health = guard.step(f, updated, health, self.nav.peer, self.guid.phase, told)
        if self.air is not None:
            f = self.air.step(f, self.nav, health, updated, guard is None or guard.rel_confirmed)
        nav = self.nav.step(f, mean, health, updated)
        if guard is not None:
            peer = self.nav.peer
            guard.publish(nav, self.nav.rejoined, peer.coasting and not peer.level)
            publish_own_sigma(self.nav.core, nav, self.nav.peer.pos_sigma)
        if self.wind is not None:
            self.wind.feed(f, updated, health, self.nav.core)
        return nav

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
        """What air data and integrity say of themselves, and the wind estimate of the sensors, where they are used."""
        out: Reports = {} if self.air is None else self.air.reports
        if self.integrity is not None:
            out = {**out, IntegrityReport: self.integrity.out}
        return out if self.wind is None else {**out, WindReport: self.wind.report()}

    def exercise(self) -> None:
        """Start-up search and monitor of the air data; the bank of filters the relative measurements are judged by."""
        if self.air is not None:
            self.air.exercise()
        if self.integrity is not None:
            self.integrity.horizon.exercise(self.integrity.rows)

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
        return self.ctrl.trim_command(self.V0, self.h0)[0]

    def _tanker_condition(self, t_us: int, nav: NavState) -> tuple[float, float]:
        """Turn rate [rad/s] and airspeed [m/s] of the tanker from its transmitted state and the wind estimated here."""
        self.nav.peer.stage(t_us, self._tk)
        tk = self._tk.tolist()
        north, east, down = nav.wind_n
        x, y, z = tk[TK_VN] - north, tk[TK_VE] - east, tk[TK_VD] - down
        return turn_rate(tk), math.sqrt(x * x + y * y + z * z)

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT and reason for one of the mission's commands."""
        action, why = c.choice(ACTIONS, "action")
        if why:
            return DENIED, why
        if self.guard is not None and self.guard.active:
            return TEMPORARILY_REJECTED, self.guard.why if self.guard.riding else "recovery has the aircraft"
        if self._weak and ACTIONS[action] not in ("hold", "breakaway"):
            return TEMPORARILY_REJECTED, "thrust does not answer"
        ok, why = self.guid.command(action)
        return (ACCEPTED if ok else TEMPORARILY_REJECTED), why

    def route(self) -> tuple[Vec3, ...]:
        """The way to contact behind the tanker where that is now: observation, low, behind, pre-contact, contact."""
        if self.guid.phase == 0:
            return ()
        t_us = self._t_us
        at, tk, xi, d = self.nav.peer.position(t_us), np.zeros(TK), np.zeros(3), np.zeros(3)
        self.nav.peer.stage(t_us, tk)
        out: list[Vec3] = []
        for xi[:] in self.guid.places():
            to_parent(tk[TK_DCM], xi, d)
            out.append(vec3(at + d))
        return tuple(out)

    def adopt(self, params: object) -> None:
        """Changed parameters from this step on."""
        assert isinstance(params, ReceiverParams)
        use_refuel_path(self.guid, params.guid)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self.guid.texts = self.guid.texts, []
        if self.air is not None and self.air.texts:
            out, self.air.texts = out + self.air.texts, []
        if self.guard is not None and self.guard.texts:
            out, self.guard.texts = out + self.guard.texts, []
        if self.integrity is not None and self.integrity.texts:
            out, self.integrity.texts = out + self.integrity.texts, []
        if self.turning is not None and self.turning.texts:
            out, self.turning.texts = out + self.turning.texts, []
        return out if self.wind is None else out + self.wind.tell()


def files_of(p: ReceiverParams) -> Files:
    """Data files the parameters name, by key. Raises ConfigError for one that is not there."""
    maps = maps_of(p.airdata.position) if p.airdata.on else {}
    return {f"airdata.position.{key}": paths for key, paths in maps.items()}


def _rough_air(p: ReceiverParams, envelope: Envelope) -> RoughAirParams | None:
    """What air is too rough, None: none is. Raises ConfigError for keys nothing would obey, a speed beyond the file's."""
    air = p.rough_air
    on = p.integrity.on if air.on is None else air.on
    if not on:
        if air.on is None and (idle := changed(air, RoughAirParams())) is not None:
            raise ConfigError(
                f"rough_air.{idle[0]} = {idle[1]!r}: nothing obeys it without integrity.on or rough_air.on = true"
            )
        return None
    if not p.recovery.on:
        if (idle := changed(air, RoughAirParams())) is not None:
            raise ConfigError(f"rough_air.{idle[0]} = {idle[1]!r}: nothing obeys it without recovery.on = true")
        return None
    envelope.speed("rough_air.V_mps", air.V_mps)
    return air


ORDERS = choices(MAV_CMD_USER_1, ACTIONS, FROM.__getitem__, TAKES)
SPEC = MissionSpec(
    "receiver",
    ReceiverParams,
    Aircraft,
    "sixdof",
    ReceiverMission,
    ActuatorModel,
    phases=tuple(range(len(NAMES))),
    orders=ORDERS,
    reports=(*REPORTS, *INTEGRITY),
    sends_relative=True,
    files=("tanker",),
    data=files_of,
)
