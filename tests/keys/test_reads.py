"""Every field of every configuration record is read by something: no key that a file may set is left lying."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pytest

from flightsw import plugins
from flightsw.aircraft import record_types
from flightsw.health import HealthParams
from flightsw.missions.base import MissionSpec
from flightsw.process.config import FlightConfig, flight_of
from flightsw.process.node import Node
from flightsw.strict import convert
from hil_scripts.launch.runfolder import resolve
from sim_plant.aircraft.kind import Kind
from sim_plant.scenario import Scenario
from sim_plant.server import PlantServer
from tests.keys.reads import Reads, records

ROOT = Path(__file__).resolve().parent.parent.parent
SCENARIOS = ("refueling", "airdata", "rendezvous", "joinup", "gust", "windshear")
TICKS = 75  # past the first valid navigation of all but the longest start-up
MISSIONS = plugins.parts(plugins.MISSIONS, MissionSpec).values()
ROOTS = (
    Scenario, FlightConfig, HealthParams, *record_types().values(), *(m.params for m in MISSIONS),
    *(k.table() for k in plugins.parts(plugins.AIRCRAFT, Kind).values()),
)  # fmt: skip
WHOLE = {"Aero": "taken whole, in the order of its fields, by the parameter vectors of both sides"}
# read by nobody, each for a reason
UNREAD = {
    "Meta.purpose": "a line for people, kept in scenario.toml",
    "Meta.name": "a name for people, kept in scenario.toml",
    "Scenario.expect": "read by the launcher as a plain table (hil_scripts.launch.verdict)",
    "AircraftCfg.mission": "read by the launcher as a plain table (hil_scripts.launch.runfolder)",
}


def all_records() -> set[type]:
    found: set[type] = set()
    for root in ROOTS:
        records(root, found)
    return found


@pytest.fixture(scope="module")
def reads() -> Reads:
    """What short flights of every scenario read of every record."""
    watch = Reads(all_records())
    with watch.watching():
        for name in SCENARIOS:
            plan = resolve(name, None, [], 5.0)
            server = PlantServer(convert(plan.scenario, Scenario, name), plan.seed)
            nodes = [Node(flight_of(f.config, f.name)) for f in plan.flights]
            for _ in range(TICKS):
                replies = [node.step((d,)) for node, d in zip(nodes, server.begin_tick(), strict=True)]
                server.end_tick(replies)
                for node in nodes:
                    node.after()
                    node.take_heard()
    return watch


@lru_cache(maxsize=1)
def sources() -> tuple[tuple[set[str], set[str]], ...]:
    """Of every source file of the programs: the names it mentions, and the attributes it reads, alone and with what they are read
    of ("clock.mode"); what records check of themselves is left out."""
    out = []
    for top in ("flightsw", "sim_plant", "hil_scripts", "ground"):
        for path in sorted((ROOT / top).rglob("*.py")):
            tree = ast.parse(path.read_text())
            out.append(
                ({n.id for n in ast.walk(tree) if isinstance(n, ast.Name)} | set(_bound(tree)), set(_read(tree)))
            )
    return tuple(out)


def _bound(tree: ast.AST) -> Iterator[str]:
    for n in ast.walk(tree):
        if isinstance(n, ast.ClassDef):
            yield n.name
        elif isinstance(n, ast.ImportFrom):
            yield from (a.name for a in n.names)
        elif isinstance(n, ast.Constant) and isinstance(n.value, str) and n.value.isidentifier():
            yield n.value  # an annotation in quotes


def _read(tree: ast.AST) -> Iterator[str]:
    for n in ast.iter_child_nodes(tree):
        if isinstance(n, ast.FunctionDef) and n.name == "__post_init__":
            continue
        if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Load):
            yield n.attr
            if isinstance(n.value, (ast.Attribute, ast.Name)):
                yield f"{n.value.attr if isinstance(n.value, ast.Attribute) else n.value.id}.{n.attr}"
        yield from _read(n)


def read_in_source(holders: set[str], field: str, places: set[str]) -> bool:
    """Whether a file that mentions the record, or one that holds it, also reads an attribute of the field's name; or any file
    does of an attribute that holds the record."""
    return any(
        (holders & names and field in attributes) or any(f"{p}.{field}" in attributes for p in places)
        for names, attributes in sources()
    )


def test_every_field_of_every_record_is_read(reads: Reads) -> None:
    """Read in flight, or (what only a later phase or another choice reads) in the source of those who are given the record."""
    late = []
    for cls, field in reads.unread():
        name = f"{cls.__name__}.{field}"
        if (
            cls.__name__ not in WHOLE
            and name not in UNREAD
            and not read_in_source(reads.holders(cls), field, reads.places(cls))
        ):
            late.append(name)
    assert not late, f"nothing reads {', '.join(late)}"
    gone = sorted(set(UNREAD) - {f"{cls.__name__}.{field}" for cls, field in reads.unread()})
    assert not gone, f"excused, and read or not there: {', '.join(gone)}"


def test_most_fields_are_read_in_the_first_seconds(reads: Reads) -> None:
    """The recording works: what is not read soon is a small part, tables that are switched off apart."""
    unread = set(reads.unread())
    off = {
        c
        for c in reads.classes
        if "on" in c.__dataclass_fields__ and all((c, k) in unread for k in c.__dataclass_fields__ if k != "on")
    }
    total = sum(len(c.__dataclass_fields__) for c in reads.classes if c not in off)
    assert total > 800 and sum(c not in off for c, _ in unread) < 0.25 * total


@dataclass(frozen=True)
class Knobs:
    """One alive, one only checked by itself, one dead."""

    alive: float = 1.0
    checked: float = 1.0
    dead: float = 1.0

    def __post_init__(self) -> None:
        assert self.checked > 0.0


def test_a_dead_knob_is_seen() -> None:
    watch = Reads({Knobs})
    with watch.watching():
        k = convert({"alive": 2.0}, Knobs, "test")
        assert k == Knobs(2.0) and k.alive == 2.0
    assert watch.unread() == [(Knobs, "checked"), (Knobs, "dead")]
    assert not read_in_source(watch.holders(Knobs), "dead", set())
    assert read_in_source({"RacetrackParams"}, "leg_s", set()) and read_in_source(set(), "mode", {"clock"})
    assert Knobs().dead == 1.0 and len(watch.seen) == 1  # not recorded any longer
