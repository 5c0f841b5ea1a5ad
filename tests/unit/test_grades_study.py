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
from hil_scripts.studies.grades import estimates as es
from hil_scripts.studies.grades import flight as g
from hil_scripts.studies.grades import nominal
from hil_scripts.studies.grades.setting import START_M
from hil_scripts.studies.grades.study import STUDY
from hil_scripts.studies.grades.winds import Winds
from hil_scripts.studies.grades.words import Words


@pytest.fixture(scope="module")
def watch() -> g.Graded:
    """Two seconds of a guarded tactical flight once the bank has begun, as if observation were contact."""
    f = g.Flying("refueling", 3, g.settings("tactical", 0.94, g.Timetable(), guarded=True))
    e, words = es.Estimates(f, "tactical"), Words()
    assert not g.arrive(e, words, 8.0) and e.phase == "observation"
    w = g.Graded(e, words)
    w.m = replace(w.m, phase="observation", station_m=tuple(START_M))
    assert not g.follow(w, 2.0)
    return w


def test_the_grade_and_the_air_are_those_of_the_case(watch: g.Graded) -> None:
    sc = watch.flight.server.world.scenario
    assert sc.suite("tanker").grade == sc.suite("receiver").grade == "tactical" and sc.wind.dryden.sigma_mps == 0.94


def test_every_published_estimate_is_held_against_the_truth_of_its_time(watch: g.Graded) -> None:
    """Ten a second of each; a relative position of this grade is wrong by decimetres, not by what is flown in 50 ms."""
    p = watch.estimates.contact
    rows = (p.relative, *p.wind, *p.attitude)
    assert p.unpaired == 0 and [len(r) for r in rows] == [20] * 5 and len(watch.contact) == 2 * g.LOOK_HZ
    assert not watch.estimates.precontact.relative and len(p.bound) == 10
    e, sigma, least = np.hsplit(np.array(p.relative), 3)
    assert 1e-3 < np.abs(e).max() < 2.0 and (sigma > 0.01).all() and ((least > 0.03) & (least < 0.6)).all()
    for rows in p.attitude:
        e, sigma = np.hsplit(np.array(rows), 2)
        assert 1e-3 < np.abs(e).max() < 1.0 and (sigma > math.degrees(0.0025)).all() and (sigma < 0.5).all()
    for rows in p.wind:
        e, sigma, least = np.hsplit(np.array(rows), 3)
        assert (least > 0.1).all() and (least < sigma).all()  # on board the sensors are believed a little worse
    assert math.isinf(watch.left_s) and g.judge(watch.track(False), g.LIMIT_M) is not g.Outcome.LOST


def test_below_five_seconds_there_are_no_figures(watch: g.Graded) -> None:
    assert g.figures(watch) == {}


def test_figures_are_those_of_known_errors() -> None:
    """A Gaussian error of 1 sigma is 99.73 % inside three, of 2 sigma 86.64 % (normal tables)."""
    unit = np.random.default_rng(1).standard_normal((20000, 3))
    for factor, share in ((1.0, 99.73), (2.0, 86.64)):
        rows = [tuple(r) for r in np.hstack((factor * unit, np.ones_like(unit), 0.5 * np.ones_like(unit)))]
        out = es.errors("wind", rows, ("n", "e", "d"), "mps")
        assert (
            out["wind.rms_over_bound.e"] == pytest.approx(2.0 * factor, rel=0.02) and out["wind.rms_bound_mps.n"] == 0.5
        )
        assert "wind.rms_over_bound.e" not in es.errors("wind", [r[:6] for r in rows], ("n", "e", "d"), "mps")
        assert out["wind.inside_3sigma_pct"] == pytest.approx(share, abs=0.3)
        assert out["wind.rms_mps.e"] == pytest.approx(factor, rel=0.02)
        assert out["wind.p95_mps.d"] == pytest.approx(1.96 * factor, rel=0.03) and out["wind.sigma_mps.n"] == 1.0


