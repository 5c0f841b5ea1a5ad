"""`sil list`: what can be flown, with what, and what can be studied; one line each, read from the files themselves."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from flightsw.strict import ConfigError, near, to_dict
from ground.tree import by_name, flatten
from hil_scripts.campaign.registry import listed
from hil_scripts.launch.places import AIRCRAFT, PARAMS, PLANT_KEY, SCENARIOS

Rows = list[tuple[str, str]]
GIVEN = ("app.name", "app.sysid", "origin.")  # of a flight file: the scenario's to give


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
    return [(s.name, f"{s.title}: {s.purpose}") for s in listed().values()]


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
    """Key as `--set` has it -> value, defaults included, of the scenario and of every aircraft's onboard software. Raises
    ConfigError for a scenario that does not exist or cannot be flown, and where no key fits."""
    # slow to import, and of no use to the lists
    from flightsw.app import check
    from flightsw.process.config import flight_of
    from hil_scripts.launch.runfolder import resolve

    plan = resolve(scenario, None, [], None)
    out = flatten(by_name(plan.scenario), f"{PLANT_KEY}.")
    for f in plan.flights:
        cfg = flight_of(f.config, f.name)
        rates = cfg.app.base_rate_hz, cfg.app.mission_rate_hz
        found = check(cfg.app.mission, cfg.tables, *rates, f.name)
        own = f.config | to_dict(found.params) | {k: to_dict(getattr(found, k)) for k in ("health", "condition")}
        own = flatten(own, f"{f.name}.")
        out |= {k: v for k, v in own.items() if not k.startswith(tuple(f"{f.name}.{given}" for given in GIVEN))}
    fits = {k: v for k, v in out.items() if fnmatchcase(k, pattern)}
    if not fits:
        raise ConfigError(f"{pattern!r}: fits none of the {len(out)} keys of {scenario}")
    return fits


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
