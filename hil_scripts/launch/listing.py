"""`sil list`: what can be flown, with what, and what can be studied; one line each, read from the files themselves."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from flightsw.aircraft.base import HERE as AIRCRAFT
from flightsw.strict import ConfigError, near
from ground.happenings import by_name
from ground.whole import flatten
from hil_scripts.launch.runfolder import PARAMS, PLANT_KEY, SCENARIOS, resolve

Rows = list[tuple[str, str]]


def about(path: Path) -> str:
    """First sentence of the comment a file begins with."""
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    text = first.removeprefix("#").strip() if first.startswith("#") else ""
    return text.partition(". ")[0].removesuffix(".")


def _files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.toml"))


def scenarios() -> Rows:
    """Scenarios of `sil run` and their purpose."""
    metas = [tomllib.loads(p.read_text(encoding="utf-8")).get("meta", {}) for p in _files(SCENARIOS)]
    return [(p.stem, str(m.get("purpose", ""))) for p, m in zip(_files(SCENARIOS), metas, strict=True)]


def missions() -> Rows:
    """Flight files: what the `mission` of an aircraft in a scenario names."""
    return [(p.stem, about(p)) for p in _files(PARAMS)]


def aircraft() -> Rows:
    """Aircraft records."""
    return [(p.stem, about(p)) for p in _files(AIRCRAFT)]


def campaigns() -> Rows:
    """Studies of `sil campaign`."""
    from hil_scripts.campaign.registry import all_studies  # slow: imports every study

    return [(s.name, f"{s.title}: {s.purpose}") for s in all_studies().values()]


KINDS: dict[str, tuple[str, Callable[[], Rows]]] = {
    "scenarios": ("sil run NAME", scenarios),
    "missions": ("mission = NAME of an aircraft in a scenario", missions),
    "aircraft": ("file = NAME in a scenario, app.aircraft = NAME in a flight file", aircraft),
    "campaigns": ("sil campaign NAME", campaigns),
}


def _wanted(kinds: Iterable[str]) -> list[str]:
    """The named kinds, all if none is. Raises ConfigError for one that does not exist."""
    wanted = list(kinds) or list(KINDS)
    for kind in wanted:
        if kind not in KINDS:
            raise ConfigError(f"{kind!r}: allowed: {', '.join(KINDS)}{near(kind, KINDS)}")
    return wanted


def as_dict(kinds: Iterable[str]) -> dict[str, dict[str, str]]:
    """Kind -> name -> a line about it. Raises ConfigError."""
    return {kind: dict(KINDS[kind][1]()) for kind in _wanted(kinds)}


def keys(scenario: str, pattern: str = "*") -> dict[str, Any]:
    """Key as `--set` has it -> value, of the scenario and of every aircraft's onboard software. Raises ConfigError for a scenario
    that does not exist or cannot be flown, and where no key fits."""
    plan = resolve(scenario, None, [], None)
    out = flatten(by_name(plan.scenario), f"{PLANT_KEY}.")
    for f in plan.flights:
        out |= flatten({k: v for k, v in f.config.items() if k != "origin"}, f"{f.name}.")
    found = {k: v for k, v in out.items() if fnmatchcase(k, pattern)}
    if not found:
        raise ConfigError(f"{pattern!r}: fits none of the {len(out)} keys of {scenario}")
    return found


def show(console: Console, kinds: Iterable[str]) -> None:
    """Tables of the named kinds, of all if none is named. Raises ConfigError for a kind that does not exist."""
    for kind in _wanted(kinds):
        use, rows = KINDS[kind]
        t = Table(title=f"{kind}: {use}", title_justify="left", title_style="bold", box=None, pad_edge=False)
        t.add_column(no_wrap=True)
        t.add_column(overflow="fold")
        t.show_header = False
        for row in rows():
            t.add_row(*row)
        console.print(t)
        console.print()
