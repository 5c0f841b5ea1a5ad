"""The works line by line: nothing numbered without a line, every command one that can be typed, every figure one that is made."""

from __future__ import annotations

import ast
import importlib.util
import shlex
from pathlib import Path

import pytest
import typer
from click import Command

from ground.report import prints
from hil_scripts import sil
from hil_scripts.campaign.registry import find
from sim_plant.scenario import Scenario  # noqa: F401 - kinds of aircraft are declared with it

ROOT = Path(__file__).parents[2]
COMMANDS: Command = typer.main.get_command(sil.app)


def test_numbers_of_a_place() -> None:
    assert list(prints.numbered("(2.3)-(2.5), Fig. 7.1-7.3, 7.9")) == [
        "(2.3)", "(2.4)", "(2.5)", "Fig. 7.1", "Fig. 7.2", "Fig. 7.3", "Fig. 7.9",
    ]  # fmt: skip
    assert list(prints.numbered("(29a), Table 3, section 5, Fig. 6")) == ["(29)", "Table 3", "Fig. 6"]


@pytest.mark.parametrize("name", prints.works())
def test_nothing_the_work_numbers_is_without_a_line(name: str) -> None:
    assert prints.read(name).without() == []


def typed(r: prints.Printed) -> None:
    """Raises for a command that cannot be typed."""
    program, *args = shlex.split(r.command)
    if program == "sil":
        command = COMMANDS.commands[args[0]]  # type: ignore[attr-defined]
        given = command.make_context(args[0], args[1:], resilient_parsing=False).params
        if args[0] == "campaign":
            find(given["name"]).choose(given["cases"].split(",") if given["cases"] else None)
        else:
            assert args[0] == "run" and (ROOT / f"sim_plant/scenarios/{given['scenario']}.toml").exists()
    elif program == "pytest":
        for arg in args:
            path, _, test = arg.partition("::")
            tree = ast.parse((ROOT / path).read_text())
            assert not test or test in {f.name for f in tree.body if isinstance(f, ast.FunctionDef)}
    else:
        assert program == "python" and args[0] == "-m" and importlib.util.find_spec(args[1])


def made(r: prints.Printed) -> None:
    """Raises for a figure that is of no case, that the command does not make, or that does not bear the verdict out."""
    if r.key:
        study, case, _ = r.key.split("/")
        words = shlex.split(r.command)
        assert words[:3] == ["sil", "campaign", study]
        chosen = find(study).choose(words[4].split(",") if "--cases" in words else None)
        assert case in {c.name for c in chosen}
    assert r.measured is None or r.holds(r.measured), f"{r.measured} against {r.low} to {r.high}: {r.verdict}"


@pytest.mark.parametrize("name", prints.works())
def test_every_command_can_be_typed_and_every_figure_bears_its_verdict_out(name: str) -> None:
    wrong = []
    for r in prints.read(name).row:
        try:
            if r.command:
                typed(r)
            made(r)
        except Exception as e:
            wrong.append(f"{r.place}, {r.what}: {r.command}: {type(e).__name__}: {e}")
    assert wrong == []


def test_a_verdict_its_figure_does_not_bear_out_is_seen() -> None:
    line = prints.Printed("(1)", "x", prints.YES, "sil campaign lee", high=1.0)
    other = prints.Printed("(1)", "x", prints.NO, "sil campaign lee", high=1.0, why="y")
    assert line.holds(0.5) and not line.holds(2.0)
    assert other.holds(2.0) and not other.holds(0.5)
