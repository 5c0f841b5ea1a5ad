"""A small application and plant for tests of the process around the application."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

from flightsw.aircraft import load_aircraft
from flightsw.icd import wire
from flightsw.icd.codec import PlantCodec
from flightsw.missions.receiver.airdata.reports import REPORTS
from flightsw.process.config import AppConfig, FlightConfig, LinkConfig, TelemetryConfig
from flightsw.strict import IN_FLIGHT, OneOf, Range, replaced
from flightsw.terms import Laws, LawTerms, Output
from flightsw.types import (
    UPD_IMU,
    Ack,
    ActuatorCmd,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Setting,
    Settled,
    Snapshot,
    Text,
    Timing,
    Vec3,
)


@dataclasses.dataclass(frozen=True)
class Ctrl:
    """Numbers of every kind."""

    gain: Annotated[float, Range(0.0, 2.0), IN_FLIGHT] = 1.0
    w_pos_m: tuple[float, float, float] = (0.6, 0.5, 0.4)
    law: Annotated[str, OneOf(("hold", "fly", "land")), IN_FLIGHT] = "fly"
    steps: Annotated[int, Range(1, 5), IN_FLIGHT] = 2
    on: Annotated[bool, IN_FLIGHT] = False
    free: bool | None = None
    file: str = "kc135r"


@dataclasses.dataclass(frozen=True)
class Params:
    """Parameters of the application."""

    ctrl: Ctrl = dataclasses.field(default_factory=Ctrl)


class FakeApp:
    """Commands what the gyro says; accepts every command it is given; remembers the time steps and stamps it saw."""

    commands = frozenset({31010})
    reports = REPORTS
    sends_relative = True
    phases = (0, 3)
    fuel_capacity_kg = 0.0

    def __init__(self) -> None:
        self.n = 0
        self.steps: list[float] = []
        self.stamps: list[int] = []
        self.updated: list[int] = []
        self.texts: list[Text] = []
        self.commands_seen: list[Command] = []
        self.health = Health()
        self.nav = NavState(valid=True, V=195.0, reason="")
        self.gain = 1.0
        self.params = Params()
        self.places: tuple[Vec3, ...] = ()
        self.reported: dict[type, object] = {}
        self.laws: Laws = (LawTerms("law", (Output("elevator", "rad"),)),)

    @property
    def records(self) -> tuple[tuple[str, object], ...]:
        return (("", self.params),)

    def route(self) -> tuple[Vec3, ...]:
        return self.places

    def set(self, s: Setting) -> str:
        if s.key == "ctrl.gain" and s.value == 0.5:
            return "cannot be flown"
        self.params = replaced(self.params, s.key.split("."), s.value)
        self.gain = self.params.ctrl.gain
        return ""

    def tick(self, frame: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        self.steps.append(dt_s)
        self.stamps.append(frame.t_us)
        self.updated.append(frame.updated)
        self.nav.t_us = frame.t_us
        self.nav.w_b = frame.gyro_b
        cmd = ActuatorCmd(frame.t_us, elevator=self.gain * frame.gyro_b[1], throttle=0.5)
        self.commands_seen += frame.commands
        acks = [Ack(c.command, 0, c.src_system, c.src_component) for c in frame.commands]
        settled = [Settled(s, self.set(s)) for s in frame.settings]
        texts, self.texts = self.texts, []
        snap = Snapshot(
            frame.t_us,
            self.n,
            frame,
            self.nav,
            GuidanceCmd(phase=3, reason="test"),
            cmd,
            self.health,
            Timing(),
            texts,
            acks,
            self.reported,
            self.laws,
            settled,
        )
        self.n += 1
        return cmd, snap


def config(**changes: Any) -> FlightConfig:
    """A receiver's configuration with a few numbers to show as parameters."""
    cfg = FlightConfig(
        AppConfig("receiver", "receiver", "learjet24", 2),
        link=LinkConfig(peer_sysid=1),
        telemetry=TelemetryConfig(),
        tables={"ctrl": {"w_pos_m": [0.6, 0.5, 0.4], "schedule": {"V_mps": [180.0, 200.0]}}},
    )
    return dataclasses.replace(cfg, **changes)


class FakePlant:
    """Datagrams for one aircraft."""

    def __init__(self, sysid: int = 2, aircraft: str = "learjet24") -> None:
        self.codec = PlantCodec(load_aircraft(aircraft), sysid)

    def at(self, tick: int, *extra: bytes) -> bytes:
        """The datagram of a tick: an IMU sample that depends on the tick."""
        f = SensorFrame(t_us=tick * 10_000, updated=UPD_IMU, gyro_b=(0.0, tick * 1e-4, 0.0), acc_b=(0.0, 0.0, -9.81))
        return self.codec.sensors(f, extra)


def names(data: bytes) -> list[str]:
    """Message names in a datagram."""
    return [p[0].name for p in wire.split(data, wire.SPECS, wire.Counters())]


def fields(data: bytes, name: str) -> list[dict[str, Any]]:
    """Fields of every message `name` in a datagram."""
    return [p[0].to_dict(p[1]) for p in wire.split(data, wire.SPECS, wire.Counters()) if p[0].name == name]


def fly_fake() -> None:
    """The real command `flightsw` with the fake application. For a process of its own: its next application is fake too."""
    from flightsw import __main__ as program
    from flightsw.process import node

    node.make_app = lambda *_: FakeApp()  # type: ignore[assignment, return-value]
    program.main()
