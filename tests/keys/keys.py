"""Every key that `sil run --set` takes: where it is, what it is at, and other values it may be given."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from flightsw.condition import ConditionParams
from flightsw.health import HealthParams
from flightsw.missions.base import find_mission
from flightsw.process.config import flight_of
from flightsw.strict import Names, Range, convert, hints
from hil_scripts.launch.runfolder import RunPlan
from sim_plant.aircraft.kind import kind_of
from sim_plant.scenario import Scenario

GIVEN = ("app.name", "app.sysid", "origin.")  # of a flight file: the scenario's to give, refused by the launcher


@dataclass(frozen=True)
class Key:
    """`name`: as after --set, owner included; `cls`.`field`: the record that holds it."""

    name: str
    value: Any
    cls: type
    field: str
    kind: Any  # its type, with Range and OneOf

    @property
    def place(self) -> str:
        """Record and field: the same for the same key of several aircraft."""
        return f"{self.cls.__name__}.{self.field}"


def _bare(kind: Any) -> tuple[Any, list[Any]]:
    """Type without Annotated and Optional, and what was annotated."""
    notes: list[Any] = []
    while True:
        if get_origin(kind) is Annotated:
            kind, *more = get_args(kind)
            notes += more
        elif type(None) in get_args(kind):
            kind = next(a for a in get_args(kind) if a is not type(None))
        else:
            return kind, notes


def leaves(at: str, value: Any, skip: tuple[str, ...] = ()) -> Iterator[Key]:
    """Keys of a record, tables and lists of tables in it included; not those below the paths `skip`."""
    cls = type(value)
    types_of = hints(cls)
    for f in dataclasses.fields(cls):
        path, v = f"{at}.{f.name}", getattr(value, f.name)
        if path in skip or not f.init:
            continue
        if dataclasses.is_dataclass(v):
            yield from leaves(path, v, skip)
        elif isinstance(v, tuple) and v and dataclasses.is_dataclass(v[0]):
            for i, x in enumerate(v):
                yield from leaves(f"{path}.{i}", x, skip)
        else:
            yield Key(path, v, cls, f.name, types_of[f.name])


def plant_keys(sc: Scenario) -> Iterator[Key]:
    """Keys with owner `plant`."""
    own = tuple(f"plant.aircraft.{i}.plant" for i in range(len(sc.aircraft)))
    yield from leaves("plant", sc, (*own, "plant.sensors", "plant.expect"))
    for i, a in enumerate(sc.aircraft):
        table = convert(a.plant, kind_of(a).table(), a.name)
        yield from leaves(f"plant.aircraft.{i}.plant", table)
        yield from leaves(f"plant.sensors.{a.name}", sc.suite(a.name))


def onboard_keys(name: str, config: dict[str, Any]) -> Iterator[Key]:
    """Keys with an aircraft's name as owner; config: its flight file as resolved."""
    cfg = flight_of(config, name)
    skip = (f"{name}.tables",)
    for k in leaves(name, cfg, skip):
        if not k.name.removeprefix(f"{name}.").startswith(GIVEN):
            yield k
    own = dict(cfg.tables)
    yield from leaves(f"{name}.health", convert(own.pop("health", {}), HealthParams, name))
    yield from leaves(f"{name}.condition", convert(own.pop("condition", {}), ConditionParams, name))
    yield from leaves(name, convert(own, find_mission(cfg.app.mission, name).params, name))


def all_keys(plan: RunPlan) -> list[Key]:
    """Keys of a run."""
    out = list(plant_keys(convert(plan.scenario, Scenario, plan.scenario_name)))
    for f in plan.flights:
        out += onboard_keys(f.name, f.config)
    return out


def toml(v: Any) -> str:
    """A value as TOML text."""
    if isinstance(v, dict):
        return "{" + ", ".join(f"{k} = {toml(x)}" for k, x in v.items()) + "}"
    if isinstance(v, (list, tuple)):
        return "[" + ", ".join(toml(x) for x in v) + "]"
    return repr(v) if isinstance(v, float) else json.dumps(v)


def others(k: Key) -> list[Any]:
    """Other values the key may be given, the likeliest to show first."""
    kind, notes = _bare(k.kind)
    for n in notes:
        if isinstance(n, Names):
            return [x for x in n.allowed if x != k.value]
    spans = [n for n in notes if isinstance(n, Range)]
    lo, hi = max((s.lo for s in spans), default=-math.inf), min((s.hi for s in spans), default=math.inf)
    if kind is bool:
        return [not k.value]
    if kind in (int, float):
        return [x for x in _numbers(k.value, lo, hi, kind) if lo <= x <= hi and x != k.value]
    if get_origin(kind) is tuple and k.value and isinstance(_flat(k.value)[0], float):
        tries = [_scaled(k.value, c) for c in (0.8, 1.25, 0.5)]
        if not any(_flat(k.value)):
            tries = [_shifted(k.value, d) for d in (0.5, -0.5)]
        return [t for t in tries if all(lo <= x <= hi for x in _flat(t)) and t != k.value]
    return []


def _numbers(v: float | None, lo: float, hi: float, kind: Any) -> list[Any]:
    if v is None:
        v = lo + 0.4 * (hi - lo) if math.isfinite(lo + hi) else max(lo, 1.0) * 2.0
        return [kind(v)]
    if kind is int:
        return [v + 1, v - 1, 2 * v, v + 7, v // 2, lo if math.isfinite(lo) else 0]
    tries = [v * 1.3, v * 0.7, v * 3.0, v * 0.2] if v else [0.1, -0.1, 1.0, 30.0]
    return [*tries, *(e for e in (0.5 * (lo + hi), lo, hi) if math.isfinite(e))]


def _flat(v: Any) -> list[Any]:
    return [y for x in v for y in _flat(x)] if isinstance(v, tuple) else [v]


def _scaled(v: Any, c: float) -> Any:
    return tuple(_scaled(x, c) for x in v) if isinstance(v, tuple) else v * c if isinstance(v, float) else v


def _shifted(v: Any, d: float) -> Any:
    return tuple(_shifted(x, d) for x in v) if isinstance(v, tuple) else v + d if isinstance(v, float) else v
