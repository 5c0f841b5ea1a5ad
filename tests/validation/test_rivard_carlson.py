"""Rivard (1982), section VI: the Carlson update equals the printed (21) to (25) and bears a word that is too short for them."""

from __future__ import annotations

import numpy as np
from filterpy.kalman import KalmanFilter
from hypothesis import given
from hypothesis import strategies as st

from hil_scripts.studies.rivard import carlson as c


@given(st.integers(0, 2**31), st.integers(1, 8), st.floats(-4.0, 4.0))
def test_equals_filterpy_and_the_printed_update(seed: int, n: int, decades: float) -> None:
    """Any covariance, any row, variances of the reading over eight decades: gain and covariance to rounding."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(n, n))
    P, h, r = a @ a.T + 0.05 * np.eye(n), rng.normal(size=n), 10.0**decades
    other = KalmanFilter(n, 1)
    other.P, other.H, other.R = P.copy(), h[None, :], np.array([[r]])
    other.update(np.zeros(1))
    S, K = c.carlson(c.upper(P), h, r)
    assert np.array_equal(S, np.triu(S)) and np.all(np.diag(S) > 0.0)
    scale = np.abs(P).max()
    assert np.allclose(S @ S.T, other.P, rtol=0.0, atol=1e-9 * scale)
    assert np.allclose(K, other.K[:, 0], rtol=1e-8, atol=1e-10)
    for form in c.FULL.values():
        got, gain = form(P, h, r)
        assert np.allclose(got, other.P, rtol=0.0, atol=1e-9 * scale) and np.allclose(gain, K, rtol=1e-8, atol=1e-10)


@given(st.integers(0, 2**31), st.integers(1, 8))
def test_root_carried_forward_is_that_of_the_printed_propagation(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    Phi, G, a = rng.normal(size=(3, n, n))
    P = a @ a.T + 0.05 * np.eye(n)
    S = c.carried(c.upper(P), Phi, G)
    assert np.array_equal(S, np.triu(S))
    want = Phi @ P @ Phi.T + G @ G.T
    assert np.allclose(S @ S.T, want, rtol=0.0, atol=1e-12 * np.abs(want).max() * n)


def test_two_readings_of_one_sum_leave_nothing_in_the_printed_form() -> None:
    """States of 6 NM and ranges of 0.2 m: the variance taken off is the variance to the last of 24 bits."""
    word = np.float32
    P = (np.eye(2) * 1e8).astype(word)
    h, r = np.ones(2, word), word(0.04)
    S, _ = c.carlson(c.upper(P).astype(word), h, float(r))
    S, _ = c.carlson(S, h, float(r))
    P, _ = c.printed(P, h, r)
    P, _ = c.printed(P, h, r)
    exact = 1.0 / (2.0 / 0.04 + 1.0 / 2e8)  # variance of the sum: two readings, and what was known of it
    got = float(h @ P @ h), float(np.sum((S.T.astype(float) @ h.astype(float)) ** 2))
    print(f"variance of the sum: exact {exact:.4f} m^2, printed {got[0]:.4f}, Carlson {got[1]:.4f}")
    assert abs(got[1] / exact - 1.0) < 1e-2
    assert abs(got[0] / exact - 1.0) > 0.1


def test_no_matter_with_the_source_s_sensor_and_all_the_difference_with_a_better_one() -> None:
    """24 bits of mantissa against double, ranges of a head-on flight fused one after the other."""
    for s in c.SETTINGS:
        true = c.covariances(s, "carlson", np.float64)
        assert np.allclose(true, c.covariances(s, "printed", np.float64), rtol=1e-4, atol=1e-6 * np.abs(true).max())
        full, root = (c.judge(c.covariances(s, form, np.float32), true) for form in ("printed", "carlson"))
        print(f"{s.text}: printed {full}, Carlson {root}")
        assert root.lost == 0 and root.sigma_error < 2e-3
        if s.sigma_m > 100.0:
            assert full.lost == 0 and full.sigma_error < 1e-4
        if s.sigma_m < 1.0:
            assert full.lost > 10
        if s.sigma_m < 1.0 and s.noise == 0.0:
            assert full.sigma_error > 0.5
