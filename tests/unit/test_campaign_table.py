"""Statistics of campaigns against SciPy and against their meaning."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy import stats

from hil_scripts.campaign.study import CampaignError
from hil_scripts.campaign.table import mean_interval, ordered, share_interval, statistics, summarise
from hil_scripts.campaign.task import Row

SAMPLE = [float(x) for x in np.random.default_rng(3).normal(2.0, 0.4, 20)]


def test_mean_interval_is_students() -> None:
    """The interval of the mean equals SciPy's."""
    want = stats.t.interval(0.95, len(SAMPLE) - 1, loc=np.mean(SAMPLE), scale=stats.sem(SAMPLE))
    assert mean_interval(SAMPLE) == pytest.approx(want, rel=1e-12)
    assert mean_interval([1.0]) is None


@pytest.mark.parametrize(("k", "n"), [(0, 20), (3, 20), (20, 20), (1, 1)])
def test_share_interval_is_wilsons(k: int, n: int) -> None:
    """The interval of a share equals SciPy's Wilson interval, also for none and for all."""
    want = stats.binomtest(k, n).proportion_ci(0.95, method="wilson")
    assert share_interval([1.0] * k + [0.0] * (n - k)) == pytest.approx((want.low, want.high), abs=1e-12)


def test_mean_interval_covers() -> None:
    """In 2000 samples of 10 the interval holds the true mean about 95 % of the time."""
    draws = np.random.default_rng(1).normal(5.0, 2.0, (2000, 10))
    hits = [lo <= 5.0 <= hi for lo, hi in (mean_interval(list(d)) or (0, 0) for d in draws)]
    assert 0.93 < np.mean(hits) < 0.97


def test_statistics_of_a_sample() -> None:
    """Mean, RMS and percentile are NumPy's; the RMS lies inside its interval."""
    s = statistics(SAMPLE, binary=False)
    assert s["mean"] == np.mean(SAMPLE) and s["p95"] == np.percentile(SAMPLE, 95) and s["n"] == 20
    assert s["rms"] == pytest.approx(math.sqrt(np.mean(np.square(SAMPLE))), rel=1e-15)
    assert s["rms_ci95_lo"] < s["rms"] < s["rms_ci95_hi"]  # type: ignore[operator]
    assert "nonfinite" not in s


def test_values_that_are_not_finite_are_counted_not_averaged() -> None:
    """Infinity (never converged) leaves the mean and shows as nonfinite; nothing left gives nulls."""
    s = statistics([1.0, math.inf, 3.0, math.nan], binary=False)
    assert (s["mean"], s["n"], s["nonfinite"]) == (2.0, 2, 2)
    assert statistics([math.inf], binary=False)["mean"] is None


def test_lost_gets_a_share_interval() -> None:
    """Values named as binary never have a negative bound."""
    rows = [Row("c", i, i, "ok", values={"est.lost": float(i == 0), "est.x": 1.0}) for i in range(20)]
    flat = summarise(rows)
    assert flat["c.est.lost.mean"] == 0.05 and 0.0 < flat["c.est.lost.ci95_lo"] < 0.05 < flat["c.est.lost.ci95_hi"]


def test_rows_are_ordered_and_single() -> None:
    """By case and run, whatever the order of arrival; a repeated key counts once, the first time."""
    rows = [Row("b", 0, 1, "ok"), Row("a", 10, 1, "ok"), Row("a", 2, 1, "ok"), Row("a", 2, 1, "failed")]
    assert [(r.case, r.run, r.status) for r in ordered(rows)] == [("a", 2, "ok"), ("a", 10, "ok"), ("b", 0, "ok")]


def test_summary_keys_cannot_collide() -> None:
    """Case "G_0" with value "3.x" and case "G_0.3" with value "x" would share a key."""
    with pytest.raises(CampaignError, match="arises twice"):
        summarise([Row("G_0", 0, 1, "ok", values={"3.x": 1.0}), Row("G_0.3", 0, 1, "ok", values={"x": 1.0})])


def test_pooled_figures_replace_the_statistics_over_runs() -> None:
    """A study of batches sums them itself, from its good runs in order; what is not finite becomes null."""
    rows = [Row("c", i, i, "failed" if i == 2 else "ok", values={"n": 10.0, "s": float(i)}) for i in range(4)]
    seen = []

    def pool(runs: Sequence[Mapping[str, float]]) -> dict[str, float | int | None]:
        seen.append([r["s"] for r in runs])
        return {"s.mean": sum(r["s"] for r in runs) / len(runs), "s.n": 30, "s.ci95_lo": math.nan}

    flat = summarise(rows[::-1], pool=pool)
    assert seen == [[0.0, 1.0, 3.0]]
    assert flat == {"c.runs": 4, "c.failed": 1, "c.s.mean": 4.0 / 3.0, "c.s.n": 30, "c.s.ci95_lo": None}
