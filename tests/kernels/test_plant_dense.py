"""The plant's sampled linear systems against scipy, closed forms and the onboard software's own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm, solve_continuous_lyapunov

from flightsw.kernels.sampled import sampled
from sim_plant.kernels.dense import lower_factor, sample, settle, times
from sim_plant.wind.dryden import factor, noise_factor, shaping, stationary_draw

repeatable = settings(deadline=None, derandomize=True)


@repeatable
@given(st.integers(1, 6), st.floats(0.001, 5.0), st.integers(0, 2**31))
def test_transition_and_noise_are_those_of_the_exponential_and_of_lyapunov(n: int, dt: float, seed: int) -> None:
    """Q = P - F P F^T with the stationary P: exact for any step, a loss of digits only for short ones."""
    r = np.random.default_rng(seed)
    a = r.normal(size=(n, n)) - 3.0 * np.eye(n) * math.sqrt(n)
    b = r.normal(size=(n, n))
    f, q = np.zeros((n, n)), np.zeros((n, n))
    sample(a, b @ b.T, dt, f, q)
    p = solve_continuous_lyapunov(a, -b @ b.T)
    assert f == pytest.approx(expm(a * dt), rel=1e-10, abs=1e-12)
    assert np.abs(q - (p - f @ p @ f.T)).max() < 1e-11 * np.abs(p).max()
    F, _, Q = sampled(a, None, b @ b.T, dt)
    assert f == pytest.approx(F, rel=1e-10, abs=1e-13) and q == pytest.approx(Q, rel=1e-10, abs=1e-13)
    limit = q.copy()
    assert settle(f.copy(), limit)
    assert limit == pytest.approx(p, rel=1e-9, abs=1e-11 * np.abs(p).max())


def test_what_does_not_decay_has_no_stationary_state() -> None:
    assert not settle(np.eye(1), np.eye(1))
    with pytest.raises(ArithmeticError, match="does not decay"):
        stationary_draw(np.eye(1), np.eye(1), np.random.default_rng(0))


def test_lower_factor_is_numpys_and_refuses_the_indefinite() -> None:
    r = np.random.default_rng(2)
    w = r.normal(size=(5, 7))
    p, low = w @ w.T, np.full((5, 5), np.nan)
    assert lower_factor(p, low)
    assert low == pytest.approx(np.linalg.cholesky(p), rel=1e-10)
    assert not lower_factor(np.diag([1.0, -1.0]), np.zeros((2, 2)))
    with pytest.raises(ArithmeticError, match="not positive definite"):
        factor(np.diag([1.0, 0.0]))


def test_drawn_states_have_the_stationary_covariance() -> None:
    """4000 draws of the Dryden states, unit variance each way: chi-square bounds on every whitened component."""
    a, bbt, _ = shaping(195.0, 533.4, 0.39)
    f, q = np.zeros((5, 5)), np.zeros((5, 5))
    sample(a, bbt, 0.01, f, q)
    rng = np.random.default_rng(5)
    x = np.array([stationary_draw(f, q, rng) for _ in range(4000)])
    z = np.linalg.solve(np.linalg.cholesky(solve_continuous_lyapunov(a, -bbt)), x.T)
    assert np.abs(z @ z.T / 4000 - np.eye(5)).max() < 5.0 * math.sqrt(2.0 / 4000)


def test_noise_factor_reproduces_the_covariance_of_a_short_step() -> None:
    a, bbt, _ = shaping(195.0, 533.4, 0.39)
    f, q = np.zeros((5, 5)), np.zeros((5, 5))
    sample(a, bbt, 1e-3, f, q)
    low, back = noise_factor(q), np.zeros((5, 5))
    times(low, np.ascontiguousarray(low.T), back)
    size = np.sqrt(np.outer(np.diag(q), np.diag(q)))
    assert (np.abs(back - q) / size).max() < 1e-12