def test_precontact_is_the_distance_from_the_truth() -> None:
    """Three axes of 0.1, 0.2 and 0.2 m are 0.3 m off; the least possible 0.15."""
    e = SimpleNamespace(precontact=es.Phase())
    assert es.in_precontact(e) == {}  # type: ignore[arg-type]
    for _ in range(30):
        e.precontact.relative.append((0.1, -0.2, 0.2, *(0.2,) * 3, 0.05, 0.1, 0.1))
    out = es.in_precontact(e)  # type: ignore[arg-type]
    assert out["precontact.off_rms_m"] == pytest.approx(0.3) and out["precontact.off_p95_m"] == pytest.approx(0.3)
    assert out["precontact.off_rms_bound_m"] == pytest.approx(0.15) and out["precontact.s"] == 3.0
    assert out["precontact.nees_per_axis"] == pytest.approx(0.75) and out["precontact.rms_m.y"] == pytest.approx(0.2)


def test_a_guarded_grade_flies_with_beliefs_of_its_own_and_the_long_flight_to_its_end() -> None:
    for grade in ("tactical", "mems"):
        f = g.Flying("refueling", 3, g.settings(grade, 0.94, g.Timetable(), guarded=True))
        assert [n.app.mission.wind is not None for n in f.nodes] == [True, True]  # type: ignore[attr-defined]
        assert f.server.world.scenario.aircraft[1].mission == f"receiver_{grade}"
    f = g.Flying("refueling", 3, nominal.long_settings("tactical", 0.94, 1800.0))
    orders = [(e.t_s, e.action) for e in f.server.world.scenario.event]
    assert orders == [(20.0, "precontact"), (40.0, "contact"), (900.0, "disconnect"), (1200.0, "contact")]
    case = next(c for c in STUDY.cases if "long_s" in c.params)
    v = STUDY.run(replace(case, params=case.params | {"long_s": 2.0}), 3).values
    assert v["watched_s"] == pytest.approx(2.0) and v["alerts"] == v["breakaways"] == v["is.lost"] == 0.0


def test_contact_not_reached_is_an_outcome() -> None:
    case = Case("x", {"grade": "paper", "sigma_mps": 0.39, "times": {"arrive_s": 0.2}})
    v = g.run_case(case, 3).values
    assert v["is.not_reached"] == 1.0 and sum(v[f"is.{o}"] for o in g.OUTCOMES) == 1.0


def test_study_and_page_have_every_grade_level_and_outcome(tmp_path: Path) -> None:
    assert registry.find("grades") is STUDY and list(OUTCOMES) == list(g.OUTCOMES) == list(STUDY.binary)
    assert len(STUDY.cases) == 22
    rows = []
    for case in STUDY.cases:
        for run in range(4):
            kept = run < 3
            values = {f"is.{o}": float(o == ("kept" if kept else "lost")) for o in g.OUTCOMES}
            values |= {"contact.s": 150.0, "contact.rms_m.x": 0.25, "wind.inside_3sigma_pct": 50.0} if kept else {}
            values |= {"alerts": float(run), "breakaways": float(run == 3), "watched_s": 1800.0}
            rows.append(Row(case.name, run, run, "ok", "", values))
    folder = tmp_path / "c"
    folder.mkdir()
    results.write_parquet(folder / results.PARQUET, rows, 1)
    results.write_summary(folder / results.SUMMARY, rows, STUDY.binary)
    folders.write_meta(folder, folders.new_meta(None, STUDY, 1, 4, STUDY.cases))
    text = grades_report([folder], tmp_path / "out").read_text()
    low, high = results.share_interval([1.0, 1.0, 1.0, 0.0]) or (0.0, 0.0)
    assert text.count(f"0.750<small>{low:.3f} … {high:.3f}</small>") == 21
    assert text.count('<tr class="group">') == 8 * 4 and text.count('data-key="mems_6.22.is.lost.mean"') == 1
    assert text.count('data-key="tactical_0.94.contact.rms_m.x.rms" data-value="0.25"') == 1
    assert text.count("1.41 to 7.21") == 6  # six doubts and a breakaway in two hours, six cases with bounds


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
