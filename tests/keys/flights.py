"""Short flights whose every byte is compared: does a key change anything, or is it refused by name?"""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from flightsw.missions.receiver.station_keeping import ReceiverControl
from flightsw.process.config import flight_of
from flightsw.process.node import Node
from flightsw.sixdof.autopilot import TankerControl
from flightsw.sixdof.lqr import DesignError
from flightsw.sixdof.trim import TrimError
from flightsw.strict import ConfigError, convert
from hil_scripts.launch.runfolder import RunPlan, resolve
from sim_plant.scenario import Scenario
from sim_plant.server import PlantServer
from sim_plant.world import AircraftLostError
from tests.keys.keys import Key, others, toml


class _Sink:
    """Takes what would go to truth.tlog."""

    def __init__(self) -> None:
        self.data: list[bytes] = []

    def write(self, t_us: int, packet: bytes) -> None:
        self.data.append(packet)

    def close(self) -> None:
        """Nothing to close."""


def flight(plan: RunPlan) -> Iterator[bytes]:
    """Digest of every tick of a run: plant datagrams, replies, telemetry, truth. The last one says how it ended."""
    server = PlantServer(convert(plan.scenario, Scenario, "scenario"), plan.seed)
    server._log = sink = _Sink()  # type: ignore[assignment]
    nodes = [Node(flight_of(f.config, f.name)) for f in plan.flights]
    try:
        while not server.done:
            h = hashlib.blake2b(digest_size=12)
            out = server.begin_tick()
            replies = [node.step((d,)) for node, d in zip(nodes, out, strict=True)]
            server.end_tick(replies)
            for node in nodes:
                node.take_heard()
                h.update(b"".join(node.after()))
            h.update(b"".join([*out, *replies, *sink.data]))
            sink.data.clear()
            yield h.digest()
    except AircraftLostError as e:
        yield str(e).encode()


@contextmanager
def designs_kept(kept: dict[Any, Any] | None = None) -> Iterator[None]:
    """Control designs are made once per set of parameters, not once per flight; kept: of others, to go on with."""
    kept = {} if kept is None else kept

    def keeping(cls: type, design: Callable[..., Any]) -> Callable[..., Any]:
        def again(self: Any, *args: Any) -> Any:
            key = (cls, self.p.schedule, *(v for k, v in sorted(vars(self.p).items()) if k != "schedule"), *args)
            if key not in kept:
                kept[key] = design(self, *args)
            return kept[key]

        return again

    before = [(cls, cls._design) for cls in (TankerControl, ReceiverControl)]
    for cls, design in before:
        cls._design = keeping(cls, design)  # type: ignore[method-assign]
    try:
        yield
    finally:
        for cls, design in before:
            cls._design = design  # type: ignore[method-assign]


@lru_cache(maxsize=64)
def baseline(scenario: str, sets: tuple[str, ...], duration_s: float) -> tuple[RunPlan, tuple[bytes, ...]]:
    """The flight without the change."""
    plan = resolve(scenario, None, list(sets), duration_s)
    return plan, tuple(flight(plan))


def acts(scenario: str, sets: tuple[str, ...], duration_s: float, change: tuple[str, ...], leaf: str) -> str:
    """What `change` (texts as after --set) does to the flight: "tick n", "refused", or "" if nothing. A refusal counts only if it
    names `leaf`; another one is raised."""
    _, base = baseline(scenario, sets, duration_s)
    try:
        plan = resolve(scenario, None, [*sets, *change], duration_s)
        n = 0
        for n, (a, b) in enumerate(zip(flight(plan), base, strict=False), 1):
            if a != b:
                return f"tick {n}"
        return "" if n == len(base) else f"tick {n}: another length"
    except ConfigError as e:
        value = change[-1].partition("=")[2].strip('"[]{}')
        if leaf not in str(e) and not (value[:1].isalpha() and value in str(e)):
            raise
        return "refused"
    except (DesignError, TrimError, ValueError):
        return "no flight"
    finally:
        gc.collect(0)


def try_key(k: Key, scenario: str, sets: tuple[str, ...], duration_s: float, values: tuple[Any, ...] = ()) -> str:
    """The first answer of `acts` other than "" over the values a key may be given."""
    why = ""
    for v in values or others(k)[:4]:
        try:
            got = acts(scenario, sets, duration_s, (f"{k.name}={toml(v)}",), k.field)
        except ConfigError as e:
            why = f"?{e}"
            continue
        if got:
            return got
    return why
