"""Sampled models and the Riccati equation of the onboard designs: against many-digit arithmetic, scipy and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from flightsw.kernels.discrete import riccati, spectral_radius
from flightsw.kernels.linalg import solve
from flightsw.kernels.sampled import multiply, sampled
from flightsw.sixdof.lqr import DesignError, regulator
from tests.sampled import transition_and_noise

repeatable = settings(deadline=None, derandomize=True)
systems = st.tuples(st.integers(1, 9), st.integers(1, 4), st.integers(0, 2**31))


def exact(A: np.ndarray, Xi: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Van Loan's block exponential with as many digits as its growing modes eat, and 30 more."""
    import mpmath as mp  # slow to import: only where it is needed

    n = len(A)
    big = np.block([[-A, Xi], [np.zeros((n, n)), A.T]])
    with mp.workdps(30 + int(2.0 * np.abs(A).sum(axis=1).max() * dt / 2.3)):
        E = mp.expm(mp.matrix(big.tolist()) * mp.mpf(dt))
        F = E[n:, n:].T
        return np.array(F.tolist(), dtype=float), np.array((F * E[:n, n:]).tolist(), dtype=float)


@pytest.mark.parametrize("dt", [1e-3, 1.0, 60.0, 900.0])
def test_references_and_kernels_hold_for_any_step(dt: float) -> None:
    """Drift, a 455 s and a 3.6 s mode: at 900 s the block exponential in doubles is off by 1e90, these by 1e-13."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, -1.0 / 455.0, 0.0], [0.0, 0.3, -1.0 / 3.6]])
    Xi = np.diag([0.1, 0.02, 3.0])
    F, Q = exact(A, Xi, dt)
    for got in (transition_and_noise(A, Xi, dt), sampled(A, None, Xi, dt)[::2]):
        assert got[0] == pytest.approx(F, rel=1e-12, abs=1e-15)
        assert got[1] == pytest.approx(Q, rel=1e-12, abs=1e-18)


@repeatable
@given(systems)
def test_solution_is_numpys(size: tuple[int, int, int]) -> None:
    n, k, seed = size
    r = np.random.default_rng(seed)
    A, B = r.normal(size=(n, n)), r.normal(size=(n, k))
    X = B.copy()
    assert solve(A.copy(), X)
    assert np.abs(A @ X - B).max() < 1e-12 * (1.0 + np.abs(X).max()) * n
    assert pytest.approx(np.linalg.solve(A, B), rel=1e-13 * (1.0 + np.linalg.cond(A)) * n, abs=1e-12) == X


def test_a_singular_system_is_told() -> None:
    assert not solve(np.ones((2, 2)), np.ones((2, 1)))
    assert not solve(np.full((1, 1), np.nan), np.ones((1, 1)))


@repeatable
@given(systems)
def test_gain_is_that_of_scipys_riccati_solution(size: tuple[int, int, int]) -> None:
    """Random systems whose fastest mode grows by a fifth in a period at most, as an aircraft's does; cross terms in the cost."""
    n, m, seed = size
    r = np.random.default_rng(seed)
    A, B = r.normal(size=(n, n)), r.normal(size=(n, m))
    A *= 1.2 / np.abs(np.linalg.eigvals(A)).max()
    W = r.normal(size=(n + m, n + m + 3))
    C = W @ W.T / (n + m) + 0.1 * np.eye(n + m)
    Q, S, R = C[:n, :n], C[:n, n:], C[n:, n:]
    K, radius = regulator(A, B, Q, R, S, "random")
    P = solve_discrete_are(A, B, Q, R, s=S)
    want = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + S.T)
    assert np.abs(K - want).max() < 1e-8 * max(1.0, np.abs(want).max())
    # the eigenvalues of a nearly defective loop are themselves known to the k-th root of rounding only
    assert radius == pytest.approx(np.abs(np.linalg.eigvals(A - B @ K)).max(), rel=1e-2, abs=1e-3)
    # Riccati equation in Joseph's form: P is the cost of the loop that K closes
    Ac = A - B @ K
    X = solve_discrete_are(Ac, np.zeros((n, 1)), Q - S @ K - K.T @ S.T + K.T @ R @ K, np.eye(1))
    assert np.abs(X - P).max() < 1e-7 * np.abs(P).max()


def test_scalar_riccati_has_its_closed_form() -> None:
    """x = q + a^2 x / (1 + g x): the positive root of g x^2 + (1 - a^2 - g q) x - q."""
    for a, g, q in ((0.9, 0.5, 2.0), (1.5, 1.0, 1e-6), (1.0, 1e-3, 1.0)):
        H = np.array([[q]])
        assert riccati(np.array([[a]]), np.array([[g]]), H) < 1e-6
        b = 1.0 - a * a - g * q
        assert H[0, 0] == pytest.approx((-b + np.sqrt(b * b + 4.0 * g * q)) / (2.0 * g), rel=1e-12)


@pytest.mark.parametrize(
    ("A", "B", "why"),
    [
        (np.diag([1.0, 0.5]), np.array([[0.0], [1.0]]), "no stabilising Riccati solution"),
        (np.diag([2.0, 0.5]), np.array([[0.0], [1.0]]), "no stabilising Riccati solution"),
    ],
)
def test_what_cannot_be_stabilised_is_refused_by_name(A: np.ndarray, B: np.ndarray, why: str) -> None:
    with pytest.raises(DesignError, match=f"the case in hand: {why}"):
        regulator(A, B, np.eye(2), np.eye(1), None, "the case in hand")


def test_thrust_in_newtons_costs_no_digits() -> None:
    """The same problem with one state in units 1e6 smaller: the same gain, unit for unit."""
    r = np.random.default_rng(4)
    A, B = r.normal(size=(5, 5)) * 0.5, r.normal(size=(5, 2))
    unit = np.array([1.0, 1.0, 1e6, 1.0, 1e-3])
    K, _ = regulator(A, B, np.eye(5), np.eye(2), None, "plain")
    scaled, _ = regulator(A * unit[:, None] / unit, B * unit[:, None], np.diag(unit**-2.0), np.eye(2), None, "scaled")
    assert scaled * unit == pytest.approx(K, rel=1e-11)


def test_spectral_radius_of_rotations_jordan_blocks_and_nothing() -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    assert spectral_radius(0.97 * np.array([[c, -s], [s, c]])) == pytest.approx(0.97, rel=1e-11)
    assert spectral_radius(np.array([[0.5, 1e6], [0.0, 0.5]])) == pytest.approx(0.5, rel=1e-8)
    assert spectral_radius(np.array([[0.0, 1.0], [0.0, 0.0]])) == 0.0
    assert spectral_radius(np.array([[np.nan]])) == np.inf


def test_products_of_any_layout_and_shapes_that_do_not_fit() -> None:
    r = np.random.default_rng(0)
    A, B = r.normal(size=(4, 3)), r.normal(size=(5, 3))
    assert multiply(A, B.T) == pytest.approx(A @ B.T, rel=1e-14)
    with pytest.raises(ValueError, match=r"product of \(4, 3\) and \(5, 3\); allowed"):
        multiply(A, B)
