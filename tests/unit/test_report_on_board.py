"""The chapter on the printed position on board: a picture of every method flown, numbers of the summary."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ground.report.build import Pictures
from ground.report.cases import Cases
from ground.report.load import load
from ground.report.sevil.on_board import on_board
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.registry import find
from hil_scripts.campaign.study import Case, RunResult

pytestmark = pytest.mark.usefixtures("small_pictures")


def fly(case: Case, seed: int) -> RunResult:
    """In place of a flight a line, found at every second sample."""
    t = np.arange(0.0, 60.0, 0.2)
    xi = np.column_stack([np.full_like(t, -38.0), 0.01 * t, 6.7 + 0.0 * t])
    valid = (np.arange(len(t)) % 2).astype(np.int8)
    traces = {"t": t, "xi": xi, "wake": xi + 0.3, "valid": valid}
    if case.params["calm"]:
        return RunResult({"lag_s": 0.495, "moving.max_m.y": 0.62}, traces)
    return RunResult(
        {"contact.available_pct": 50.0, "contact.rms_m": 1.41, "breakaway": 1.0, "lost.kept_s": 3.1}, traces
    )


def chapter(tmp_path: Path, *names: str) -> tuple[str, set[str]]:
    study = find("sevil_baseline")
    cases = tuple(c for c in study.cases if c.name in names)
    assert len(cases) == len(names)
    folder = run_campaign(replace(study, cases=cases, run=fly), 1, 1, tmp_path / "c", workers=0, progress=False).folder
    (tmp_path / "out").mkdir()
    text = on_board(Cases([load(folder)], Pictures(tmp_path / "out")))
    return text, {f.stem for f in (tmp_path / "out").glob("*.png")}


def test_methods_and_calm_air_have_their_pictures_and_figures(tmp_path: Path) -> None:
    text, drawn = chapter(tmp_path, "filter", "algorithm_11", "algorithm_11_calm")
    assert drawn == {"on_board", "on_board_calm"}
    for figure in ("1.41", "3.1", "0.495", "0.620"):
        assert figure in text, figure


def test_what_was_not_flown_is_left_out(tmp_path: Path) -> None:
    text, drawn = chapter(tmp_path, "algorithm_15")
    assert drawn == {"on_board"} and "Moved across" not in text
    assert on_board(Cases([], Pictures(tmp_path))) == ""
