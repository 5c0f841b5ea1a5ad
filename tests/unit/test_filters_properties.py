"""What must hold for any model: symmetry, positivity, invariance to names and units of states, compiled = plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw import plugins
from flightsw.filters import covariance, kalman
from flightsw.filters.factory import make_filter
from flightsw.filters.srukf_printed import chol_downdate, chol_update

KINDS = plugins.ours(plugins.ESTIMATORS)

Array = np.ndarray
cases = st.tuples(st.integers(0, 2**31), st.integers(1, 6), st.integers(1, 4), st.integers(1, 4))
repeatable = settings(max_examples=25, deadline=None)


class Bent:
    """A smooth nonlinear model with random coefficients."""

    def __init__(self, seed: int, n: int, m: int, nq: int) -> None:
        rng = np.random.default_rng(seed)
        self.A, self.B = rng.normal(size=(2, n, n))
        self.C, self.D = rng.normal(size=(2, m, n))
        self.SQ, self.r = 0.3 * rng.normal(size=(n, nq)), 0.1 + rng.random(m)
        self.x, self.S = rng.normal(size=n), 0.3 * rng.normal(size=(n, n)) + 0.3 * np.eye(n)
        self.y = rng.normal(size=(4, m))

    def f(self, X: Array) -> Array:
        return 0.9 * X + 0.2 * np.sin(X @ self.A.T) + 0.05 * (X @ self.B.T)

    def h(self, X: Array) -> Array:
        return X @ self.C.T + 0.3 * np.cos(X @ self.D.T)


def fly(kind: str, p: Bent, T: Array | None = None) -> tuple[Array, Array, list[float]]:
    """Four cycles in coordinates z = T x."""
    n, nq = p.SQ.shape
    T = np.eye(n) if T is None else T
    Ti = np.linalg.inv(T)
    flt = make_filter(kind, n, len(p.r), nq)
    flt.x[:] = T @ p.x
    flt.set_factor(T @ p.S)
    out = []
    for y in p.y:
        flt.predict(lambda Z: p.f(Z @ Ti.T) @ T.T, T @ p.SQ)
        out.append(flt.update(lambda Z: p.h(Z @ Ti.T), y, p.r))
        P = flt.P
        assert np.abs(P - P.T).max() <= 1e-12 * np.abs(P).max()
        assert np.linalg.eigvalsh(P)[0] > -1e-10 * np.abs(P).max()
    return Ti @ flt.x, Ti @ flt.P @ Ti.T, out


@pytest.mark.parametrize("kind", KINDS)
@repeatable
@given(cases)
def test_covariance_stays_symmetric_and_positive(kind: str, case: tuple[int, int, int, int]) -> None:
    x, P, nis = fly(kind, Bent(*case))
    assert np.isfinite(x).all()
    assert np.isfinite(P).all()
    assert min(nis) >= 0.0


@pytest.mark.parametrize("kind", KINDS)
@repeatable
@given(cases)
def test_units_of_the_states_do_not_matter(kind: str, case: tuple[int, int, int, int]) -> None:
    """Diagonal scaling commutes with the Cholesky factor, so every filter must give the same answer."""
    p = Bent(*case)
    scale = np.diag(2.0 ** np.arange(p.SQ.shape[0]))  # powers of two: no rounding of their own
    a, b = fly(kind, p), fly(kind, p, scale)
    # the linear filter differences over a whole sigma, the EKF over 1e-3 of it
    assert np.abs(a[0] - b[0]).max() < 1e-6
    assert np.abs(a[1] - b[1]).max() < 1e-6


@pytest.mark.parametrize("kind", ["ekf", "kalman"])
@repeatable
@given(cases)
def test_order_of_the_states_does_not_matter(kind: str, case: tuple[int, int, int, int]) -> None:
    p = Bent(*case)
    n = p.SQ.shape[0]
    a, b = fly(kind, p), fly(kind, p, np.eye(n)[np.random.default_rng(case[0]).permutation(n)])
    assert np.abs(a[0] - b[0]).max() < 1e-7
    assert np.abs(a[1] - b[1]).max() < 1e-7


@pytest.mark.parametrize("kind", [k for k in KINDS if k not in ("ekf", "kalman")])
@repeatable
@given(cases)
def test_order_of_the_states_does_not_matter_on_a_quadratic_model(kind: str, case: tuple[int, int, int, int]) -> None:
    """A permuted Cholesky factor is another set of points; the mean of a quadratic is exact for all of them."""
    rng = np.random.default_rng(case[0])
    n = case[1]
    A = rng.normal(size=(n, n))
    S = rng.normal(size=(n, n)) + np.eye(n)
    Q = np.eye(n)[rng.permutation(n)]
    means = []
    for T in (np.eye(n), Q):
        flt = make_filter(kind, n, 1, 1)
        flt.x[:] = T @ np.arange(float(n))
        flt.set_factor(T @ S)
        flt.predict(lambda Z, T=T: ((Z @ T) @ A.T) ** 2 @ T.T, np.zeros((n, 1)))
        means.append(T.T @ flt.x)
    want = (A @ np.arange(float(n))) ** 2 + np.einsum("ij,jk,ik->i", A, S @ S.T, A)
    for m in means:
        assert np.abs(m - want).max() < 1e-9 * max(1.0, np.abs(want).max())


@pytest.mark.parametrize("kind", KINDS)
def test_an_exactly_known_state_stays_known(kind: str) -> None:
    """Zero variance is legal: no division by it, no noise invented."""
    flt = make_filter(kind, 3, 1, 1)
    flt.x[:] = 1.0, 2.0, 3.0
    flt.set_cov(np.diag([1.0, 0.0, 4.0]))
    for _ in range(3):
        flt.predict(lambda X: X, np.zeros((3, 1)))
        flt.update(lambda X: X[:, :1] + X[:, 1:2], np.array([3.5]), np.array([0.5]))
    assert np.isfinite(flt.P).all()
    assert flt.x[1] == pytest.approx(2.0, abs=1e-9)
    assert flt.P[1, 1] == pytest.approx(0.0, abs=1e-12)
    assert flt.P[2, 2] == pytest.approx(4.0)
    assert getattr(flt, "failures", 0) == 0


@pytest.mark.parametrize("kind", ["ukf", "ekf", "ukf_augmented"])
def test_indefinite_innovation_is_refused_and_counted(kind: str) -> None:
    flt = make_filter(kind, 2, 1, 1)
    flt.P[:] = np.diag([-9.0, 1.0])
    x = flt.x.copy()
    flt.draw()
    flt.Y[:] = np.nan
    assert flt.correct(np.zeros(1), np.ones(1), 1) == -1.0
    assert np.array_equal(flt.x, x)
    assert flt.failures >= 1


@pytest.mark.parametrize("kind", KINDS)
def test_state_object_and_unused_columns_are_left_alone(kind: str) -> None:
    """Owners keep references to x; columns of Y beyond m may hold anything."""
    flt = make_filter(kind, 3, 3, 2)
    x = flt.x
    flt.predict(lambda X: X + 1.0, np.ones((3, 2)))
    flt.draw()
    flt.Y[:] = np.nan
    flt.Y[:, 0] = flt.X[:, 0]
    nis = flt.correct(np.array([1.0, np.nan, np.nan]), np.array([0.1, np.nan, np.nan]), 1)
    assert flt.x is x
    assert np.isfinite(flt.x).all()
    assert np.isfinite(flt.P).all()
    assert nis == pytest.approx(0.0, abs=1e-12)


def py(f: object) -> object:
    return getattr(f, "py_func", f)


def test_compiled_kernels_equal_plain_python_to_the_bit() -> None:
    rng = np.random.default_rng(0)
    a = rng.normal(size=(5, 5))
    P = a @ a.T + np.eye(5)
    L, M = np.zeros((5, 5)), np.zeros((5, 5))
    assert covariance.chol_psd(P, 5, L) == py(covariance.chol_psd)(P, 5, M) == 0
    assert np.array_equal(L, M)
    assert np.abs(L - np.linalg.cholesky(P)).max() < 1e-14
    v = rng.normal(size=5)
    for f, args in ((chol_update, ()), (chol_downdate, (np.zeros(10),))):
        v1, v2 = 0.3 * v, 0.3 * v
        assert f(L, 5, v1, *args) == py(f)(M, 5, v2, *args)
        assert np.array_equal(L, M)
    H, r = rng.normal(size=(3, 5)), np.ones(3)
    out = []
    for f in (kalman.measurement_update, py(kalman.measurement_update)):
        Pc, K, Sy = P.copy(), np.zeros((5, 3)), np.zeros((3, 3))
        f(H, r, 3, Pc, K, Sy, np.zeros((5, 3)), np.zeros((5, 5)), np.zeros((5, 5)))
        out.append(np.concatenate((Pc.ravel(), K.ravel(), Sy.ravel())))
    assert np.array_equal(out[0], out[1])


@given(st.integers(0, 2**31), st.integers(1, 8), st.integers(0, 8))
def test_semidefinite_factor_reproduces_its_matrix(seed: int, n: int, rank: int) -> None:
    a = np.random.default_rng(seed).normal(size=(n, min(rank, n)))
    P = a @ a.T
    L = np.zeros((n, n))
    covariance.chol_psd(P, n, L)
    assert np.isfinite(L).all()
    assert np.abs(L @ L.T - P).max() < 1e-5 * max(1.0, np.abs(P).max())


@pytest.mark.parametrize("P", [np.diag([1.0, -1.0]), np.array([[1.0, 2.0], [2.0, 1.0]]), np.full((2, 2), np.nan)])
def test_indefinite_matrices_are_reported(P: Array) -> None:
    assert covariance.chol_psd(P, 2, np.zeros((2, 2))) == 1
