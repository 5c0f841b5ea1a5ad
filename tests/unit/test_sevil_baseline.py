"""Figures of the printed position in flight: lag against scipy's moving mean, errors and holds of made-up flights."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from hil_scripts.studies.sevil import baseline as b
from hil_scripts.studies.sevil.loop_flight import BREAKAWAY, CONTACT, TO_CONTACT, Track

N = round(20 * (b.LOST_S + b.FOR_S))
T = np.arange(N) / 20.0


def flight(error: np.ndarray, valid: np.ndarray, leaves_s: float = math.inf) -> Track:
    """At contact from 25 s on, half a metre off its place in x; breaks away at leaves_s."""
    phase = np.where(leaves_s <= T, BREAKAWAY, np.where(T < 25.0, TO_CONTACT, CONTACT))
    xi = np.tile([-35.6, 0.0, 6.9], (N, 1))
    wake = xi + np.column_stack([np.zeros(N), error])
    wake[~valid, 1:] = math.nan
    z, no = np.zeros(N), np.zeros(N, dtype=bool)
    return Track(
        t=T, phase=phase, xi=xi, nav=xi, ref=xi - (0.5, 0.0, 0.0), wake=wake, sigma=np.ones((N, 2)), cov_yz=z, valid=valid,
        held=no, rel_valid=~no, excluded=z.astype(int), alarm=z.astype(int), nis=z, bank=z, learnt=np.zeros((N, 3)),
    )  # fmt: skip


@pytest.mark.parametrize("n", [1, 11, 41])
def test_lag_of_a_moving_mean(n: int) -> None:
    """Half of its window less one sample: symmetric about its middle, by scipy's centred mean moved back."""
    g = np.random.default_rng(n)
    y = uniform_filter1d(g.normal(size=N).cumsum(), 60)  # smooth
    late = np.roll(uniform_filter1d(y, n), (n - 1) // 2)
    got = b.lag(T, late, y, (T > 10.0) & (T < 60.0))
    assert got == pytest.approx((n - 1) / 2 / 20.0, abs=0.06)
    gaps = np.where(g.random(N) < 0.3, math.nan, late)
    assert b.lag(T, gaps, y, (T > 10.0) & (T < 60.0)) == pytest.approx(got, abs=0.06)
    assert math.isnan(b.lag(T, late, y, T < 1.0))


def test_errors_count_where_there_is_a_position() -> None:
    valid = np.arange(N) % 4 != 0
    error = np.tile([0.3, -0.4], (N, 1))
    error[T < 28.0] = 99.0  # before it has settled
    f = b.figures(flight(error, valid))
    assert f["contact.available_pct"] == pytest.approx(75.0, abs=0.3)
    assert (f["contact.rms_m"], f["contact.rms_m.y"], f["contact.rms_m.z"]) == pytest.approx((0.5, 0.3, 0.4))
    assert (f["contact.p95_m.y"], f["contact.p95_m.z"], f["contact.mean_m.z"]) == pytest.approx((0.3, 0.4, -0.4))
    assert (f["breakaway"], f["lost.kept_s"]) == (0.0, b.FOR_S)
    assert f["lost.station.rms_m"] == f["lost.station.max_m"] == pytest.approx(0.5)


def test_a_flight_that_leaves_counts_until_then() -> None:
    error = np.zeros((N, 2))
    error[b.LOST_S + 3.0 <= T] = 50.0
    f = b.figures(flight(error, np.ones(N, dtype=bool), b.LOST_S + 3.0))
    assert f["breakaway"] == 1.0 and f["lost.kept_s"] == pytest.approx(3.0)
    assert f["lost.rms_m"] == 0.0 and f["contact.reached"] == 1.0


def test_a_flight_without_any_position_says_so() -> None:
    f = b.figures(flight(np.zeros((N, 2)), np.zeros(N, dtype=bool)))
    assert f["contact.available_pct"] == 0.0 and "contact.rms_m" not in f
