"""Logs that stop short under a launcher that saw the run to its end: the run is "truncated", on screen, in the file and by
the exit code."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from hil_scripts.launch import finish
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.mission import Outcome
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import RunPlan, make_folder, resolve
from tests.sil.launch import summary

SECONDS = 2.0


def flown(folder: Path) -> tuple[RunPlan, Path]:
    """Two seconds of the gust flight."""
    plan = resolve("gust", 1, [], SECONDS)
    run = make_folder(plan, folder / "run")
    flight = InProcess(plan, run)
    while not flight.server.done:
        flight.tick()
    flight.finish()
    return plan, run


def ended(plan: RunPlan, run: Path) -> tuple[int, str]:
    """Exit code and words of the launcher for a run it saw completed."""
    text = io.StringIO()
    with StopFlag() as stop:
        outcome = Outcome("completed", "", SECONDS, 10.0)
        code = finish.finish(plan, run, outcome, False, Console(file=text, width=200), stop)
    return code, text.getvalue()


def test_whole_logs_complete_and_cut_ones_do_not(tmp_path: Path) -> None:
    plan, run = flown(tmp_path)
    code, text = ended(plan, run)
    assert code == 0 and summary(run)["run.outcome"] == "completed", text
    for name, words in (
        ("truth.tlog", "truth.tlog ends at t = "),
        ("link_alexis.tlog", "link_alexis.tlog ends before the run does"),
    ):
        raw = (run / name).read_bytes()
        (run / name).write_bytes(raw[: len(raw) // 2])
        code, text = ended(plan, run)
        assert code == finish.EXIT_FAILED and words in text
        assert summary(run)["run.outcome"] == "truncated" and words in summary(run)["run.reason"]
        (run / name).write_bytes(raw)
