"""Lee 2011 and companion, wind sources: errata E13, E14, E23 of lee.md section 4."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

from flightsw.aircraft import load_aircraft
from flightsw.filters.gauss_markov import ecwm
from sim_plant.wind.dryden import shaping
from sim_plant.wind.vortex import leg
from sim_plant.wind.wake import airframe_points

V, L, SIGMA = 190.0, 533.4, 0.39
MEAN, SPREAD = 14.76, 2.0
Array = np.ndarray


def dryden_52(*, printed: bool) -> tuple[Array, Array, Array]:
    """A, B of (2.52) and C of (2.53), rebuilt to five rows; `printed`: elements (3,2), (5,4) are -V/L, not -(V/L)^2."""
    w = V / L
    k = w if printed else w * w
    A = np.array([[-w, 0, 0, 0, 0], [0, 0, 1, 0, 0], [0, -k, -2 * w, 0, 0], [0, 0, 0, 0, 1], [0, 0, 0, -k, -2 * w]])
    B = np.zeros((5, 3))
    B[0, 0], B[2, 1], B[4, 2] = math.sqrt(2 * V * SIGMA**2 / (math.pi * L)), 1.0, 1.0
    c, d = SIGMA / math.sqrt(math.pi) * w**1.5, SIGMA * math.sqrt(3 * w / math.pi)
    return A, B, np.array([[1, 0, 0, 0, 0], [0, c, d, 0, 0], [0, 0, 0, c, d]])


def spectrum(A: Array, B: Array, C: Array, om: float) -> Array:
    """One-sided spectra [3] per rad/s of the outputs, inputs of one-sided density 1 per rad/s."""
    H = C @ np.linalg.solve(1j * om * np.eye(5) - A, B)
    return np.sum(np.abs(H) ** 2, axis=1)


def mil_spec(om: float) -> Array:
    """MIL-F-8785C Dryden spectra of u, v, w at spatial frequency om / V, one-sided per rad/s."""
    x = (L * om / V) ** 2
    side = SIGMA**2 * L / (math.pi * V) * (1 + 3 * x) / (1 + x) ** 2
    return np.array([SIGMA**2 * 2 * L / (math.pi * V) / (1 + x), side, side])


def test_E13_stiffness_of_the_turbulence_filter_is_squared() -> None:
    """(2.52) prints (3,2) = (5,4) = -V/L; correct -(V/L)^2; inputs in rows 1, 3, 5 (the scan has lost a row)."""
    var = {}
    for flag in (False, True):
        A, B, C = dryden_52(printed=flag)
        P = C @ solve_continuous_lyapunov(A, -math.pi * B @ B.T) @ C.T  # autocorrelation pi delta(t): lee.md trap 8
        by_spectrum = [quad(lambda w, i=i: spectrum(A, B, C, w)[i], 0, np.inf, limit=200)[0] for i in range(3)]  # noqa: B023
        assert np.allclose(np.diag(P), by_spectrum, rtol=1e-6)
        var[flag] = np.diag(P)
    assert np.allclose(var[False], SIGMA**2, rtol=1e-12)  # 0.1521
    assert var[True][1:] == pytest.approx([0.1276, 0.1276], abs=5e-5)
    om = np.geomspace(0.01, 30, 60)
    want = np.array([mil_spec(w) for w in om])
    good = np.array([spectrum(*dryden_52(printed=False), w) for w in om])
    bad = np.array([spectrum(*dryden_52(printed=True), w) for w in om])
    error = np.abs(bad[:, 1] / want[:, 1] - 1)
    print(
        f"printed variance {var[True][1]:.4f} for {SIGMA**2:.4f} (m/s)^2; spectrum off by up to {100 * error.max():.0f} %"
    )
    assert np.abs(good / want - 1).max() < 1e-12
    assert error.max() > 0.8
    # unit intensity instead of pi: variance sigma^2 / pi
    A, B, C = dryden_52(printed=False)
    unit = C @ solve_continuous_lyapunov(A, -B @ B.T) @ C.T
    assert np.allclose(np.diag(unit), SIGMA**2 / math.pi, rtol=1e-12)
    # the plant's own filter is the corrected one
    a, bbt, c = shaping(V, L, SIGMA)
    assert np.allclose(a, A, atol=1e-15)
    assert np.allclose(bbt, math.pi * B @ B.T, atol=1e-15)
    assert np.allclose(c, C, atol=1e-15)
    # the four rows of the scan's input matrix leave w without noise
    B4 = B.copy()
    B4[4, 2] = 0.0
    assert solve_continuous_lyapunov(A, -math.pi * B4 @ B4.T)[3, 3] == pytest.approx(0.0, abs=1e-15)


def test_E14_density_and_magnitude_of_the_correlated_wind() -> None:
    """(2.49), (2.50): "one-sided density of one" must be two-sided unit intensity; a/2 is the magnitude's mean square."""
    tau = 100.0
    a, b = 2 * (MEAN**2 + SPREAD**2), 1 / tau

    def variance(one_sided_per_rad: float) -> float:
        f = lambda om: one_sided_per_rad * a * b / (om**2 + b**2)  # noqa: E731
        return quad(f, 0, 50 * b)[0] + quad(f, 50 * b, np.inf)[0]

    two_sided = variance(1 / math.pi)  # autocorrelation delta(t): one-sided 1/pi per rad/s
    per_hertz = variance(1 / (2 * math.pi))  # one-sided 1 per Hz
    per_radian = variance(1.0)  # one-sided 1 per rad/s
    assert two_sided == pytest.approx(a / 2, rel=1e-6)
    assert per_hertz == pytest.approx(a / 4, rel=1e-6)
    assert per_radian == pytest.approx(math.pi * a / 2, rel=1e-6)
    # Monte Carlo of the exact step: both components have the whole mean square of the magnitude
    dt = 50.0
    phi, q = ecwm(dt, tau, MEAN, SPREAD)
    rng, runs, steps = np.random.default_rng(14), 4000, 30
    heading = rng.uniform(0, 2 * math.pi, runs)
    W = rng.normal(MEAN, SPREAD, runs) * np.array([np.cos(heading), np.sin(heading)])  # (2.51)
    start = math.sqrt(np.mean(np.sum(W**2, axis=0)))
    for _ in range(steps):
        W = phi @ W + q @ rng.standard_normal((2, runs))
    end = math.sqrt(np.mean(np.sum(W**2, axis=0)))
    print(
        f"variance per component: intensity 1 {two_sided:.1f}, one-sided per Hz {per_hertz:.1f}, per rad/s "
        f"{per_radian:.1f} (a/2 = {a / 2:.1f}); rms magnitude {start:.2f} at the start, {end:.2f} m/s in the long run"
    )
    assert np.var(W, axis=1) == pytest.approx([a / 2, a / 2], rel=0.08)
    assert start == pytest.approx(math.hypot(MEAN, SPREAD), rel=0.01)
    assert end / math.hypot(MEAN, SPREAD) == pytest.approx(math.sqrt(2), rel=0.03)


