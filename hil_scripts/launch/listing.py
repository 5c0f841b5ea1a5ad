"""`sil list`: what can be flown, with what, and what can be studied; one line each, read from the files themselves."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from flightsw.aircraft.base import HERE as AIRCRAFT
from flightsw.strict import ConfigError, near
from hil_scripts.launch.runfolder import PARAMS, SCENARIOS

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


def show(console: Console, kinds: Iterable[str]) -> None:
    """Tables of the named kinds, of all if none is named. Raises ConfigError for a kind that does not exist."""
    wanted = list(kinds) or list(KINDS)
    for kind in wanted:
        if kind not in KINDS:
            raise ConfigError(f"{kind!r}: allowed: {', '.join(KINDS)}{near(kind, KINDS)}")
    for kind in wanted:
        use, rows = KINDS[kind]
        t = Table(title=f"{kind}: {use}", title_justify="left", title_style="bold", box=None, pad_edge=False)
        t.add_column(no_wrap=True)
        t.add_column(overflow="fold")
        t.show_header = False
        for row in rows():
            t.add_row(*row)
        console.print(t)
        console.print()
