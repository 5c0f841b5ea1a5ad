"""The campaign on grades of sensors: what a run sees, what it makes of it, and the page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ground.report.grades.build import OUTCOMES, grades_report, poisson
from hil_scripts.campaign import folder as folders
from hil_scripts.campaign import registry
from hil_scripts.campaign import table as results
from hil_scripts.campaign.study import Case
from hil_scripts.campaign.task import Row
from hil_scripts.studies.grades import flight as g
from hil_scripts.studies.grades.study import STUDY
from hil_scripts.studies.grades.winds import Winds


@pytest.fixture(scope="module")
def watch() -> g.Graded:
    """Two seconds of a tactical flight from the third second on, as if observation were contact."""
    f = g.Flying("refueling", 3, g.settings("tactical", 0.94, g.Timetable()))
    assert not g.arrive(f, 3.0)
    w = g.Graded(f)
    w.m = replace(w.m, phase="observation", station_m=tuple(g.START_M))
    assert not g.follow(w, 2.0)
    return w


def test_the_grade_and_the_air_are_those_of_the_case(watch: g.Graded) -> None:
    sc = watch.flight.server.world.scenario
    assert sc.suite("tanker").grade == sc.suite("receiver").grade == "tactical" and sc.wind.dryden.sigma_mps == 0.94


def test_every_published_estimate_is_held_against_the_truth_of_its_time(watch: g.Graded) -> None:
    """Ten a second of each; a relative position of this grade is wrong by decimetres, not by what is flown in 50 ms."""
    assert watch.unpaired == 0 and len(watch.relative) == len(watch.wind) == 20 and len(watch.contact) == 2 * g.LOOK_HZ
    e, sigma = np.array(watch.relative)[:, :3], np.array(watch.relative)[:, 3:]
    assert 1e-3 < np.abs(e).max() < 2.0 and (sigma > 0.01).all()
    assert math.isinf(watch.left_s) and g.judge(watch.track(False), g.LIMIT_M) is not g.Outcome.LOST


def test_below_five_seconds_there_are_no_figures(watch: g.Graded) -> None:
    assert g.figures(watch) == {}


def test_figures_are_those_of_known_errors() -> None:
    """A Gaussian error of 1 sigma is 99.73 % inside three, of 2 sigma 86.64 % (normal tables)."""
    unit = np.random.default_rng(1).standard_normal((20000, 3))
    for factor, share in ((1.0, 99.73), (2.0, 86.64)):
        rows = [tuple(r) for r in np.hstack((factor * unit, np.ones_like(unit)))]
        out = g._errors("wind", rows, "ned", "mps")
        assert out["wind.inside_3sigma_pct"] == pytest.approx(share, abs=0.3)
        assert out["wind.rms_mps.e"] == pytest.approx(factor, rel=0.02)
        assert out["wind.p95_mps.d"] == pytest.approx(1.96 * factor, rel=0.03) and out["wind.sigma_mps.n"] == 1.0


def test_contact_not_reached_is_an_outcome() -> None:
    case = Case("x", {"grade": "paper", "sigma_mps": 0.39, "times": {"arrive_s": 0.2}})
    v = g.run_case(case, 3).values
    assert v["is.not_reached"] == 1.0 and sum(v[f"is.{o}"] for o in g.OUTCOMES) == 1.0


def test_study_and_page_have_every_grade_level_and_outcome(tmp_path: Path) -> None:
    assert registry.find("grades") is STUDY and list(OUTCOMES) == list(g.OUTCOMES) == list(STUDY.binary)
    assert len(STUDY.cases) == 20
    rows = []
    for case in STUDY.cases:
        for run in range(4):
            kept = run < 3
            values = {f"is.{o}": float(o == ("kept" if kept else "lost")) for o in g.OUTCOMES}
            values |= {"contact.s": 150.0, "contact.rms_m.x": 0.25, "wind.inside_3sigma_pct": 50.0} if kept else {}
            values |= {"alerts": float(run), "watched_s": 1800.0}
            rows.append(Row(case.name, run, run, "ok", "", values))
    folder = tmp_path / "c"
    folder.mkdir()
    results.write_parquet(folder / results.PARQUET, rows, 1)
    results.write_summary(folder / results.SUMMARY, rows, STUDY.binary)
    folders.write_meta(folder, folders.new_meta(None, STUDY, 1, 4, STUDY.cases))
    text = grades_report([folder], tmp_path / "out").read_text()
    low, high = results.share_interval([1.0, 1.0, 1.0, 0.0]) or (0.0, 0.0)
    assert text.count(f"0.750<small>{low:.3f} … {high:.3f}</small>") == 20
    assert text.count('<tr class="group">') == 5 * 4 and text.count('data-key="mems_6.22.is.lost.mean"') == 1
    assert text.count('data-key="tactical_0.94.contact.rms_m.x.rms" data-value="0.25"') == 1
    assert text.count("1.10 to 6.53") == 4  # six alerts in two hours, four cases with bounds


@pytest.mark.parametrize(("count", "lo", "hi"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.390)])
def test_intervals_of_counts_are_those_of_the_tables(count: int, lo: float, hi: float) -> None:
    """Garwood's, as in Pearson and Hartley, Biometrika Tables, table 40."""
    assert poisson(count) == pytest.approx((lo, hi), abs=6e-4)


def test_wind_is_read_in_size_and_direction_before_and_after_a_quarter_turn() -> None:
    w = Winds("tanker")
    for i in range(181):
        psi = math.radians(1.01 * i)
        w.look(SimpleNamespace(q_nb=(math.cos(psi / 2), 0.0, 0.0, math.sin(psi / 2))))  # type: ignore[arg-type]
        size, angle = (1.03, math.radians(2.0)) if i < 90 else (0.99, math.radians(-1.0))
        true = SimpleNamespace(wind_n=(12.0, -9.0, 1.0))
        at = math.atan2(-9.0, 12.0) + angle
        w.note((15.0 * size * math.cos(at), 15.0 * size * math.sin(at), 0.0), true)  # type: ignore[arg-type]
    assert w.figures() == pytest.approx(
        {
            "wind.tanker.straight.size_rms_pct": 3.0, "wind.tanker.straight.direction_rms_deg": 2.0,
            "wind.tanker.turned.size_rms_pct": 1.0, "wind.tanker.turned.direction_rms_deg": 1.0,
        },
        abs=1e-9,
    )  # fmt: skip
