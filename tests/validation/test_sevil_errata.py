"""Errata of Sevil (2013) that concern mathematics used by both sides: rotation rate and turbulence (sevil.md section 7)."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from flightsw.kernels.rotations import dcm_from_euler, rotate_dcm

V, L, SIGMA = 200.0, 533.4, 0.39


def skew(w: np.ndarray) -> np.ndarray:
    """The source's S(w): minus the usual cross-product matrix (its equation 2.8)."""
    return -np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def test_e13_the_rate_of_a_rotation_needs_a_transpose() -> None:
    w, h = np.array([0.3, -0.2, 0.5]), 1e-6
    R, ahead, back = np.zeros(9), np.zeros(9), np.zeros(9)
    dcm_from_euler(0.7, -0.3, 0.4, R)
    rotate_dcm(R, w, h, ahead)
    rotate_dcm(R, w, -h, back)
    A, rate = R.reshape(3, 3), ((ahead - back) / (2.0 * h)).reshape(3, 3)
    np.testing.assert_allclose(A @ rate.T, -skew(w), atol=1e-8)
    assert np.abs(A @ rate + skew(w)).max() > 0.1  # as printed: R Rdot = -S


def lateral_variance(a21: float, intensity: float) -> float:
    """Stationary variance of the source's lateral filter with its A(2,1) entry given: x' = A x + B n, y = C x."""
    k = V / L
    A, B = np.array([[0.0, 1.0], [a21, -2.0 * k]]), np.array([[0.0], [1.0]])
    C = SIGMA * math.sqrt(3.0 * k / math.pi) * np.array([[k / math.sqrt(3.0), 1.0]])
    P = solve_continuous_lyapunov(A, -intensity * B @ B.T)
    return float((C @ P @ C.T)[0, 0])


def test_e14_turbulence_needs_v_over_l_squared_and_noise_of_intensity_pi() -> None:
    k = V / L
    assert abs(lateral_variance(-k * k, math.pi) / SIGMA**2 - 1.0) < 1e-12
    # unit noise, as the print has it, gives sigma / sqrt(pi): 0.22 for 0.39 m/s
    assert abs(math.sqrt(lateral_variance(-k * k, 1.0)) - 0.22) < 1e-3
    # the printed entry is not even of the right dimension
    assert abs(lateral_variance(-k, math.pi) / SIGMA**2 - 1.0) > 0.1
