"""What Lee 2011 prints about the filters and why it cannot be used as printed (lee.md errata E16-E18, traps 13, 14)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.filters.augmented import FilterFailureError
from flightsw.filters.factory import make_filter
from flightsw.filters.srukf_printed import PrintedSquareRootUKF, chol_downdate, chol_update
from flightsw.filters.ukf import weights

Array = np.ndarray


def spd(n: int, seed: int) -> Array:
    a = np.random.default_rng(seed).normal(size=(n, n))
    return a @ a.T + 0.1 * np.eye(n)


def sigma_points(x: Array, P: Array, L: int, g: float) -> Array:
    """2L+1 rows; columns beyond the state's own repeat the centre, as the noise points do."""
    n = len(x)
    X = np.tile(x, (2 * L + 1, 1))
    root = g * np.linalg.cholesky(P).T
    X[1 : 1 + n] += root
    X[1 + L : 1 + L + n] -= root
    return X


# --- E16: summation limit, first weight, rows of the point array -----------------------------------------------------
def test_e16_the_sum_must_run_over_all_points_and_start_with_the_mean_weight() -> None:
    L, n = 11, 5
    x, P = np.arange(1.0, 6.0), spd(n, 1)
    g, w0m, w0c, wi = weights(L, 1.0, 2.0, 2.0)
    X = sigma_points(x, P, L, g)
    good = np.r_[w0m, np.full(2 * L, wi)]
    assert good.sum() == pytest.approx(1.0, abs=1e-15)
    assert np.abs(good @ X - x).max() < 1e-12
    # (3.11b) as printed stops at 2D; with the only D of the text, the number of states, noise points are left out
    short = good[: 2 * n + 1] @ X[: 2 * n + 1]
    assert np.abs(short - x).max() > 0.1
    # (3.12) prints the pair of first weights as (w0^m, w_i^c): a mean weighted with w0^c is off by beta times the state
    wrong = np.r_[w0c, np.full(2 * L, wi)] @ X
    assert np.abs(wrong - x).max() == pytest.approx(2.0 * 5.0)


def test_e16_the_point_array_has_l_rows_not_n() -> None:
    """(3.10), (3.16) claim n rows; stacking state, process and measurement noise gives L, and x + g S^a needs L."""
    n, q, m = 5, 3, 2
    L = n + q + m
    Sa = np.zeros((L, L))
    Sa[:n, :n], Sa[n : n + q, n : n + q], Sa[n + q :, n + q :] = np.linalg.cholesky(spd(n, 2)), np.eye(q), np.eye(m)
    with pytest.raises(ValueError, match="broadcast"):
        np.zeros((n, 1)) + Sa
    assert (np.zeros((L, 1)) + Sa).shape == (L, L)
    flt = make_filter("srukf_printed", n, m, q)
    assert flt.X.shape == (2 * L + 1, n)  # the state rows of all 2L+1 points; the noise rows are constants


# --- E17, trap 13: square root of a negative weight ------------------------------------------------------------------
def test_e17_printed_weight_is_negative_and_its_root_imaginary() -> None:
    g, w0m, w0c, wi = weights(45, 1.0, None, 2.0)
    assert g == pytest.approx(math.sqrt(3.0))
    assert w0m == pytest.approx(-14.0)
    assert w0c == pytest.approx(-12.0)
    assert wi == pytest.approx(1.0 / 6.0)
    with pytest.raises(ValueError, match=r"math domain error|nonnegative"):
        math.sqrt(w0c)
    # the covariance with the weight's modulus instead, which is what an update '+' computes, is wrong on a quadratic
    x, P = np.zeros(1), np.ones((1, 1))
    X = sigma_points(x, P, 45, g) ** 2
    mean = np.r_[w0m, np.full(90, wi)] @ X
    d = X - mean
    right = float((np.r_[w0c, np.full(90, wi)] @ d**2)[0])
    printed = float((np.r_[abs(w0c), np.full(90, wi)] @ d**2)[0])
    # the variance of x^2 is 2; the centre point alone (beta = 2) adds 2 to the points' own 2
    assert mean[0] == pytest.approx(1.0)
    assert right == pytest.approx(4.0)
    assert printed == pytest.approx(28.0)
    flt = PrintedSquareRootUKF(1, 22, 22, kappa=None)
    flt.predict(lambda Z: Z**2, np.zeros((1, 22)))
    assert flt.P[0, 0] == pytest.approx(right)


