"""The campaign `identify`: shares of intervals that hold, pooled over flights, and their page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ground.report.identify.build import identify_report
from hil_scripts.campaign import folder as folders
from hil_scripts.campaign import registry
from hil_scripts.campaign import table as results
from hil_scripts.campaign.task import Row
from hil_scripts.identify.flight.gusts import KNOT_S, LENGTH_M, Gusts
from hil_scripts.identify.flight.model import COEFFICIENTS
from hil_scripts.studies.identify.flight import pooled
from hil_scripts.studies.identify.study import STUDY


def one(holds: bool, identified: bool = True) -> dict[str, float]:
    out = {}
    for k in COEFFICIENTS:
        out |= {f"{k}.alone": 1.0, f"{k}.identified": float(identified or k != "CY_p"), f"{k}.holds": 1.0}
        out |= {f"{k}.off_sigma": 1.0, f"{k}.half_pct": 5.0}
    return out | {"CL0.holds": float(holds)}


def test_coverage_is_of_what_is_identified() -> None:
    v = pooled([one(True, False), one(False, False), one(True), one(True)])
    n = 4 * len(COEFFICIENTS) - 2
    assert v["coverage"] == pytest.approx((n - 1) / n)
    assert v["identified_per_run"] == n / 4
    assert (v["CY_p.identified"], v["CL0.identified"], v["CL0.coverage"]) == (2, 4, 0.75)
    low, high = results.share_interval([1.0] * (n - 1) + [0.0]) or (0.0, 0.0)
    assert (v["coverage_wilson_lo"], v["coverage_wilson_hi"]) == pytest.approx((low, high))


def test_page_has_every_coefficient(tmp_path: Path) -> None:
    assert registry.find("identify") is STUDY
    rows = [Row(case.name, run, run, "ok", "", one(run > 0)) for case in STUDY.cases for run in range(4)]
    folder = tmp_path / "c"
    folder.mkdir()
    results.write_parquet(folder / results.PARQUET, rows, 1)
    results.write_summary(folder / results.SUMMARY, rows, STUDY.binary, STUDY.pool)
    folders.write_meta(folder, folders.new_meta(None, STUDY, 1, 4, STUDY.cases))
    text = identify_report([folder], tmp_path / "out").read_text()
    assert all(text.count(f">{k}<") == len(STUDY.cases) for k in COEFFICIENTS)


def test_gusts_are_expected_as_a_first_order_process() -> None:
    """The information is the inverse of the covariance a^|i - j| of unit variance; between knots the wind goes straight."""
    g = Gusts(195.0)
    g.spread(400, 0.01)
    a = np.exp(-KNOT_S * 195.0 / LENGTH_M)
    i = np.arange(g.knots)
    assert np.linalg.inv(g.unit()) == pytest.approx(a ** np.abs(i[:, None] - i))
    w = np.arange(3.0 * g.knots)
    along = g.along(w)
    assert along.shape == (401, 3)
    assert along[50] == pytest.approx(0.5 * (w[:3] + w[3:6]))
    assert along[-1] == pytest.approx(w[12:15])


def test_intensity_of_gusts_is_learnt() -> None:
    """From gusts known exactly it is their own; the uncertainty of the gusts adds to it."""
    rng = np.random.default_rng(1)
    g = Gusts(195.0)
    g.spread(40000, 0.01)
    C = np.linalg.inv(g.unit())
    w = (np.linalg.cholesky(C) @ rng.standard_normal((g.knots, 3)) * 0.8).ravel()
    none = np.zeros((len(w), len(w)))
    g.learn(w, none)
    known = g.sigma
    assert known == pytest.approx(0.8, rel=0.06)
    g.learn(w, np.kron(C, np.eye(3)) * 0.09)
    assert g.sigma == pytest.approx(np.hypot(known, 0.3))
