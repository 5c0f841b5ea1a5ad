"""A flight of which one aircraft's flightsw is started as on another computer: from what was handed over, by its own line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.forks import Forked
from tests.sil.launch import TIMEOUT_S, Ended, start, wait_for


@dataclass(frozen=True)
class Flown:
    """Both ends of a flight that has ended."""

    run: Path
    launcher: Ended
    board: Ended


def board(run: Path, name: str, offset: int, *args: object) -> Forked:
    """Start flightsw of `name` with what run folder `run` hands over; its log goes to the run folder, its words beside it."""
    folder = run / f"board_{name}"
    config = folder / f"flight_{name}.toml"
    assert wait_for(config.is_file)
    words = run.parent / f"board-{run.name}.txt"
    argv = ("--config", config, "--run-dir", run, "--port-offset", offset, *args)
    return Forked("flightsw.__main__", *argv, out=words)


def fly(run: Path, offset: int, at: str, seconds: float, onboard: Sequence[object] = (), *args: object) -> Flown:
    """`sil run refueling` with an external receiver at line `at`, and its flightsw with the options `onboard`."""
    words = run.parent / f"sil-{run.name}.txt"
    external = f"receiver={at}" if at else "receiver"
    common = ("run", "refueling", "--seed", 3, "--duration", seconds, "--no-rrd", "--port-offset", offset)
    launcher = start(*common, "--external", external, "--out", run, *args, out=words)
    far = board(run, "receiver", offset, *onboard)
    code = launcher.wait(max(TIMEOUT_S, 2.0 * seconds))
    far_code = far.wait(30.0)
    return Flown(
        run, Ended(code, words.read_text()), Ended(far_code, (run.parent / f"board-{run.name}.txt").read_text())
    )