def test_trap13_negative_centre_weight_can_lose_the_covariance() -> None:
    """15 states, kappa = 3 - L: a strongly bent model makes P indefinite; the non-negative set has no such failure."""
    n = 15
    A = np.random.default_rng(3).normal(size=(n, n))

    def bent(X: Array) -> Array:
        return X + 2.0 * (X @ A.T) ** 2

    for kind in ("srukf_printed", "ukf_augmented", "ukf"):
        flt = make_filter(kind, n, 1, n, kappa=None, beta=0.0)
        flt.set_factor(np.eye(n))
        flt.predict(bent, np.zeros((n, n)))
        for _ in range(2):  # the augmented form keeps its points once before it factors P
            flt.predict(lambda X: X, np.zeros((n, n)))
        assert flt.failures >= 1, kind  # reported, not silent
        assert np.isfinite(flt.S).all()
    ok = make_filter("srukf", n, 1, n)
    ok.set_factor(np.eye(n))
    ok.predict(bent, np.zeros((n, n)))
    assert np.linalg.eigvalsh(ok.P)[0] > -1e-9 * np.linalg.eigvalsh(ok.P)[-1]
    with pytest.raises(FilterFailureError, match="centre point"):
        f = make_filter("srukf_printed", n, 1, n, kappa=None, beta=0.0, strict=True)
        f.set_factor(np.eye(n))
        f.predict(bent, np.zeros((n, n)))


def test_trap13_tiny_alpha_cancels() -> None:
    """al = 1e-3: w0 ~ -1e6. The plain weighted sum of (3.11b) loses six digits; sums of deviations from the centre do not."""
    g, w0m, _, wi = weights(15, 1e-3, 0.0, 2.0)
    assert w0m == pytest.approx(-1e6, rel=1e-5)
    x = np.full(15, 7010.0)
    X = sigma_points(x, np.eye(15), 15, g)
    assert np.abs(np.r_[w0m, np.full(30, wi)] @ X - x).max() > 1e-7
    flt = make_filter("ukf", 15, 1, 15, alpha=1e-3)
    flt.x[:] = x
    flt.predict(lambda Z: Z, np.zeros((15, 0)))
    assert np.abs(flt.x - x).max() < 1e-8


# --- E18, trap 14: the sequential down-dates -------------------------------------------------------------------------
def test_e18_one_down_date_per_column_and_of_the_lower_factor() -> None:
    n, m = 6, 3
    P = spd(n, 4)
    S = np.linalg.cholesky(P)
    U = 0.3 * S @ np.linalg.qr(np.random.default_rng(5).normal(size=(n, n)))[0][:, :m]
    want = np.linalg.cholesky(P - U @ U.T)
    w = np.zeros(2 * n)
    good = S.copy()
    for a in range(m):
        assert chol_downdate(good, n, U[:, a].copy(), w) == 0
    assert np.abs(good - want).max() < 1e-13
    # printed: cholupdate of S^T with the matrix U as if it were one vector
    single = S.copy()
    assert chol_downdate(single, n, U.sum(axis=1), w) == 0
    assert np.abs(single @ single.T - (P - U @ U.T)).max() > 1e-2
    # printed: (3.18k) transposes what the line before has already made S^+; S S^T is then another matrix
    assert np.abs(want.T @ want - (P - U @ U.T)).max() > 0.1


def test_rank_one_changes_equal_numpy() -> None:
    rng = np.random.default_rng(6)
    for n in (1, 2, 7, 15):
        P = spd(n, n)
        v = rng.normal(size=n)
        S = np.linalg.cholesky(P)
        chol_update(S, n, v.copy())
        assert np.abs(S - np.linalg.cholesky(P + np.outer(v, v))).max() < 1e-12
        assert chol_downdate(S, n, v.copy(), np.zeros(2 * n)) == 0
        assert np.abs(S - np.linalg.cholesky(P)).max() < 1e-11


def test_trap14_impossible_down_date_is_refused_and_leaves_the_factor() -> None:
    S = np.linalg.cholesky(spd(4, 9))
    before = S.copy()
    assert chol_downdate(S, 4, 1.0001 * S[:, 1].copy(), np.zeros(8)) == 1
    assert np.array_equal(S, before)


def test_trap14_down_dates_fail_where_the_triangularised_form_does_not() -> None:
    """Prior 1e6, sensor 1e-6, two nearly parallel rows: P - U U^T is positive, its rounded down-dates are not."""
    H = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-7, 0.0]])
    flts = {k: make_filter(k, 3, 2, 3) for k in ("srukf", "srukf_printed")}
    for f in flts.values():
        f.set_cov(1e12 * np.eye(3))
        for _ in range(5):
            f.predict(lambda X: X, 1e-8 * np.eye(3))
            f.update(lambda X: X @ H.T, np.array([1.0, 1.0]), np.full(2, 1e-6))
    assert flts["srukf_printed"].failures > 0
    ok = flts["srukf"]
    # the sum is known at least as well as one reading of it tells
    e = np.array([1.0, 1.0, 0.0])
    assert np.linalg.norm(ok.S.T @ e) < 1.01e-6
    assert np.linalg.norm(flts["srukf_printed"].S.T @ e) > 10 * np.linalg.norm(ok.S.T @ e)
