"""Wind and noise models an estimator carries: closed-form variances, spectra, exactness in the step (lee.md 3.5, E13, E14)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm, solve_continuous_lyapunov, solve_discrete_lyapunov

from flightsw.filters.gauss_markov import critically_damped, dryden, ecwm, first_order, random_walk_intensity

V, L, SIGMA = 190.0, 533.4, 0.39


def van_loan(A: np.ndarray, Q: np.ndarray, T: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and noise covariance of a step: the block exponential over a short one, whose growing modes cost no digits,
    then doubled."""
    n, doublings = len(A), max(0, math.ceil(math.log2(T)))
    M = expm(np.block([[-A, Q], [np.zeros((n, n)), A.T]]) * (T / 2**doublings))
    Phi = M[n:, n:].T
    S = Phi @ M[:n, n:]
    for _ in range(doublings):
        Phi, S = Phi @ Phi, S + Phi @ S @ Phi.T
    return Phi, S


@given(st.floats(1e-4, 10.0), st.floats(1e-2, 1e4), st.floats(0.0, 100.0))
def test_first_order_keeps_its_stationary_variance(T: float, tau: float, sigma: float) -> None:
    phi, q = first_order(T, tau, sigma)
    assert phi == math.exp(-T / tau)
    # without cancellation for T << tau
    assert q * q == pytest.approx(sigma**2 * -math.expm1(-2 * T / tau), rel=1e-12)
    assert phi * phi * sigma**2 + q * q == pytest.approx(sigma**2, rel=1e-12)


def test_ecwm_variance_is_half_a_per_component() -> None:
    """E14: with unit two-sided intensity a/2 is the variance of *each* component, so the magnitude's mean square is a."""
    tau, mean, spread, T = 1000.0, 14.76, 2.0, 0.05
    Phi, SQ = ecwm(T, tau, mean, spread)
    P = solve_discrete_lyapunov(Phi, SQ @ SQ.T)
    a = 2 * (mean**2 + spread**2)
    assert np.diag(P) == pytest.approx([a / 2, a / 2], rel=1e-9)
    # one-sided unit density, as printed, has half that intensity and gives a quarter of a
    printed = solve_continuous_lyapunov(np.array([[-1 / tau]]), np.array([[-0.5 * a / tau]]))
    assert printed[0, 0] == pytest.approx(a / 4)
    # roughness quoted in lee.md section 5
    assert SQ[0, 0] / math.sqrt(T) == pytest.approx(0.66, abs=0.01)


@given(st.floats(1e-3, 50.0), st.floats(0.01, 10.0))
def test_critically_damped_pair_equals_van_loan(T: float, w: float) -> None:
    if w * T > 20.0:
        T = 20.0 / w
    A = np.array([[0.0, 1.0], [-w * w, -2.0 * w]])
    Phi, Q = critically_damped(T, w)
    D = np.diag([w**1.5, w**0.5])  # comparable units
    A1 = np.array([[0.0, 1.0], [-1.0, -2.0]])
    PhiL, QL = van_loan(A1, np.diag([0.0, 1.0]), w * T)
    assert np.abs(D @ Q @ D - QL).max() < 1e-13
    assert np.abs(Phi - np.diag([1.0, w]) @ PhiL @ np.diag([1.0, 1.0 / w])).max() < 1e-13 * max(1.0, w, 1 / w)
    P = solve_continuous_lyapunov(A, -np.diag([0.0, 1.0]))
    assert np.abs(D @ (Phi @ P @ Phi.T + Q - P) @ D).max() < 1e-13


def test_small_steps_keep_their_digits() -> None:
    """Q of a 0.1 ms step against its series T^3/3, T^2/2, T."""
    w, T = 0.356, 1e-4
    Q = critically_damped(T, w)[1]
    # leading relative correction is of order wT = 3.6e-5
    assert pytest.approx(np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]]), rel=2e-4) == Q
    np.linalg.cholesky(Q)


@pytest.mark.parametrize("T", [0.01, 0.05, 1.0, 30.0])
def test_dryden_output_variance_is_sigma_squared(T: float) -> None:
    s = np.array([0.39, 1.0, 2.0])
    Phi, SQ, C, P0 = dryden(T, V, [533.4, 533.4, 300.0], s)
    assert np.diag(C @ P0 @ C.T) == pytest.approx(s**2, rel=1e-12)
    D = np.diag(1 / np.sqrt(np.diag(P0)))
    assert np.abs(D @ (Phi @ P0 @ Phi.T + SQ @ SQ.T - P0) @ D).max() < 1e-12


def test_dryden_spectra_are_the_published_ones() -> None:
    """PSD of u and v from the continuous model whose exact step `dryden` is, against lee.md 3.5."""
    T = 1e-4  # so short that Phi and SQ reveal the continuous matrices
    Phi, SQ, C, _ = dryden(T, V, L, SIGMA)
    A = (Phi - np.eye(5)) / T
    Q = SQ @ SQ.T / T
    for om in (0.05, 0.2, 0.36, 1.0, 4.0):
        G = C @ np.linalg.inv(1j * om * np.eye(5) - A)
        psd = np.real(np.diag(G @ Q @ G.conj().T)) / math.pi  # one-sided, per rad/s
        x = (L * om / V) ** 2
        lon = SIGMA**2 * 2 * L / (math.pi * V) / (1 + x)
        lat = SIGMA**2 * L / (math.pi * V) * (1 + 3 * x) / (1 + x) ** 2
        assert psd == pytest.approx([lon, lat, lat], rel=1e-3)


def test_e13_printed_dryden_matrix_has_the_wrong_variance() -> None:
    """-V/L where -(V/L)^2 belongs: 0.1276 instead of 0.1521 at 190 m/s."""
    w = V / L
    c = SIGMA / math.sqrt(math.pi) * np.array([w**1.5, math.sqrt(3.0) * w**0.5])
    var = []
    for entry in (w * w, w):
        P = solve_continuous_lyapunov(np.array([[0.0, 1.0], [-entry, -2 * w]]), -math.pi * np.diag([0.0, 1.0]))
        var.append(c @ P @ c)
    assert var[0] == pytest.approx(SIGMA**2, rel=1e-12)
    assert var[1] == pytest.approx(0.1276, abs=5e-5)


def test_random_walk_intensity_matches_the_first_instant_of_dryden_u() -> None:
    T = 1e-3
    assert dryden(T, V, L, SIGMA)[1][0, 0] / math.sqrt(T) == pytest.approx(random_walk_intensity(V, L, SIGMA), rel=1e-3)
    assert random_walk_intensity(V, L, SIGMA) == pytest.approx(0.33, abs=0.005)


def test_bad_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="tau = 0"):
        first_order(0.1, 0.0, 1.0)
    with pytest.raises(ValueError, match="L_v = -1"):
        dryden(0.1, 100.0, [1.0, -1.0, 1.0], 1.0)
    with pytest.raises(ValueError, match="sigma"):
        dryden(0.1, 100.0, 1.0, -1.0)
