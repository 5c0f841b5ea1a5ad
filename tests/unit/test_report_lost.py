"""A variant lost in every run is in every figure and table, and no verdict is coloured beside a number that is not there."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from ground.report import figures, verdicts
from ground.report import page as p
from ground.report.cases import Cases, matrix, sweep_points
from ground.report.lee import open_loop
from ground.report.lee import page as lee
from ground.report.lee.build import claims, lee_report
from ground.report.load import Stat, load
from ground.report.rivard import cells as rivard_cells
from ground.report.verdicts import Target
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, RunResult, Study

RUNS = 3
AXES = "xyz"


def _run(case: Case, seed: int) -> RunResult:
    """ "doomed" is lost in every run of every case; "measured" above G = 1; "wild" has a value that is not finite, one time of
    three where G = 1, always above."""
    rng, G = np.random.default_rng(seed), case.params["G"]
    out: dict[str, float] = {}
    for name in ("estimated", "measured", "doomed"):
        lost = name == "doomed" or (name == "measured" and G > 1.0)
        out[f"{name}.lost"] = float(lost)
        if not lost:
            out |= {f"{name}.contact.rms_m.{x}": 0.1 * G * rng.uniform(0.9, 1.1) for x in AXES}
            out |= {f"{name}.wind.magnitude_rms_pct": G, f"{name}.wind.direction_rms_deg": G}
    wild = G > 1.0 or (G == 1.0 and case.params["odd"] and seed % 2 == 0)
    out |= {f"wild.contact.rms_m.{x}": math.inf if wild else 0.2 for x in AXES}
    return RunResult(out)


def _fails(case: Case, seed: int) -> RunResult:
    if case.name == "G_7":
        raise FloatingPointError("diverged")
    return _run(case, seed)


def _study(gs: tuple[float, ...], run: Any = _run, name: str = "lee_noise") -> Study:
    return Study(name, "Noise", "made up", tuple(Case(f"G_{g:g}", {"G": g, "odd": 1}) for g in gs), run)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep over four values of G."""
    out = tmp_path_factory.mktemp("lost") / "sweep"
    return run_campaign(_study((0.3, 1.0, 3.0, 7.0)), RUNS, 1, out, workers=0, progress=False).folder


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Every text a figure writes, and every cross of `mark_lost`."""
    texts: list[str] = []
    write, mark = Axes.annotate, figures.mark_lost

    def annotate(ax: Axes, text: str, *a: Any, **k: Any) -> Any:
        texts.append(text)
        return write(ax, text, *a, **k)

    def marked(ax: Axes, at: Any, colour: str) -> None:
        texts.extend(f"cross {colour} {x:g}" for x in at)
        mark(ax, at, colour)

    monkeypatch.setattr(Axes, "annotate", annotate)
    monkeypatch.setattr(figures, "mark_lost", marked)
    return texts


def test_the_reason_of_a_missing_number(folder: Path) -> None:
    c = load(folder)
    assert c.stat("G_0.3", "doomed.contact.rms_m.x") == Stat(
        "G_0.3.doomed.contact.rms_m.x.rms", None, why=f"lost in all {RUNS} runs"
    )
    assert c.stat("G_3", "measured.contact.rms_m.x").why == f"lost in all {RUNS} runs"
    assert c.stat("G_1", "measured.contact.rms_m.x").why == ""
    assert c.stat("G_3", "wild.contact.rms_m.x").why == f"not finite in all {RUNS} runs"
    assert c.stat("G_1", "no.such.value") == Stat("G_1.no.such.value.mean", None)
    some = c.stat("G_1", "wild.contact.rms_m.x")
    wild = (
        int(c.summary["G_1.wild.contact.rms_m.x.nonfinite"] or 0)
        if "G_1.wild.contact.rms_m.x.nonfinite" in c.summary
        else 0
    )
    assert some.n == RUNS - wild and some.why == (f"not finite in {wild} of {RUNS} runs" if wild else "")


def test_an_always_lost_controller_is_in_figure_and_table(folder: Path, tmp_path: Path, drawn: list[str]) -> None:
    html = lee_report([folder], tmp_path).read_text()
    for g in (0.3, 1.0, 3.0, 7.0):
        assert any(t.startswith("cross ") and t.endswith(f" {g:g}") for t in drawn)
    assert figures.ALL_LOST in drawn
    rows = [r for r in re.findall(r"<tr>.*?</tr>", html) if "doomed" in r and f"lost in all {RUNS} runs" in r]
    assert len(rows) >= 4  # one per case
    assert all('class="num soft"' in r for r in rows)


def test_bars_say_it_too(tmp_path: Path, drawn: list[str]) -> None:
    """Two cases are no sweep: bars."""
    made = run_campaign(_study((1.0, 7.0)), RUNS, 1, tmp_path / "two", workers=0, progress=False).folder
    lee_report([made], tmp_path / "out")
    assert drawn.count(f"lost in all {RUNS} runs") >= 2 * len(AXES) + len(AXES)  # doomed twice, measured once, per axis


def test_runs_that_all_failed_are_named_as_such(tmp_path: Path) -> None:
    made = run_campaign(_study((0.3, 1.0, 3.0, 7.0), _fails), RUNS, 1, tmp_path / "f", workers=0, progress=False).folder
    c = load(made)
    assert c.stat("G_7", "estimated.contact.rms_m.x").why == f"all {RUNS} runs failed"
    points = open_loop.points(c, c.swept(("G",)), "contact.rms_m.x")
    assert [(q.x, math.isnan(q.y)) for q in points["estimated"]] == [
        (0.3, False),
        (1.0, False),
        (3.0, False),
        (7.0, True),
    ]


def test_other_reports_by_the_same_helpers(folder: Path) -> None:
    """Sweeps and matrices of the air-data report, points of the rendezvous report."""
    c = load(folder)
    for x in c.cases:
        c.meta["cases"][x]["kind"] = "static"
    cases = Cases([c], None)  # type: ignore[arg-type]
    family = cases.family("G", "static")
    got = sweep_points(family, ["measured", "doomed"], "contact.rms_m.x")
    assert [math.isnan(q.y) for q in got["measured"]] == [False, False, True, True]
    assert len(got["doomed"]) == 4
    assert f"lost in all {RUNS} runs" in matrix(cases.kind("static"), [("doomed", "doomed.contact.rms_m.x")])
    q = rivard_cells.point(cases, "G_7", "measured.contact.rms_m.x", 7.0)
    assert q is not None and math.isnan(q.y) and q.lost == 1.0
    assert rivard_cells.point(cases, "G_7", "nothing.of.it", 7.0) is None


# --- colour --------------------------------------------------------------------------------------------------------------

TARGET = Target("made up", "G_1", ("a", "b"), "<=", 1.0)


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
@pytest.mark.parametrize("css", ["good", "bad"])
def test_no_colour_without_a_number(value: float | None, css: str) -> None:
    for html in (p.cell(Stat("k", value, why="lost"), css), p.plain(value, css, " m", "met"), p.blank("lost")):
        assert css not in html and "–" in html and " m" not in html and "met" not in html


def test_verdicts() -> None:
    fine, poor, none = Stat("k", 0.5), Stat("k", 2.0), Stat("k", None, why="lost in all 3 runs")
    assert verdicts.worst([fine, poor], TARGET) is poor and verdicts.worst([poor, none], TARGET) is none
    assert verdicts.worst([Stat("k", None)], TARGET) is None and verdicts.worst([], TARGET) is None
    assert [verdicts.met(s, TARGET) for s in (fine, poor, none)] == [True, False, False]
    assert "good" in verdicts.verdict(fine, True) and "bad" in verdicts.verdict(poor, False)
    said = verdicts.verdict(none, False)
    assert "no figure" in said and "bad" not in said and "good" not in said
    assert "1 of 3" in verdicts.card([True, False, False])[0] and verdicts.card([]) == []


def test_a_number_that_is_none_in_the_file_is_not_judged(folder: Path, tmp_path: Path) -> None:
    """summary.json with NaN, as another program may write it."""
    other = Path(shutil.copytree(folder, tmp_path / "nan"))
    summary = json.loads((other / "summary.json").read_text())
    key = "G_1.estimated.contact.rms_m.x"
    summary[f"{key}.rms"] = math.nan
    (other / "summary.json").write_text(json.dumps(summary))
    s = load(other).stat("G_1", "estimated.contact.rms_m.x")
    assert s.value is None and s.why == "not a number"


def test_a_claim_for_coloured_noise_is_not_set_beside_white_data(folder: Path) -> None:
    c = load(folder)
    known = lee.STUDIES["lee_noise"]
    said = claims(c, known)
    assert "Printed, white noise: measured feedback fails above G = 0.6, estimated works to 7.<" in said
    assert "No case here has coloured noise" in said and "No case here has white noise" not in said
    c.meta["cases"]["G_7"]["tau_s"] = 1.0
    assert "No case here" not in claims(c, known)
