"""The matrix out of faults.toml: every case with its place in the picture and the plant's events that make it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from flightsw.strict import read_toml
from hil_scripts.campaign.study import Case
from sim_plant.failures.script import Event

FILE = Path(__file__).with_name("faults.toml")
# closing begins when pre-contact has been watched, and the turn when the straight leg has: every moment lies within 355 s
SETTINGS = ("plant.event.1.t_s=240.0", "tanker.guid.first_leg_s=325.0")
SIZED = ("bias", "drift", "scale", "spike", "garbage", "iced")
FIELDS = ("target", "kind", "sensor", "surface", "index", "channel", "value", "samples", "for_s")


@dataclass(frozen=True)
class Moment:
    """A state of the flying system faults are put into. t_s [s]; limit_m: largest distance from the station that is safe [m];
    phase: the receiver's, by its word in WKF_PHASE; station_m [3]: where it is held, in the tanker's axes; only: sensors whose
    faults are flown there, () for all; settings: of the scenario, in the file those beside SETTINGS."""

    scenario: str
    t_s: float
    limit_m: float
    phase: str
    station_m: tuple[float, float, float]
    only: tuple[str, ...] = ()
    settings: tuple[str, ...] = SETTINGS


@dataclass(frozen=True)
class Fault:
    """A row of the picture (group, row), a place in the row (size: its words, rank: 0, 1 ... from small to large), the events."""

    group: str
    row: str
    size: str
    rank: int
    events: tuple[Event, ...] = field(default=())


def _moments(data: dict[str, Any]) -> dict[str, Moment]:
    out = {}
    for name, t in data["moment"].items():
        more = {k: tuple(t[k]) for k in ("station_m", "only") if k in t}
        out[name] = Moment(**{**t, **more, "settings": (*SETTINGS, *t.get("settings", ()))})
    return out


def _sensor(target: str, sensor: str, t: dict[str, Any]) -> Iterator[Fault]:
    def one(kind: str, part: str, size: str, rank: int, **more: Any) -> Fault:
        event = Event(0.0, kind, target, sensor=sensor, **more)
        return Fault(f"{target} {sensor}", " ".join(x for x in (part, kind) if x), size, rank, (event,))

    for kind in t.get("whole", ()):
        yield one(kind, "", "whole", 0)
    for rank, n in enumerate(t.get("delayed", ())):
        yield one("delayed", "", f"{n} samples", rank, samples=n)
    for rank, offset in enumerate(t.get("stamp", ())):
        yield one("stamp", "", f"{offset:+g} s", rank, value=(offset,))
    for rank, share in enumerate(t.get("intermittent", ())):
        yield one("intermittent", "", f"{share:g} lost", rank, value=(share,))
    for name, column in t.items():
        if not isinstance(column, dict):
            continue
        place = {k: column[k] for k in ("index", "channel") if k in column}
        for kind in (k for k in SIZED if k in column):
            for rank, x in enumerate(column[kind]):
                row: tuple[float, ...] = (x,)
                if "at" in column:
                    neutral = 1.0 if kind == "scale" else 0.0
                    row = tuple(x if i == column["at"] else neutral for i in range(t["width"]))
                yield one(kind, name, f"{x:g}", rank, value=row, **place)


def _event(t: dict[str, Any]) -> Event:
    more: dict[str, Any] = {k: tuple(t[k]) if k == "value" else t[k] for k in FIELDS if k in t}
    return Event(0.0, **more)


def _pairs(t: dict[str, Any]) -> Iterator[Fault]:
    for other in t["second"]:
        for rank, first in enumerate(t["first"]):
            yield Fault("pair rel", f"and {other['name']}", first["name"], rank, (_event(first), _event(other)))


def _parts(t: dict[str, Any]) -> Iterator[Fault]:
    """Surfaces, engines, links. of: the key of Event that `names` go to; value, for_s: one case each."""
    sizes = [("for_s", x, f"{x:g} s" if x else "for good") for x in t.get("for_s", ())]
    sizes += [("value", (x,), f"{x:g}") for x in t.get("value", ())]
    for target in t["targets"]:
        for name in t.get("names", ("",)):
            place = {t["of"]: name} if "of" in t else {}
            called = ("all" if name < 0 else f"no {name + 1}") if isinstance(name, int) else name
            for rank, (key, x, words) in enumerate(sizes or [("for_s", 0.0, "for good")]):
                event = Event(0.0, t["kind"], target, **place, **{key: x})
                row = " ".join(w for w in (called, t["kind"].replace("_", " ")) if w)
                yield Fault(f"{target} {t['row']}", row, words, rank, (event,))


def faults(data: dict[str, Any]) -> list[Fault]:
    """All of them, in the order of the file."""
    out = [f for who, ts in data["sensor"].items() for name, t in ts.items() for f in _sensor(who, name, t)]
    out += _pairs(data["pair"])
    return out + [f for t in data["part"] for f in _parts(t)]


def _wanted(m: Moment, f: Fault) -> bool:
    return not m.only or any(word in f.group.split() for word in m.only)


def _plain(event: Event) -> dict[str, Any]:
    """What of an event is not its default, as plain JSON."""
    here = ((f, getattr(event, f.name)) for f in fields(event) if f.name in FIELDS)
    return {f.name: list(v) if isinstance(v, tuple) else v for f, v in here if v != f.default}


def cases(data: dict[str, Any]) -> tuple[Case, ...]:
    """A case for every fault at every moment it is flown at."""
    out = []
    for name, m in _moments(data).items():
        for f in faults(data):
            if _wanted(m, f):
                words = "_".join((name, f.group, f.row, f.size))
                key = re.sub(r"[^A-Za-z0-9_+-]+", "-", words.replace(".", "p"))
                place = {"moment": name, "group": f.group, "row": f.row, "size": f.size, "rank": f.rank}
                out.append(Case(key, place | {"events": [_plain(e) for e in f.events]}))
    return tuple(out)


DATA = read_toml(FILE)
MOMENTS = _moments(DATA)


def event_of(t: dict[str, Any]) -> Event:
    """The event of a case's parameters."""
    return _event(t)
