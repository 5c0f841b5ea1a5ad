"""A kind of aircraft the plant can fly: what a scenario may ask of it, and how one is built.

Kinds are found by the entry points `wakefield.aircraft`, or named in the scenario as `package.module:KIND`. To add one: a
subclass of Member (base.py), a Kind whose `build` makes it, and its record type (`wakefield.records`), from any package.
A module that holds a Kind imports what is slow (the compiler) only within `build` and `table`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from flightsw.aircraft import Airframe
from flightsw.plugins import AIRCRAFT, part, parts
from flightsw.strict import ConfigError, convert
from sim_plant.aircraft.mismatch import MISMATCHES

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member
    from sim_plant.flown import Flown, Scene
    from sim_plant.scenario import AircraftCfg, Scenario

SURFACES = ("aileron", "elevator", "rudder")  # in the order of the state vector
OWN = (
    "imu",
    "baro",
    "mag",
    "gnss",
    "att",
    "fuel",
    "radalt",
)  # sensor groups of an aircraft by itself, besides air-data probes
OPTIONS = (
    "fuel_kg",
    "aero_error_frac",
    "airframe",
    "upset",
)  # keys of [[aircraft]] (upset: of its start) not every kind obeys
R = TypeVar("R", bound=Airframe)
T = TypeVar("T")


@dataclass(frozen=True)
class NoTable:
    """[aircraft.plant] of a kind that has none."""


def no_table() -> type:
    """`table` of such a kind."""
    return NoTable


def by_itself(scene: Scene) -> Flown | None:
    """`together` of a kind whose members are flown one by one."""
    return None


@dataclass(frozen=True)
class Setup:
    """What one member of a world is built from: its entry of the scenario, its record, the scenario and the run's seed."""

    kind: Kind
    cfg: AircraftCfg
    ac: Airframe
    sc: Scenario
    seed: int

    def record(self, cls: type[R]) -> R:
        """The record as the type its kind flies by. Raises ConfigError for another one."""
        if not isinstance(self.ac, cls):
            raise ConfigError(
                f"aircraft.{self.cfg.name}.file = {self.cfg.file!r}: a record {type(self.ac).__name__}; allowed: {cls.__name__}"
            )
        return self.ac

    def table(self, cls: type[T]) -> T:
        """[aircraft.plant] as the dataclass of the kind. Raises ConfigError naming the key."""
        return convert(self.cfg.plant, cls, f"aircraft.{self.cfg.name}.plant")


@dataclass(frozen=True)
class Kind:
    """`record`: type of the aircraft files it flies. `build` makes a member, not yet started; `table` gives the dataclass of
    [aircraft.plant]. `carries`: sensors, of OWN; `surfaces`: those that can jam, of SURFACES; `takes`: of OPTIONS;
    `mismatch`: keys of [aircraft.mismatch] it obeys.
    `formation`: flies with others: started relative to one, in the leader's gusts and wake, at its boom, tuned to its TACAN.
    `round_earth`: flies over any earth (earth/model.py), not only the flat one. `any_density`: in air of any temperature.
    `together`: what flies a whole world of this kind at once, to the same bit as one by one; None: this world it cannot.
    """

    record: type[Airframe]
    build: Callable[[Setup], Member]
    table: Callable[[], type] = no_table
    carries: tuple[str, ...] = ("imu", "baro", "gnss", "att")
    surfaces: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    mismatch: tuple[str, ...] = ()
    formation: bool = False
    round_earth: bool = False
    any_density: bool = False
    together: Callable[[Scene], Flown | None] = by_itself

    def __post_init__(self) -> None:
        """Raises ConfigError for a name that is none of those."""
        for key, names, known in (
            ("carries", self.carries, OWN), ("surfaces", self.surfaces, SURFACES), ("takes", self.takes, OPTIONS),
            ("mismatch", self.mismatch, MISMATCHES),
        ):  # fmt: skip
            for name in names:
                if name not in known:
                    raise ConfigError(f"kind of {self.record.__name__}: {key}: {name!r}: allowed: {', '.join(known)}")

    def check(self, cfg: AircraftCfg) -> None:
        """Raise ConfigError naming the key if the table of an aircraft is not one of this kind."""
        convert(cfg.plant, self.table(), f"aircraft.{cfg.name}.plant")

    def check_has_table(self, cfg: AircraftCfg) -> None:
        """Raise ConfigError if the aircraft has a table and this kind none."""
        if cfg.plant and self.table is no_table:
            raise ConfigError(f"aircraft.{cfg.name}.plant: model = {cfg.model!r} has none; allowed: none")


def kind_of(cfg: AircraftCfg) -> Kind:
    """The kind a scenario's aircraft is of. Raises ConfigError naming its model and what is allowed."""
    return part(AIRCRAFT, cfg.model, Kind, f"aircraft.{cfg.name}.model")


def formation_models() -> str:
    """Names of the models that fly with others, for an error text."""
    return " or ".join(repr(name) for name, k in parts(AIRCRAFT, Kind).items() if k.formation)
