"""Faults of what is no sensor: which parts an aircraft has, and what its engines still give."""

from __future__ import annotations

from collections.abc import Iterable

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.failures.script import ENGINE_KINDS, SURFACE_KINDS, Event

CLEARS = {  # kind of an event that ends faults -> those it ends
    "clear_engine": (*ENGINE_KINDS, "throttle_stuck"),
    "clear_fuel": ("leak",),
    "clear_radio": ("link_loss", "link_poor"),
}


def check_part(at: str, e: Event, m: Member) -> None:
    """Raise ConfigError for a surface, an engine or tanks the aircraft of event `e` has not; `at` names the event."""
    who = f"{e.target} (model = {m.cfg.model!r})"
    if e.kind in SURFACE_KINDS and e.surface not in m.kind.surfaces:
        raise ConfigError(f"{at}.surface = {e.surface!r}: {who} has {', '.join(m.kind.surfaces) or 'none'}")
    if e.kind in (*ENGINE_KINDS, "throttle_stuck") and not m.engines:
        raise ConfigError(f"{at}.kind = {e.kind!r}: {who} has no engine that can fail")
    if e.kind in ENGINE_KINDS and e.index >= m.engines:
        raise ConfigError(f"{at}.index = {e.index}: {who} has engines 0 to {m.engines - 1}, -1 = all")
    if e.kind == "leak" and m.tanks is None:
        raise ConfigError(f"{at}.kind = 'leak': {who} has no tanks: its mass is that of the file")


def power_of(engines: int, events: Iterable[Event]) -> list[float]:
    """Share of its thrust each engine gives under the events: losses of one engine multiply."""
    out = [1.0] * engines
    for e in events:
        if e.kind in ENGINE_KINDS:
            left = 0.0 if e.kind == "engine_off" else 1.0 - e.value[0]
            for i in range(engines) if e.index < 0 else (e.index,):
                out[i] *= left
    return out
