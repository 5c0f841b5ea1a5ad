"""How the average's time constant trades noise for lag: flights of the cruise with several."""

from __future__ import annotations

import tempfile
from pathlib import Path

from example import SCENARIOS
from example.view import VIEW
from ground.run import load
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.launch import screen
from hil_scripts.launch.inproc import fly
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import make_folder, resolve


def run(case: Case, seed: int) -> RunResult:
    """One flight; the view's figures as values."""
    p = case.params
    with tempfile.TemporaryDirectory() as tmp:
        sets = [f"navion.nav.tau_s={p['tau_s']}"]
        plan = resolve(str(SCENARIOS / "cruise.toml"), seed % 2**31, sets, p["duration_s"])
        folder = make_folder(plan, Path(tmp) / "run")
        ended = fly(plan, folder, screen.console(quiet=True), StopFlag())
        found = VIEW.figures(load(folder))
    values = {k.removeprefix("example.navion."): float(v) for k, v in found.items() if isinstance(v, (int, float))}
    return RunResult(values | {"lost": float(ended.outcome != "completed")})


STUDY = Study(
    name="example",
    title="Wind by the triangle",
    purpose="Error of the wind and of the course against the time constant of the average",
    cases=tuple(Case(f"tau_{tau}", {"tau_s": float(tau), "duration_s": 120.0}) for tau in (2, 8, 30)),
    run=run,
    default_runs=10,
)
