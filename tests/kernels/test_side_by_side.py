"""Sums worked out four at a time are, to the bit, the sums of one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.filters.correction import cross_covariance, joseph
from flightsw.kernels import linalg
from flightsw.kernels.products import add_symmetric, block_product

SIZES = [1, 2, 3, 4, 5, 7, 8, 9, 11]


def total(a: np.ndarray, b: np.ndarray, start: float = 0.0) -> float:
    """start + a_1 b_1 + a_2 b_2 ..., in this order."""
    s = start
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        s += x * y
    return s


def products(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A B."""
    return np.array([[total(a, b) for b in B.T] for a in A])


@pytest.mark.parametrize("n", SIZES)
def test_products_and_vectors(n: int) -> None:
    r = np.random.default_rng(n)
    A, B, x = r.normal(size=(n, 5)), r.normal(size=(5, n)), r.normal(size=5)
    out, whole, v = np.full((n, n), np.nan), np.full((n + 1, n + 1), 7.0), np.full(n, np.nan)
    linalg.product(A, B, out)
    block_product(A, B, n, 4, n - 1, whole)
    linalg.matvec(A, x, v)
    np.testing.assert_array_equal(out, products(A, B))
    np.testing.assert_array_equal(whole[:n, : n - 1], products(A[:, :4], B[:4, : n - 1]).reshape(n, n - 1))
    assert (whole[n] == 7.0).all() and (whole[:, n - 1 :] == 7.0).all()
    np.testing.assert_array_equal(v, [total(a, x) for a in A])


@pytest.mark.parametrize("n", SIZES)
def test_symmetric_sums_touch_only_their_own(n: int) -> None:
    r = np.random.default_rng(n)
    A, whole = r.normal(size=(n, 6)), r.normal(size=(n + 2, n + 2))
    P = whole.copy()
    add_symmetric(A, A, n, 5, P)
    for i in range(n):
        for j in range(i + 1):
            assert P[i, j] == P[j, i] == total(A[i, :5], A[j, :5], whole[i, j])
    np.testing.assert_array_equal(P[n:], whole[n:])
    np.testing.assert_array_equal(P[:, n:], whole[:, n:])


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("m", [1, 3])
def test_josephs_form(n: int, m: int) -> None:
    r = np.random.default_rng(n)
    S = r.normal(size=(n, n))
    P, H, K, KR = products(S, S.T), r.normal(size=(m, n)), r.normal(size=(n, m)), r.normal(size=(n, m))
    PH = np.full((n, m), np.nan)
    cross_covariance(P, H, m, PH)
    np.testing.assert_array_equal(PH, products(P, H.T))
    A = np.array([[total(-K[i], H[:, j], float(i == j)) for j in range(n)] for i in range(n)])
    W = products(A, P)
    new = np.array([[total(KR[i], K[j], total(W[i], A[j])) for j in range(n)] for i in range(n)])
    joseph(P, H, m, K, KR, np.empty((n + 1, n + 1)), np.empty((n + 1, n + 1)))
    np.testing.assert_array_equal(np.tril(P), np.tril(new))
    np.testing.assert_array_equal(P, P.T)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_number_that_is_none_is_found(bad: float) -> None:
    for n in SIZES:
        x = np.ones(n)
        assert linalg.finite(x)
        for i in range(n):
            x[:] = 1.0
            x[i] = bad
            assert not linalg.finite(x)
