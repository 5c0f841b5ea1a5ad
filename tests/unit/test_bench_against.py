"""Today's plant against another commit's: what is compared, and what is said of a commit there is none of."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from hil_scripts.bench import against

FAKE = """
import sys
cost = {"own": 2.0, "all": 3.0}[sys.argv[2]] * (0.5 if sys.argv[1] == "then" else 1.0)
for line in sys.stdin:
    print(cost * int(line), flush=True)
"""


def test_every_kind_is_asked_in_turn_and_held_against_the_commits_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(against, "SERVE", FAKE)
    taken = against.compare(Path("then"), Path("now"), batches=3, ticks=10)
    assert taken == {against.THEN: [10.0] * 3, against.NOW: [20.0] * 3, against.EVERYTHING: [30.0] * 3}
    assert against.ratios(taken, against.EVERYTHING) == (3.0, 3.0)


def test_what_a_tree_says_at_its_end_is_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(against, "SERVE", "raise SystemExit('no plant in this tree')")
    with pytest.raises(RuntimeError, match="no plant in this tree"):
        against.compare(Path("then"), Path("now"), batches=1)


@pytest.mark.parametrize(("code", "logged"), [("FLY", True), ("FLY_UNLOGGED", False)])
def test_flights_are_flown_in_turns_by_the_same_scenario(
    monkeypatch: pytest.MonkeyPatch, code: str, logged: bool
) -> None:
    monkeypatch.setattr(against, code, FAKE.replace('{"own": 2.0, "all": 3.0}', '{"gust": 4.0}'))
    taken = against.flights(Path("then"), Path("now"), "gust", batches=2, logged=logged)
    assert taken == {against.THEN: [2.0 * against.FLIGHT_BATCH] * 2, against.NOW: [4.0 * against.FLIGHT_BATCH] * 2}


def test_a_commit_that_is_none_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["against", "nosuchcommit"])
    assert against.main() == 2 and "nosuchcommit" in capsys.readouterr().err


def test_the_code_a_tree_is_asked_by_is_python() -> None:
    compile(against.SERVE, "serve", "exec")
    compile(against.FLY, "fly", "exec")
    compile(against.FLY_UNLOGGED, "fly", "exec")
