"""docs/architecture.md names files and functions that exist."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "architecture.md"
TOPS = ("", "flightsw/", "sim_plant/", "ground/", "hil_scripts/")
FILE = re.compile(r"`((?:[\w]+/)*[\w.]+\.py)`((?:, `(?![\w.]+\.py`)[\w.]+`)*)")


def missing(text: str) -> Iterator[str]:
    """Files named that do not exist, and names said to be in them that are defined nowhere in them."""
    for m in FILE.finditer(text):
        found = [ROOT / top / m[1] for top in TOPS if (ROOT / top / m[1]).exists()]
        if not found:
            yield m[1]
            continue
        code = found[0].read_text()
        for name in re.findall(r"`([\w.]+)`", m[2]):
            for part in name.split("."):
                if not re.search(rf"^\s*(?:def|class) {re.escape(part)}\b", code, re.MULTILINE):
                    yield f"{m[1]}: {name}"
                    break


def test_files_and_functions_exist() -> None:
    assert list(missing(PAGE.read_text())) == []


def test_enough_is_named() -> None:
    assert len(FILE.findall(PAGE.read_text())) > 25


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("`flightsw/app.py`, `FlightApp.tick`", []),
        ("`flightsw/app.py`, `FlightApp.tock`", ["flightsw/app.py: FlightApp.tock"]),
        ("`process/nowhere.py`", ["process/nowhere.py"]),
    ],
)
def test_made_up_names(text: str, found: list[str]) -> None:
    assert list(missing(text)) == found
