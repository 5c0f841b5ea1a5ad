"""The shared measurement updates against the textbook's matrices, and Joseph's form where the short one fails."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightsw.filters import correction as c

Array = np.ndarray


def prior(seed: int, n: int) -> tuple[np.random.Generator, Array, Array]:
    r = np.random.default_rng(seed)
    a = r.normal(size=(n, n))
    return r, r.normal(size=n), a @ a.T + 0.1 * np.eye(n)


@given(st.integers(0, 2**31), st.integers(1, 8), st.integers(1, 4))
def test_rows_in_josephs_form_for_any_gain(seed: int, n: int, m: int) -> None:
    r, _, P = prior(seed, n)
    H, K = r.normal(size=(2, m, n))
    K = np.ascontiguousarray(K.T)
    b = r.normal(size=(m, m))
    R = b @ b.T
    I_KH = np.eye(n) - K @ H
    want, PH, S = I_KH @ P @ I_KH.T + K @ R @ K.T, np.zeros((n, m)), R.copy()
    c.cross_covariance(P, H, m, PH)
    assert np.allclose(PH, P @ H.T)
    c.innovation_covariance(H, PH, m, S)
    assert np.allclose(S, H @ P @ H.T + R) and np.array_equal(S, S.T)
    c.joseph(P, H, m, K, K @ R, np.zeros((n, n)), np.zeros((n, n)))
    assert np.allclose(P, want, rtol=1e-9, atol=1e-9) and np.array_equal(P, P.T)


@given(st.integers(0, 2**31), st.integers(1, 8))
def test_one_scalar_equals_the_textbook_filter(seed: int, n: int) -> None:
    r, x, P = prior(seed, n)
    h, nu, R = r.normal(size=n), r.normal(), r.uniform(0.1, 2.0)
    S = h @ P @ h + R
    want_x, want_P = x + P @ h / S * nu, P - np.outer(P @ h, P @ h) / S
    c.scalar_update(x, P, P @ h, nu, S)
    assert np.allclose(x, want_x) and np.allclose(P, want_P, atol=1e-9) and np.array_equal(P, P.T)


@given(st.integers(0, 2**31), st.integers(1, 8))
def test_a_state_read_directly_and_a_reading_beyond_the_gate(seed: int, n: int) -> None:
    r, x, P = prior(seed, n)
    i = int(r.integers(n))
    x0, P0, h = x.copy(), P.copy(), np.eye(n)[i]
    s, d = P[i, i] + 0.25, x[i] + r.normal() - x[i]
    work = np.zeros(n, dtype=np.int64), np.zeros(n), np.zeros(n)
    assert c.state_update(x, P, i, -1, x[i] + d, 0.25, 1e9, *work) == pytest.approx(d * d / s, rel=1e-6)
    assert np.allclose(x, x0 + P0[:, i] / s * d) and np.allclose(
        P, (np.eye(n) - np.outer(P0[:, i] / s, h)) @ P0, atol=1e-9
    )
    x0, P0 = x.copy(), P.copy()
    assert c.state_update(x, P, i, -1, 1e3, 0.25, 25.0, *work) > 25.0
    assert np.array_equal(x, x0) and np.array_equal(P, P0)


def test_josephs_form_stays_positive_where_the_short_one_does_not() -> None:
    """Bierman (1977), ch. V: a prior 1e8 times wider than the reading."""
    P, H = 1e16 * np.array([[1.0, 1.0 - 1e-12], [1.0 - 1e-12, 1.0]]), np.array([[1.0, 0.5]])
    K, S = np.zeros((2, 1)), np.ones((1, 1))
    c.cross_covariance(P, H, 1, K)
    c.innovation_covariance(H, K, 1, S)
    K /= S
    short = (np.eye(2) - K @ H) @ P
    c.joseph(P, H, 1, K, K.copy(), np.zeros((2, 2)), np.zeros((2, 2)))
    assert not np.array_equal(short, short.T)
    assert np.array_equal(P, P.T) and (np.diag(P) >= 0.0).all()
