"""The onboard application: one tick, read top to bottom. Pure: no clock, no input or output, no randomness.

Sensors -> health -> (20 Hz: navigation, guidance, control of the mission) -> guard -> actuator command. The same object runs
in lockstep, in real time, in process and in replay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from flightsw.condition import Condition, ConditionParams, refuse_without_tanks
from flightsw.health import HealthMonitor, HealthParams, refuse_unwatched
from flightsw.kernels.atmosphere import calibrated_airspeed
from flightsw.level_flight import level_flight
from flightsw.missions.base import AnySpec, Report, Reports, find_mission
from flightsw.strict import ConfigError, Tree, convert, replaced
from flightsw.types import (
    HF_ACT,
    HF_UPSET,
    UNSUPPORTED,
    UPD_BARO,
    UPD_IMU,
    ZERO3,
    Ack,
    ActuatorCmd,
    Command,
    GuidanceCmd,
    NavState,
    SensorFrame,
    Setting,
    Settled,
    Snapshot,
    Text,
    Timing,
    Vec3,
    copied,
)

WARMUP_TICKS = 150  # past the settling time of navigation: the closed loop runs too
FLAP = 4  # of a command that has one
BARO_AGE_US = 1_000_000  # [us] after which the static pressure is no longer believed
V_TOP, H_TOP = 600.0, 20e3  # [m/s], [m] beyond which there is no calibrated airspeed
MAX_STEP_S = 0.25  # [s] longest control step integrated at once, however late the tick


@dataclass(frozen=True)
class Checked:
    """A mission and its tables, sound as far as can be told without building anything."""

    spec: AnySpec
    params: object  # of the class spec.params
    health: HealthParams
    condition: ConditionParams


def check(mission: str, tables: Tree, base_rate_hz: int, mission_rate_hz: int, where: str) -> Checked:
    """Find `mission` and convert its tables, rates checked. Raises ConfigError naming the key."""
    spec = find_mission(mission, where)
    if base_rate_hz % mission_rate_hz:
        raise ConfigError(
            f"{where}: app.mission_rate_hz = {mission_rate_hz}: must divide base_rate_hz = {base_rate_hz}"
        )
    if spec.one_rate and base_rate_hz != mission_rate_hz:
        raise ConfigError(
            f"{where}: app.mission_rate_hz = {mission_rate_hz}: allowed for mission {mission}: base_rate_hz = {base_rate_hz}"
        )
    own = dict(tables)
    health = convert(own.pop("health", {}), HealthParams, f"{where}: health")
    condition = convert(own.pop("condition", {}), ConditionParams, f"{where}: condition")
    return Checked(spec, convert(own, spec.params, where), health, condition)


class FlightApp:
    """Everything between a sensor frame and an actuator command."""

    def __init__(
        self, mission: str, aircraft: str, tables: Tree, *, base_rate_hz: int = 100, mission_rate_hz: int = 20,
        link_delay_ticks: int = 1, where: str = "flight configuration",
    ) -> None:  # fmt: skip
        """Compose `mission` for `aircraft`; `tables` holds the mission's own tables (nav, ctrl, guid, health).

        Raises ConfigError (unknown mission, bad key), TrimError or DesignError (control design).
        """
        checked = check(mission, tables, base_rate_hz, mission_rate_hz, where)
        spec = self.spec = checked.spec
        self.params = checked.params
        self._again = partial(
            FlightApp, mission, aircraft, tables, base_rate_hz=base_rate_hz, mission_rate_hz=mission_rate_hz,
            link_delay_ticks=link_delay_ticks, where=where,
        )  # fmt: skip
        self.period_us = 1_000_000 // base_rate_hz
        self.slow_us = 1_000_000 // mission_rate_hz
        try:
            self.ac = spec.load(aircraft)
        except ConfigError as e:
            raise ConfigError(f"{where}: app.mission = {mission!r}, app.aircraft = {aircraft!r}: {e}") from None
        try:
            self.mission = spec.build(self.ac, checked.params, 1.0 / mission_rate_hz)
        except ConfigError as e:
            raise ConfigError(f"{where}: {e}") from None
        refuse_unwatched(checked.health, self.mission.may_watch)
        self.health = HealthMonitor(checked.health, self.mission.watch, spec.air_used)
        refuse_without_tanks(checked.condition, self.ac.fuel_capacity_kg)
        self.condition = Condition(checked.condition, self.ac.fuel_capacity_kg)
        self.act = spec.actuators(self.ac, link_delay_ticks)
        self.u = np.zeros(spec.controls)
        self._good = (0.0, 0.0, 0.0, 0.0, 0.0)
        self._good_u = self.u.copy()
        self.cmd = ActuatorCmd(armed=False)
        self.nav, self.guid, self.timing = NavState(), GuidanceCmd(), Timing()
        self.reported: Reports = {}
        self.laws = self.mission.laws
        self.tick_no = 0
        self._updated = 0
        self._baro_us = -BARO_AGE_US
        self._imu: list[tuple[int, Vec3, Vec3]] = []  # stamp, rate, specific force
        self._means: tuple[Vec3, Vec3, float] = (ZERO3, ZERO3, 0.0)  # of rate and specific force, and their age [s]
        self._slow_index = -1
        self._slow_t_us = -1
        self._started = False

    def tick(self, f: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        """One base tick: f the frame now, dt_s [s] since the previous tick. Returns the command and what telemetry may send.

        `f` stays as it came; the snapshot holds what was made of it.
        """
        texts: list[Text] = []
        acks = [self._answer(c) for c in f.commands] if f.commands else []
        settled = [Settled(s, self._set(s)) for s in f.settings] if f.settings else []
        f, h = self.health.step(f)
        f, refused = self.condition.intake(f)
        h.rejected += refused
        t_us = f.t_us
        self._updated |= f.updated
        if f.updated & UPD_IMU:
            self._imu.append((t_us, f.gyro_b, f.acc_b))
        if self._started:
            self.act.step(self.u, dt_s if dt_s < MAX_STEP_S else MAX_STEP_S)
        index = t_us // self.slow_us
        commanded = index != self._slow_index
        if commanded:
            f = self._average_imu(f)
            self._slow(f, texts)
            self._slow_index = index
            self._guard(texts)
        c = self.cmd
        c.t_us = t_us
        snap = Snapshot(
            t_us, self.tick_no, f, self.nav, self.guid, c, h, self.timing, texts, acks, self.reported, self.laws, settled,
            commanded,
        )  # fmt: skip
        self.tick_no += 1
        return c, snap

    def warmup(self) -> None:
        """Run every code path once on a throw-away copy fed with level flight, so that no first use falls into a deadline."""
        app = self._again()
        V, h = app.mission.cruise
        app.mission.exercise()
        for k, f in enumerate(
            level_flight(app.mission.halves * WARMUP_TICKS, len(self.ac.probe), V, h, self.period_us)
        ):
            if k and k % WARMUP_TICKS == 0:
                app.mission.rehearse()
            app.tick(f, self.period_us * 1e-6)

    def _slow(self, f: SensorFrame, texts: list[Text]) -> None:
        """Navigation, guidance, control."""
        dt = self.slow_us * 1e-6 if self._slow_t_us < 0 else min((f.t_us - self._slow_t_us) * 1e-6, MAX_STEP_S)
        self._slow_t_us = f.t_us
        if not self._started:
            # the servos are taken to be where the first command puts them
            u = self.mission.first_command()
            self.u[:] = u
            self.act.reset(u[:3], float(u[3]))
            self._started = True
        self.nav, self.guid, u, throttle = self.mission.step(f, self.act, self._updated, self.health.out, dt)
        self.nav.V_cal = self._calibrated(f)
        self.reported = self.mission.reports
        self.laws = self.mission.laws
        self._updated = 0
        self.health.watch = self.mission.watch
        self.u[:] = u
        c, said = self.cmd, self.u.tolist()
        c.aileron, c.elevator, c.rudder, c.throttle = said[0], said[1], said[2], throttle
        if len(said) > FLAP:
            c.flap = said[FLAP]
        c.latch = self.guid.latch
        # until navigation has been valid once, or recovery flies without it, the aircraft keeps the trim it came in; afterwards
        # it is never handed back
        c.armed = c.armed or self.nav.valid or self.mission.recovering
        texts += self.mission.texts()
        self._report(dt, texts)

    def _report(self, dt: float, texts: list[Text]) -> None:
        """What inputs, navigation and the aircraft itself have to say, into the health report and `texts`."""
        h, r, c = self.health.out, self.mission.refusals, self.condition
        c.step(self.nav, self.mission.saturated, dt)
        h.condition = c.flags | self.mission.faults | (HF_UPSET if self.mission.recovering else 0)
        if r is not None:
            h.held, h.kept_out, h.judged = r.flags, r.mask, r
        for source in (self.health, c) if r is None else (self.health, r, c):
            if source.texts:
                texts += source.texts
                source.texts = []

    def _calibrated(self, f: SensorFrame) -> float:
        """Calibrated airspeed [m/s] of the estimate, by the static pressure; without it, by the altitude."""
        if self._updated & UPD_BARO:
            self._baro_us = f.t_us
        high = f.baro_alt_m if f.t_us - self._baro_us < BARO_AGE_US else -self.nav.pos_n[2]
        V = self.nav.V
        if not 0.0 < V < V_TOP or not abs(high) < H_TOP:
            return 0.0
        return float(calibrated_airspeed(V, high))

    def _average_imu(self, f: SensorFrame) -> SensorFrame:
        """The frame with mean rate and specific force since the last mission step: five samples of noise are worth more than the
        last one. Without a sample the last means stay, with a count of 0."""
        n = len(self._imu)
        if n:
            stamps, rates, forces = zip(*self._imu, strict=True)
            p, q, r = map(math.fsum, zip(*rates, strict=True))
            x, y, z = map(math.fsum, zip(*forces, strict=True))
            self._means = (p / n, q / n, r / n), (x / n, y / n, z / n), (f.t_us - sum(stamps) / n) * 1e-6
            self._imu = []
        gyro, acc, age = self._means
        out = copied(f)
        out.gyro_count, out.gyro_mean_b, out.acc_mean_b, out.gyro_age_s = n, gyro, acc, age
        return out

    def _guard(self, texts: list[Text]) -> None:
        """Last look at a new command before the actuators: a non-finite value becomes the last good one, and is reported once."""
        c = self.cmd
        if math.isfinite(c.aileron + c.elevator + c.rudder + c.throttle + c.flap):
            self._good = (c.aileron, c.elevator, c.rudder, c.throttle, c.flap)
            self.health.out.failed &= ~HF_ACT
            self._good_u[:] = self.u
            return
        if not self.health.out.failed & HF_ACT:
            texts.append(Text(2, "non-finite actuator command replaced"))
        self.health.out.failed |= HF_ACT
        c.aileron, c.elevator, c.rudder, c.throttle, c.flap = self._good
        self.u[:] = self._good_u

    @property
    def commands(self) -> frozenset[int]:
        """MAV_CMD the mission takes."""
        return self.spec.commands

    @property
    def reports(self) -> tuple[Report, ...]:
        """Messages only this mission sends."""
        return self.spec.reports

    @property
    def sends_relative(self) -> bool:
        """Whether it follows another aircraft and says where that is."""
        return self.spec.sends_relative

    @property
    def records(self) -> tuple[tuple[str, object], ...]:
        """Parameters in force, by the name of their table ("": the mission's own)."""
        return (("health", self.health.p), ("condition", self.condition.p), ("", self.params))

    @property
    def phases(self) -> tuple[int, ...]:
        """WKF_PHASE the mission may be in; none: it does not say."""
        return self.spec.phases

    def route(self) -> tuple[Vec3, ...]:
        """Places [m, NED] the mission flies by next."""
        return self.mission.route()

    @property
    def fuel_capacity_kg(self) -> float:
        """What the tanks hold [kg]; 0: none that is measured."""
        return self.ac.fuel_capacity_kg

    def _set(self, s: Setting) -> str:
        """Put a changed parameter in force from this tick on: "", or why it is not and nothing has changed."""
        table, _, rest = s.key.partition(".")
        try:
            if table == "health":
                health = replaced(self.health.p, rest.split("."), s.value)
                refuse_unwatched(health, self.mission.may_watch)
                self.health.use(health)
            elif table == "condition":
                condition = replaced(self.condition.p, rest.split("."), s.value)
                refuse_without_tanks(condition, self.ac.fuel_capacity_kg)
                self.condition.p = condition
            else:
                params = replaced(self.params, s.key.split("."), s.value)
                self.mission.adopt(params)
                self.params = params
        except (ValueError, KeyError) as e:
            return str(e)
        return ""

    def _answer(self, c: Command) -> Ack:
        if c.command in self.spec.commands:
            result, why = self.mission.obey(c)
        else:
            result, why = UNSUPPORTED, f"command {c.command} is not one of this mission"
        return Ack(c.command, result, c.src_system, c.src_component, why)
