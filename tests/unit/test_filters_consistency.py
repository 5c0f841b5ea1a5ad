"""Statistics of the reports: each against its definition or a simulation with known answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, kstest

from hil_scripts.campaign.consistency import (
    chi2_band,
    convergence_time,
    nees,
    nis,
    percentiles,
    rms,
    rms_bootstrap,
    rms_interval,
    share_in_band,
    share_inside,
)


def test_nees_of_gaussian_errors_is_chi_square() -> None:
    rng = np.random.default_rng(0)
    a = rng.normal(size=(4, 4))
    P = a @ a.T + 0.1 * np.eye(4)
    e = rng.normal(size=(20_000, 4)) @ np.linalg.cholesky(P).T
    v = nees(e, np.broadcast_to(P, (20_000, 4, 4)))
    assert kstest(v, chi2(4).cdf).pvalue > 1e-3
    assert v[7] == pytest.approx(e[7] @ np.linalg.inv(P) @ e[7])
    assert nis is nees
    with pytest.raises(np.linalg.LinAlgError):
        nees(np.ones(2), np.diag([1.0, -1.0]))


@pytest.mark.parametrize(("dof", "runs"), [(3, 1), (15, 20), (12, 100)])
def test_band_holds_its_confidence(dof: int, runs: int) -> None:
    rng = np.random.default_rng(1)
    mean = rng.chisquare(dof, size=(20_000, runs)).mean(axis=1)
    assert share_in_band(mean, dof, runs) == pytest.approx(0.95, abs=0.006)
    lo, hi = chi2_band(dof, runs)
    assert lo < dof < hi


def test_band_of_the_textbook() -> None:
    """Bar-Shalom, Li, Kirubarajan, sec. 5.4: 50 runs, 2 states, 95 %: [1.5, 2.6]."""
    assert chi2_band(2, 50) == pytest.approx((1.484, 2.591), abs=2e-3)
    with pytest.raises(ValueError, match="dof=0"):
        chi2_band(0)


def test_share_inside_counts_nan_as_outside() -> None:
    e = np.array([0.0, 2.9, -3.1, math.nan])
    assert share_inside(e, np.ones(4)) == 0.5
    assert share_inside(np.array([1.0, 4.0]), 2.0, k=1.0) == 0.5


def test_convergence_time_by_hand() -> None:
    t = 10.0 + np.arange(10) * 0.5
    e = np.array([9.0, 0.1, 9.0, 0.1, 0.1, 0.1, 9.0, 0.1, 0.1, 0.1])
    assert convergence_time(t, e, 1.0, 0.0) == 0.5
    assert convergence_time(t, e, 1.0, 1.0) == 1.5
    assert convergence_time(t, e, 1.0, math.inf) == 3.5
    assert math.isnan(convergence_time(t, e, 1.0, 1.5))  # no 1.5 s inside; the last stretch is 1 s
    assert convergence_time(t, -e, np.full(10, 9.0), 4.5) == 0.0  # on the bound is inside
    assert math.isnan(convergence_time(t, np.full(10, math.nan), 1.0, 0.0))
    assert math.isnan(convergence_time(np.zeros(0), np.zeros(0), 1.0, 0.0))


@given(st.lists(st.booleans(), min_size=1, max_size=30), st.integers(0, 10))
def test_convergence_time_against_a_plain_search(outside: list[bool], hold: int) -> None:
    t = np.arange(len(outside), dtype=float)
    want = math.nan
    for i in range(len(outside) - hold):
        if not any(outside[i : i + hold + 1]):
            want = float(i)
            break
    got = convergence_time(t, np.where(outside, 2.0, 0.0), 1.0, float(hold))
    assert got == want or (math.isnan(got) and math.isnan(want))


def test_rms_and_its_intervals_cover() -> None:
    """Runs of correlated samples: the 95 % intervals contain the true RMS in 95 % of 1000 experiments of 40 runs."""
    rng = np.random.default_rng(3)
    hits = {"normal": 0, "bootstrap": 0}
    for _ in range(1000):
        per_run = rms(rng.normal(size=(40, 1)) * np.ones((1, 5)) + rng.normal(size=(40, 5)), axis=1)
        for name, (v, lo, hi) in (
            ("normal", rms_interval(per_run)),
            ("bootstrap", rms_bootstrap(per_run, rng, draws=300)),
        ):
            assert lo <= v <= hi
            hits[name] += lo <= math.sqrt(2.0) <= hi
    # 40 runs: both are a little short of nominal, as both must be for a skewed mean square
    assert 900 < hits["normal"] < 965
    assert 890 < hits["bootstrap"] < 965


def test_rms_of_one_or_no_run() -> None:
    v, lo, hi = rms_interval([2.0])
    assert v == 2.0
    assert math.isnan(lo)
    assert math.isnan(hi)
    with pytest.raises(ValueError, match="0 runs"):
        rms_interval([])
    with pytest.raises(ValueError, match="0 runs"):
        rms_bootstrap([], np.random.default_rng(0))
    assert rms(np.array([[3.0, 4.0]])) == pytest.approx(math.sqrt(12.5))


def test_percentiles_use_magnitudes_of_finite_samples() -> None:
    assert percentiles(np.array([-1.0, 2.0, -3.0, math.nan]), (50.0, 100.0)) == (2.0, 3.0)
    assert all(math.isnan(v) for v in percentiles(np.array([math.nan])))
