"""Errata of Sevil (2013) in mathematics used by both sides: rotation rate, turbulence, gain schedule (sevil.md section 7)."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import lagrange
from scipy.linalg import solve_continuous_lyapunov

from flightsw.kernels.rotations import dcm_from_euler, rotate_dcm
from flightsw.sixdof.schedule import weights

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


def printed_weights(y: float, v: float, yd: tuple[float, ...], vn: tuple[float, ...]) -> dict[str, list[float]]:
    """Weights of u1..u6 as (2.49) and (2.59) print them, at turn rate y [rad/s] and airspeed v [m/s]."""
    (y1, y2, y3), (v1, v2) = yd, vn
    u1 = (y - y2) * (y - y3) * (v - v2) / ((y1 - y2) * (y1 - y3) * (v1 - v2))
    u2 = (y - y2) * (y - y3) * (v - v1) / ((y1 - y2) * (y1 - y3) * (v2 - v1))
    u3 = (y - y1) * (y - y3) * (v - v2) / ((y2 - y1) * (y - y2) * (v - v2))
    u4 = (y - y1) * (y - y3) * (v - v1) / ((y2 - y1) * (y2 - y3) * (v2 - v1))
    u6 = (y - y1) * (y - y2) * (v - v1) / ((y3 - y1) * (y3 - y2) * (v2 - v1))
    below = (y3 - y1) * (y3 - y2) * (v1 - v2)
    u5 = {"(2.49)": (y - y1) * (y - y3) * (v - v1) / below, "(2.59)": (y - y1) * (y - y3) * (v1 - v2) / below}
    return {k: [u1, u2, u3, u4, w, u6] for k, w in u5.items()}


def test_e20_weights_of_the_third_and_fifth_condition() -> None:
    """Lagrange weights sum to one and are scipy's, node by node; the two that are printed wrong are neither."""
    yd, vn = (-0.03, 0.0, 0.03), (180.0, 200.0)
    rng, own = np.random.default_rng(20), np.zeros(6)
    for _ in range(100):
        y, v = rng.uniform(yd[0], yd[2]), rng.uniform(*vn)
        weights(y, v, np.array(yd), np.array(vn), own)
        turn = [float(lagrange(yd, row)(y)) for row in np.eye(3)]
        fast = [float(lagrange(vn, row)(v)) for row in np.eye(2)]
        np.testing.assert_allclose(own, np.outer(turn, fast).ravel(), atol=1e-12)
        for got in printed_weights(y, v, yd, vn).values():
            np.testing.assert_allclose([got[i] for i in (0, 1, 3, 5)], own[[0, 1, 3, 5]], atol=1e-12)
    off = [[abs(sum(w) - 1.0) for w in printed_weights(y, 187.0, yd, vn).values()] for y in (-0.02, 0.01, 0.02)]
    assert np.min(off) > 0.1
