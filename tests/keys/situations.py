"""Where a key shows: the flights in which keys are tried, and for those that need something special, what it is.

A key is tried in the first situation of its context whose `keys` match its name after the owner, else in the context's plain
flight.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from tests.keys.keys import Key


@dataclass(frozen=True)
class Situation:
    """`keys`: pattern of key names (owner left out, indices and aircraft names too). `sets`: as after --set."""

    why: str
    keys: str
    sets: tuple[str, ...] = ()
    duration_s: float = 2.0


@dataclass(frozen=True)
class Context:
    """A scenario and the owners whose keys are tried in it; `only`: pattern the keys must match."""

    scenario: str
    owners: tuple[str, ...]
    situations: tuple[Situation, ...] = ()
    only: str = ""
    sets: tuple[str, ...] = ()
    duration_s: float = 2.0


def short(k: Key) -> str:
    """Name of a key without its owner, and without the index or name of the aircraft."""
    name = k.name.partition(".")[2]
    return re.sub(r"^(aircraft\.\d+|sensors\.\w+)\.", lambda m: m.group(1).split(".")[0] + ".", name)


def of(c: Context, k: Key) -> tuple[tuple[str, ...], float]:
    """Sets and duration with which a key of a context is tried."""
    for s in c.situations:
        if re.fullmatch(s.keys, short(k)):
            return (*c.sets, *s.sets), s.duration_s
    return c.sets, c.duration_s


def event(**fields: Any) -> str:
    """One entry of plant.event."""
    return "{" + ", ".join(f"{k} = {v!r}".replace("'", '"') for k, v in fields.items()) + "}"


def events(*entries: str) -> str:
    """The scenario's events, replaced."""
    return f"plant.event=[{', '.join(entries)}]"
