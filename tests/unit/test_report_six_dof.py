"""The chapter on the printed methods flown by the full aircraft: a picture per figure of the print, numbers of the summary."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ground.report.build import Pictures
from ground.report.cases import Cases
from ground.report.load import load
from ground.report.sevil.six_dof import six_dof
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.sevil import six_dof as study

pytestmark = pytest.mark.usefixtures("small_pictures")
Y = (-0.5, 0.0, 1.5)


def fly(case: Case, seed: int) -> RunResult:
    """Holds and a row of the grid in short; in place of the approach, 480 s of flight, a line."""
    if not case.name.startswith("tables"):
        return study._run(case, seed)
    t = np.arange(0.0, 20.0, 0.2)
    line = np.linspace((6.0, 2.0), (0.0, 8.5), len(t))
    traces = {"t": t, "true": line, "att": np.zeros((len(t), 3)), "second": t[::5]}
    traces |= {f"{n}.position": line[::5] + 0.1 for n in ("A11", "A11_trim")}
    return RunResult({"printed.V.fap_before_pct": 1.03, "A11.available_after_pct": 99.0}, traces)


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Three kinds of case, one run each."""
    root = tmp_path_factory.mktemp("six_dof")
    short = {"duration_s": 22.0}
    mine = (
        Case("hold_left", {"y_m": -0.5, "z_m": 9.5, **short}),
        Case("grid_10", {"y_m": list(Y), "z_m": 8.5, **short}),
        Case("tables_calm", {"rough": False, "draws": 1, "detectors": []}),
    )
    folder = run_campaign(replace(study.STUDY, cases=mine, run=fly), 1, 1, root / "c", workers=0, progress=False).folder
    return Cases([load(folder)], Pictures(root / "out"))


def test_every_figure_has_its_picture(cases: Cases, tmp_path: Path) -> None:
    cases.pictures = Pictures(tmp_path)
    text = six_dof(cases)
    drawn = {f.stem for f in tmp_path.glob("*.png")}
    assert drawn == {"six_dof_grid", "six_dof_hold_left", "six_dof_approach"}
    assert "1.03" in text and "Figure 6.10" in text and "Figure 6.14" in text


def test_the_grid_says_where_each_place_was_found(cases: Cases) -> None:
    """At contact both maps find the place within what the holds say; counts in the text are those of the arrays."""
    c = cases.named("grid_10")
    assert c is not None
    grid = c.traces()["grid"]
    assert grid[:, 0] == pytest.approx(Y) and grid.shape == (3, 6)
    assert np.abs(grid[1, 2:]).max() < 0.3  # y = 0
    near = int((np.hypot(*grid[:, 4:].T) < study.NEAR_M).sum())
    assert c.stat("A11_trim.near_pct").value == pytest.approx(100.0 * near / 3.0)
    assert f"nearer than 0.5 m at {near}" in six_dof(cases)


def test_without_such_a_campaign_there_is_no_chapter(tmp_path: Path) -> None:
    assert six_dof(Cases([], Pictures(tmp_path))) == ""
