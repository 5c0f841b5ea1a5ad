"""The contract between the application and a mission, this project's or another package's.

A mission is a class that fills `Mission`, and one `SPEC = MissionSpec(...)` that says what the application must know before there
is one. Specs are found by name (flightsw.plugins, group wakefield.missions).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np

from flightsw import plugins
from flightsw.aircraft import Airframe, load_as
from flightsw.refusal import Refusals
from flightsw.strict import ConfigError
from flightsw.terms import Laws
from flightsw.types import Command, GuidanceCmd, Health, NavState, SensorFrame, Text, Vec3

Packets = Iterator[tuple[float | int | bytes, ...]]  # values of the fields of one packet each, in the dialect's order
Reports = dict[type, object]  # records for telemetry, by their class
R = TypeVar("R")
A = TypeVar("A", bound=Airframe)
P = TypeVar("P")
Act = TypeVar("Act", bound="Actuators")
ActIn = TypeVar("ActIn", bound="Actuators", contravariant=True)


@dataclass(frozen=True)
class Report:
    """A message only one mission sends: its name in the dialect, the class of the record it is made of, how that becomes packets,
    and when: `rate_hz` [Hz], `offset` in slots of the 10 Hz grid (icd/rates.py). Made by `report`."""

    message: str
    kind: type
    packets: Callable[[object], Packets]  # of a record of that class; none of anything else
    rate_hz: float
    offset: int = 0


def report(message: str, kind: type[R], values: Callable[[R], Packets], rate_hz: float, offset: int = 0) -> Report:
    """The report of a message made of records of class `kind`, one tuple of `values` per packet."""

    def packets(record: object) -> Packets:
        return values(record) if isinstance(record, kind) else iter(())

    return Report(message, kind, packets, rate_hz, offset)


@dataclass(frozen=True)
class Order:
    """A command as its phases see it: MAV_CMD, the word for it, the phases (WKF_PHASE) in which it is accepted, and what that
    needs besides. value: param1 that makes it this one; None: param1 chooses nothing."""

    command: int
    word: str
    phases: frozenset[int]
    value: int | None = None
    besides: str = ""


def choices(
    command: int,
    words: Mapping[int, str],
    phases: Callable[[str], Iterable[int]],
    besides: Mapping[str, str] | None = None,
) -> tuple[Order, ...]:
    """The orders of a command whose param1 chooses one of `words`, each accepted in phases(word)."""
    return tuple(
        Order(command, word, frozenset(phases(word)), value, (besides or {}).get(word, ""))
        for value, word in words.items()
    )


class Actuators(Protocol):
    """Onboard copy of the actuators: what is between a command and what acts now."""

    def reset(self, surfaces: np.ndarray, thrust: float) -> None:
        """The aircraft comes with surfaces [3] [rad] and thrust [N]."""

    def step(self, u: np.ndarray, dt: float) -> None:
        """From the tick at which the command u was sent to this one, dt [s] later."""


class Mission(Protocol[ActIn]):
    """What the application asks of every mission. A class that names it as its base inherits the answers given here."""

    watch: int  # HF_* flags of what the aircraft depends on now
    cruise: tuple[float, float] = (195.0, 7010.0)  # [m/s], [m] of the level flight the warm-up feeds it
    halves: int = 1  # stretches of flight the warm-up goes through

    def step(
        self, f: SensorFrame, act: ActIn, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """One step, dt [s] after the last: readings f of which `updated` (UPD_*) are new -> navigation, guidance, command u
        (three surfaces [rad], thrust [N], and a flap [rad] where the spec says so), throttle 0..1."""

    def first_command(self) -> np.ndarray:
        """Command u sent until navigation is valid."""

    def texts(self) -> list[Text]:
        """Messages since the last call."""

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""

    @property
    def recovering(self) -> bool:
        """Whether recovery from outside the envelope has the command."""
        return False

    @property
    def faults(self) -> int:
        """HF_* flags of what the mission itself finds wrong, beside its sensors."""
        return 0

    @property
    def may_watch(self) -> int:
        """HF_* flags it depends on at one time or another."""
        return self.watch

    @property
    def refusals(self) -> Refusals | None:
        """What the navigation in force refuses of its sensors; None: it keeps no such account."""
        return None

    @property
    def laws(self) -> Laws:
        """What the command of this step is made of, a record for each control law from the outer to the inner: as many at every
        step, with the same names."""
        return ()

    @property
    def reports(self) -> Reports:
        """Records of this step for the spec's `reports`."""
        return {}

    def obey(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT for one of the spec's commands, and why it is refused."""

    def route(self) -> tuple[Vec3, ...]:
        """Places [m, NED] it flies by next, in their order, as far as is known now; none: it does not fly by any."""
        return ()

    def adopt(self, params: object) -> None:
        """Fly by changed parameters (of the spec's class) from this step on: keys marked IN_FLIGHT differ from those in force, no
        other. Raises ValueError for what cannot be flown, and nothing has changed."""
        raise ConfigError("none of this mission's parameters may be changed in flight")

    def exercise(self) -> None:
        """Run what the warm-up's level flight does not reach, on made-up readings; this object is of no further use then."""
        return

    def rehearse(self) -> None:
        """Go on as if the next half of the flight had begun: the warm-up runs that too."""
        return


Files = dict[str, tuple[Path, ...]]


def no_data(params: object) -> Files:
    """Of a mission whose parameters name no data files."""
    return {}


@dataclass(frozen=True)
class MissionSpec(Generic[A, P, Act]):
    """All that can be said of a mission without one.

    `params`: dataclass of the mission's tables in a flight file; `record`, `model`: class and model name of its aircraft;
    `phases`: WKF_PHASE it may be in, in the order of a flight; `orders`: the commands it takes and in which of them, any other is
    refused; `controls`: length of a command; `one_rate`: it runs at every base tick
    and at no other; `air_used`: AIR_* bits of health for the air-data readings it takes one by one, 0: whole probes;
    `sends_relative`: RELATIVE_STATE goes down; `files`: keys of the tables that name aircraft files, kept in run folders;
    `data`: of the parameters, the keys (dotted) that name other files, and which: kept likewise, the key then names the first.
    """

    name: str
    params: type[P]
    record: type[A]
    model: str
    build: Callable[[A, P, float], Mission[Act]]  # from the record, the parameters and the period [s]
    actuators: Callable[[A, int], Act]  # `delay_ticks` base ticks pass between a command and its reaching them
    phases: tuple[int, ...] = ()
    orders: tuple[Order, ...] = ()
    controls: int = 4
    one_rate: bool = False
    air_used: int = 0
    reports: tuple[Report, ...] = ()
    sends_relative: bool = False
    files: tuple[str, ...] = ()
    data: Callable[[P], Files] = no_data

    @property
    def commands(self) -> frozenset[int]:
        """MAV_CMD it takes."""
        return frozenset(o.command for o in self.orders)

    def load(self, aircraft: str) -> A:
        """Record of an aircraft this mission flies. Raises ConfigError."""
        return load_as(aircraft, self.record, self.model)


AnySpec = MissionSpec[Airframe, object, Actuators]


def find_mission(name: str, where: str) -> AnySpec:
    """The spec of the mission a flight file names: one that is declared, or `package.module:SPEC`. Raises ConfigError."""
    spec: AnySpec = plugins.part(plugins.MISSIONS, name, MissionSpec, f"{where}: app.mission")
    if spec.name != name and ":" not in name:
        raise ConfigError(f"{where}: app.mission = {name!r}: its spec calls itself {spec.name!r}")
    return spec
