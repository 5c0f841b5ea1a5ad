"""Docs, docstrings and comments name files, folders and functions that exist."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
TOPS = ("", "flightsw/", "sim_plant/", "ground/", "hil_scripts/")
FILE = re.compile(r"`((?:[\w-]+/)*[\w.-]+\.(?:py|toml|xml))`((?:, `(?![\w.]+\.py`)[A-Za-z_][\w.]*`)*)")
FOLDER = re.compile(r"`((?:flightsw|sim_plant|ground|hil_scripts|tests|docs|missions)(?:/[\w.-]+)+)/?`")
IN_CODE = re.compile(r"(?<![\w/.*])((?:[a-z_]+/)*[a-z_0-9]+\.py)\b")
MADE = {"wakefield.py"}  # what `ground dialect --out` writes
# written by a run, or by whoever brings something; part of a name written out just before
OTHERS = re.compile(r"(scenario|flight_.*|my.*)\.toml|_\w+\.py|test_lee_errata_\w+\.py")


@cache
def names() -> frozenset[str]:
    """Names of all files of the project."""
    tops = ("flightsw", "sim_plant", "ground", "hil_scripts", "tests", "data")
    return frozenset(p.name for top in tops for p in (ROOT / top).rglob("*.*")) | {p.name for p in ROOT.glob("*.*")}


def missing(text: str) -> Iterator[str]:
    """What a text names and does not exist: files, folders, and names said to be in a file that it does not define."""
    for m in FILE.finditer(text):
        found = [ROOT / top / m[1] for top in TOPS if (ROOT / top / m[1]).exists()]
        if not found and ("/" in m[1] or m[1] not in names()) and not OTHERS.fullmatch(m[1]):
            yield m[1]
        if not found or found[0].suffix != ".py":
            continue
        code = found[0].read_text()
        for name in re.findall(r"`([\w.]+)`", m[2]):
            for part in name.split("."):
                if not re.search(rf"^\s*(?:def|class) {re.escape(part)}\b", code, re.MULTILINE):
                    yield f"{m[1]}: {name}"
                    break
    for m in FOLDER.finditer(text):
        if not m[1].endswith((".py", ".toml", ".xml")) and not any((ROOT / top / m[1]).exists() for top in TOPS):
            yield m[1]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_what_is_named_exists(page: Path) -> None:
    assert list(missing(page.read_text())) == []


def unknown(text: str, at: Path) -> list[str]:
    """Python files a source text names that do not exist."""
    near = [at.parent, *(ROOT / top for top in (*TOPS, "flightsw/missions/"))]
    return [
        m
        for m in IN_CODE.findall(text)
        if (not any((n / m).exists() for n in near) if "/" in m else m not in names()) and m not in MADE
    ]


def test_source_files_name_files_that_exist() -> None:
    code = [p for top in TOPS[1:] for p in (ROOT / top).rglob("*.py")]
    assert len(code) > 300
    assert {str(p.relative_to(ROOT)): x for p in code if (x := unknown(p.read_text(), p))} == {}
    assert unknown("see nav/layout.py, app.py, nowhere.py", ROOT / "flightsw" / "app.py") == [
        "nav/layout.py",
        "nowhere.py",
    ]


def test_enough_is_named() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    assert len(FILE.findall(text)) > 25 and sum(bool(rest) for _, rest in FILE.findall(text)) > 15


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("`flightsw/app.py`, `FlightApp.tick`", []),
        ("`flightsw/app.py`, `FlightApp.tock`", ["flightsw/app.py: FlightApp.tock"]),
        ("`process/nowhere.py`", ["process/nowhere.py"]),
        ("`nowhere.py`, `app.py`", ["nowhere.py"]),
        ("`flightsw/fdi` and `flightsw/filters/`", ["flightsw/fdi"]),
        ("`sim_plant/scenarios/nowhere.toml`", ["sim_plant/scenarios/nowhere.toml"]),
    ],
)
def test_made_up_names(text: str, found: list[str]) -> None:
    assert list(missing(text)) == found
