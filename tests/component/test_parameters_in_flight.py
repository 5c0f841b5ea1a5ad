"""Every parameter that may be changed in flight, in every mission: what flies holds the new record and no longer the old one."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from flightsw.app import FlightApp
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.process.parameters import Parameter, parameters
from flightsw.types import SensorFrame, Setting
from hil_scripts.launch.places import PARAMS

FILES = ("tanker", "receiver", "receiver_rendezvous", "rendezvous", "gust", "windshear")


@pytest.fixture(scope="module", params=FILES)
def app(request: pytest.FixtureRequest) -> FlightApp:
    """The application of a mission's own flight file."""
    app = make_app(load_flight(PARAMS / f"{request.param}.toml"))
    assert isinstance(app, FlightApp)
    return app


def other(p: Parameter) -> float | int | bool | str:
    """A value near the one in force, allowed and different."""
    if p.kind is float:
        near = p.value * 1.01 if p.value else 0.01 * (p.hi or 1.0)
        return min(max(near, p.lo), p.hi) if p.lo <= near <= p.hi else 0.99 * p.value
    return p.plain(p.value + 1.0 if p.value < p.hi else p.value - 1.0)


def reached(root: object) -> dict[int, object]:
    """Everything of this project's that hangs on an object."""
    out: dict[int, object] = {}
    todo = [root]
    while todo:
        x = todo.pop()
        if id(x) in out or isinstance(x, (str, bytes, int, float, np.ndarray, type)) or callable(x):
            continue
        out[id(x)] = x
        if isinstance(x, dict):
            todo += x.values()
        elif isinstance(x, (list, tuple, set, frozenset)):
            todo += x
        elif type(x).__module__.startswith("flightsw"):
            todo += getattr(x, "__dict__", {}).values()
            todo += [getattr(x, n) for c in type(x).__mro__ for n in getattr(c, "__slots__", ()) if hasattr(x, n)]
    return out


def holder(record: Any, path: list[str]) -> object:
    """The record a key stands in."""
    for part in path[:-1]:
        record = getattr(record, part)
    return record


def test_every_settable_key_is_taken_up_by_what_flies(app: FlightApp) -> None:
    free = [p for p in parameters(app.records) if p.in_flight]
    assert len(free) > 10
    taken = refused = 0
    for p in free:
        where = dict(app.records)
        table, _, rest = p.key.partition(".")
        record, path = (
            (where[table], rest.split(".")) if table in ("health", "condition") else (where[""], p.key.split("."))
        )
        old = holder(record, path)
        value = other(p)
        f = SensorFrame(t_us=10_000 * (app.tick_no + 1), settings=[Setting(p.key, value)])
        _, snap = app.tick(f, 0.01)
        [done] = snap.settled
        if done.why:  # a limit of what this mission does not depend on
            assert "does not depend on" in done.why or "nothing obeys it" in done.why, done
            refused += 1
            continue
        taken += 1
        now = dict(app.records)[table if table in ("health", "condition") else ""]
        assert getattr(holder(now, path), path[-1]) == value
        held = [x for x in reached(app).values() if x is old and dataclasses.is_dataclass(x)]
        assert not held, f"{p.key}: something still holds {type(old).__name__} as it was"
    assert taken >= 8 and refused <= 8


def test_what_cannot_be_flown_is_refused_and_changes_nothing() -> None:
    """The bounds of the key allow it, the aircraft or the rest of the record does not."""
    app = make_app(load_flight(PARAMS / "windshear.toml"))
    assert isinstance(app, FlightApp)
    before = app.params
    for key, value, why in (
        ("guid.escape.protect_mps", 41.0, "guid.escape.protect_mps = 41: allowed for"),
        ("guid.escape.again_F", -0.4, "again_F = -0.4; allowed: hold_F = 0.05 or more"),
        ("guid.nothing", 1.0, "nothing"),
    ):
        _, snap = app.tick(SensorFrame(t_us=20_000 * (app.tick_no + 1), settings=[Setting(key, value)]), 0.02)
        assert why in snap.settled[0].why and app.params is before
    gain = app.mission.ctrl._g[0]  # the vector the kernel reads
    app.tick(SensorFrame(t_us=20_000 * (app.tick_no + 1), settings=[Setting("ctrl.k_path_1ps", 2.0 * gain)]), 0.02)
    assert app.mission.ctrl._g[0] == 2.0 * gain