def curl(field, at: Array, h: float) -> tuple[Array, Array]:  # type: ignore[no-untyped-def]
    """Printed (2.37)-(2.39) and single-gradient (p, q, r)_eff of a velocity field at a point, by central differences."""
    J = np.array([(field(at + h * e) - field(at - h * e)) / (2 * h) for e in np.eye(3)]).T  # J[i, k] = dW_i / dx_k
    printed = np.array([J[2, 1] - J[1, 2], J[0, 2] - J[2, 0], J[1, 0] - J[0, 1]])
    return printed, np.array([J[2, 1], -J[2, 0], J[1, 0]])


def test_E23_one_gradient_per_surface_not_the_curl() -> None:
    """Companion (2.37)-(2.39) print the full curl: twice the rate in turning air, nil in a vortex; one gradient each."""
    omega = np.array([0.05, -0.02, 0.03])
    whole, single = curl(lambda x: np.cross(omega, x), np.array([1.0, 2.0, 0.5]), 0.1)
    assert np.allclose(whole, 2 * omega, atol=1e-12)
    assert np.allclose(single, omega, atol=1e-12)
    # the plant's weights on its own stations find the same rates
    felt = airframe_points(load_aircraft("learjet24"), np.zeros((0, 3)))
    points, weight, n_span, n_frame = felt.points, felt.weight, felt.n_span, felt.n_frame
    W = np.cross(omega, points[:n_frame])
    assert weight[:n_span, 1] @ W[:n_span, 2] == pytest.approx(omega[0], abs=1e-12)
    assert -weight[n_span:, 2] @ W[n_span:, 2] == pytest.approx(omega[1], abs=1e-12)
    assert weight[n_span:, 2] @ W[n_span:, 1] == pytest.approx(omega[2], abs=1e-12)
    # beside a line vortex along x, 20 m to the right of it (the plant's filament, far downstream, no core)
    gamma, y0 = 300.0, 20.0

    def vortex(x: Array) -> Array:
        return np.array(leg(x[0] + 1e6, x[1], x[2], 1.0, 0.0, 0.0, gamma, 0.0, 0.0, 190.0))

    whole, single = curl(vortex, np.array([0.0, y0, 0.0]), 0.01)
    want = -gamma / (2 * math.pi * y0**2)
    assert abs(whole[0]) < 1e-6 * abs(want)
    assert single[0] == pytest.approx(want, rel=1e-5)
    # strip theory: rolling moment of an elliptic wing in that field = damping at p_rel = p - p_eff
    half = 0.5 * load_aircraft("learjet24").geometry.b_m
    chord = lambda y: math.sqrt(1 - (y / half) ** 2)  # noqa: E731
    top = quad(lambda y: chord(y) * y * vortex(np.array([0.0, y0 + y, 0.0]))[2], -half, half)[0]
    p_strip = top / quad(lambda y: chord(y) * y * y, -half, half)[0]
    stations = np.array([vortex(np.array([0.0, y0 + y, 0.0]))[2] for y in points[:n_span, 1]])
    p_plant = weight[:n_span, 1] @ stations
    print(
        f"turning air: printed {whole[0]:.1e} in the vortex; strip theory p_eff {p_strip:.4f}, plant {p_plant:.4f}, "
        f"gradient at the middle {want:.4f} rad/s"
    )
    assert p_plant == pytest.approx(p_strip, rel=0.02)
    assert p_strip == pytest.approx(want, rel=0.1)
    assert abs(whole[0]) < 1e-4 * abs(p_strip)
