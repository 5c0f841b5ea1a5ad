"""Onboard triangular factors and substitutions against numpy and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_triangular

from flightsw.kernels.linalg import backward_sub_t, forward_sub, tria

repeatable = settings(deadline=None, derandomize=True)  # no timed verdicts, the same examples every run
sizes = st.tuples(st.integers(1, 15), st.integers(0, 20), st.integers(0, 2**31))


def factor(A: np.ndarray) -> np.ndarray:
    n, k = A.shape
    L = np.full((n, n), np.nan)
    tria(A.copy(), n, k, L)
    return L


@repeatable
@given(sizes)
def test_factor_is_numpys_qr_and_cholesky(size: tuple[int, int, int]) -> None:
    n, extra, seed = size
    A = np.random.default_rng(seed).normal(size=(n, n + extra))
    L = factor(A)
    assert not np.triu(L, 1).any()
    assert (np.diag(L) >= 0).all()
    R = np.linalg.qr(A.T, mode="r").T
    want = R * np.sign(np.diag(R))  # columns with a positive diagonal
    assert np.abs(L - want).max() < 1e-11 * np.abs(A).max() * (1 + np.linalg.cond(A))
    assert np.abs(L @ L.T - A @ A.T).max() < 1e-12 * max(1.0, np.abs(A @ A.T).max())
    assert np.abs(L - np.linalg.cholesky(A @ A.T)).max() < 1e-8 * (1 + np.linalg.cond(A) ** 2 * 1e-6)


def test_a_column_order_change_leaves_the_factor() -> None:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(6, 19))
    assert np.abs(factor(A) - factor(A[:, rng.permutation(19)])).max() < 1e-13


@pytest.mark.parametrize("rank", [0, 1, 3])
def test_a_rank_deficient_input_gives_a_finite_factor(rank: int) -> None:
    rng = np.random.default_rng(rank)
    A = rng.normal(size=(5, rank)) @ rng.normal(size=(rank, 9))
    L = factor(A)
    assert np.isfinite(L).all()
    assert np.abs(L @ L.T - A @ A.T).max() < 1e-12 * max(1.0, np.abs(A @ A.T).max())


def test_columns_of_very_different_size_keep_the_small_ones() -> None:
    """Twelve orders of magnitude between two directions: a factor of the covariance would have lost the small one."""
    A = np.array([[1e6, 1e6, 0.0], [1e6, 1e6 + 1e-3, 1e-6]])
    L = factor(A)
    # exact second diagonal: distance of row 2 from the span of row 1
    u = A[0] / np.linalg.norm(A[0])
    want = np.linalg.norm(A[1] - (A[1] @ u) * u)
    assert L[1, 1] == pytest.approx(want, rel=1e-6)


@repeatable
@given(sizes)
def test_substitutions_are_scipys(size: tuple[int, int, int]) -> None:
    n, _, seed = size
    rng = np.random.default_rng(seed)
    L = np.tril(rng.normal(size=(n, n)) * 0.3) + 2.0 * np.eye(n)
    b = rng.normal(size=n)
    x, y = b.copy(), b.copy()
    forward_sub(L, n, x)
    backward_sub_t(L, n, y)
    assert np.allclose(x, solve_triangular(L, b, lower=True), rtol=1e-10, atol=1e-12)
    assert np.allclose(y, solve_triangular(L.T, b, lower=False), rtol=1e-10, atol=1e-12)
