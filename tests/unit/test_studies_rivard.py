"""The rendezvous study: batches add up to one sample, intervals cover, every case runs, one flight repeats the Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from hil_scripts.campaign.registry import find
from hil_scripts.campaign.study import Case
from hil_scripts.campaign.table import summarise
from hil_scripts.campaign.task import Row
from hil_scripts.studies.rivard import kernel as rk
from hil_scripts.studies.rivard.cases import case as setting
from hil_scripts.studies.rivard.flight import fly_one
from hil_scripts.studies.rivard.mc import NM, run_case
from hil_scripts.studies.rivard.pool import batch, pooled, spread
from hil_scripts.studies.rivard.study import PRINTED, STUDY, run_batch


def _run(name: str, n: int, seed: int = 3) -> dict[str, float]:
    c = next(c for c in STUDY.cases if c.name == name)
    return run_batch(Case(name, c.params | {"batch": n}), seed).values


def test_study_is_registered_and_every_case_names_a_setting() -> None:
    assert find("rivard") is STUDY
    assert {c.params["setting"] for c in STUDY.cases} == {c.name for c in STUDY.cases}
    for c in STUDY.cases:
        setting(c.name)
    assert set(PRINTED) <= {c.name for c in STUDY.cases}


@pytest.mark.parametrize("name", [c.name for c in STUDY.cases])
def test_every_case_runs_and_is_finite(name: str) -> None:
    v = _run(name, 24)
    assert v["n"] == 24.0 and v["done"] >= 20.0
    out = pooled([v, v])
    assert out["rendezvous"] == 48
    for key in ("x.rms_m.rms", "y.rms_m.rms", "outside.mean", "alarm.any.mean", "turn.end_s.mean"):
        assert math.isfinite(float(out[key] or 0.0)), key


def test_pooled_batches_equal_one_sample() -> None:
    """Mean, sigma and RMS of three batches are those of their rendezvous taken together; unequal sizes, some unfinished."""
    rows = [run_case(setting("gain_printed_12"), n, seed) for n, seed in ((300, 1), (200, 2), (100, 9))]
    out = pooled([batch(r) for r in rows])
    all_ = np.concatenate([r.rows for r in rows])
    good = all_[all_[:, rk.R_DONE] > 0.0]
    assert out["rendezvous"] == 600 and out["x.rms_m.n"] == len(good) < 600
    assert out["unfinished.mean"] == pytest.approx(1.0 - len(good) / 600)
    for axis, v in (("x", good[:, rk.R_XM]), ("y", good[:, rk.R_YM])):
        assert out[f"{axis}.mean_m.mean"] == pytest.approx(v.mean(), rel=1e-9)
        assert out[f"{axis}.sigma_m.mean"] == pytest.approx(v.std(), rel=1e-9)
        assert out[f"{axis}.rms_m.rms"] == pytest.approx(math.sqrt((v * v).mean()), rel=1e-9)
    lo, hi = stats.binomtest(600 - len(good), 600).proportion_ci(0.95, "exact")
    assert (out["unfinished.ci95_lo"], out["unfinished.ci95_hi"]) == pytest.approx((lo, hi), abs=1e-9)


def test_intervals_cover_the_truth_of_a_normal_sample() -> None:
    """95 % intervals of mean, sigma and RMS of N(1, 2) hold the truth in about 95 % of 400 samples of 500."""
    g = np.random.default_rng(5)
    hits = np.zeros(3)
    for _ in range(400):
        v = g.normal(1.0, 2.0, 500)
        out: dict[str, float | int | None] = {}
        spread(out, "v", "m", 500.0, [float(np.mean(v**k)) for k in range(1, 5)])
        ends = (("mean_m.ci95", 1.0), ("sigma_m.ci95", 2.0), ("rms_m.rms_ci95", math.sqrt(5.0)))
        hits += [float(out[f"v.{k}_lo"] or 0) <= x <= float(out[f"v.{k}_hi"] or 0) for k, x in ends]
    assert np.all((hits / 400 > 0.92) & (hits / 400 < 0.98))


def test_same_seed_same_values_and_summary_keys() -> None:
    a, b = _run("b7re", 30), _run("b7re", 30)
    assert a == b
    flat = summarise([Row("b7re", 0, 3, "ok", values=a)], pool=STUDY.pool)
    assert flat["b7re.runs"] == 1 and flat["b7re.x.rms_m.n"] == 30 and flat["b7re.rendezvous"] == 30
    assert flat["b7re.t160.nees3.n"] == 30 and "b7re.x.moment2.mean" not in flat
    bad = [Row("c", 0, 3, "failed")]
    assert summarise(bad, pool=STUDY.pool) == {"c.runs": 1, "c.failed": 1}


def test_tables_of_thirty_lie_around_the_batch_and_y_has_the_sign_of_the_print() -> None:
    v = _run("open", 600)
    assert v["x.table30.mean_lo_m"] < v["x.moment1"] < v["x.table30.mean_hi_m"]
    assert v["y.table30.mean_lo_m"] < -v["y.moment1"] < v["y.table30.mean_hi_m"]
    half = 1.96 * math.sqrt(v["x.moment2"] - v["x.moment1"] ** 2) / math.sqrt(30.0)  # of a mean of thirty
    assert v["x.table30.mean_hi_m"] - v["x.moment1"] == pytest.approx(half, rel=0.1)
    assert 0.0 <= v["x.table30.mean_below"] <= 1.0


def test_an_alarm_before_the_manoeuvre_is_not_a_detection() -> None:
    r = run_case(setting("turn_30"), 60, 4)
    v = batch(r, 60.0)
    assert v["alarm.early"] + v["alarm.late"] == v["alarm.any"] and v["alarm.late"] >= 55 and v["alarm.delay_s"] >= 0.0


def test_flight_for_the_picture_repeats_the_monte_carlo() -> None:
    """The onboard classes, stepped as in flight, end where the study's rendezvous of the same normals does, to a 0.5 s step."""
    c = setting("b7re")
    want = run_case(c, 1, 11).rows[0]
    tr = fly_one(c, 11)
    assert tr["track"][-1, 5] == 3.0 and tr["at"].shape[1:] == (15, 2)
    assert tr["miss"] == pytest.approx(want[[rk.R_XM, rk.R_YM]], abs=0.1 * NM)
    assert tr["weight"].sum(axis=1) == pytest.approx(1.0)
    with pytest.raises(ValueError, match="guidance period"):
        fly_one(setting("k3_a"), 1)


def test_bench_of_an_estimator_counts_its_arrays() -> None:
    from hil_scripts.bench.rendezvous import estimator_cost

    small, large = estimator_cost("ekf3", 3, 1), estimator_cost("bank", 15, 1)
    assert 0.0 < small.range_us <= small.worst_us and large.memory_bytes - small.memory_bytes == 8 * 14 * (
        8 + 64 + 1 + 8
    )
