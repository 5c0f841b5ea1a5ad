"""Kernels of the wake position: readings and slopes against the plant's wake, weights and steps against dense algebra."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import approx_fprime

from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata import iekf as kf
from flightsw.missions.receiver.airdata import state as ks
from flightsw.missions.receiver.airdata.least_squares import weigh
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector
from hil_scripts.studies.sevil.flight import SPEC_PROBES, PlantWake, plant_readings

WK, PROBES = wake_vector(WakeParams()), np.array(SPEC_PROBES)
ALL = np.ones(9, dtype=np.int64)
place = st.tuples(st.floats(-30, 60), st.floats(4, 14))


def frame(x: float = -35.5, theta: float = math.radians(3.0)) -> np.ndarray:
    return np.array([x, 0.4, -0.01, theta, 0.02, 0.01, -0.02, 0.005, 200.0, 0.58883, 0.3])


def point(y: float, z: float, h: float = 0.0, kw: float = 1.0, kt: float = 1.0) -> np.ndarray:
    return np.array([y, z, 0.3, -0.2, kw, kt, h, 1.0, -0.5, 0.25])


def plant(p: np.ndarray, g: np.ndarray) -> np.ndarray:
    """The same readings from the plant's kernels: circulation through mass and download, height through the vortices."""
    base = PlantWake()
    lift, down = 1.055 * p[4], 0.055 * p[5]
    wake = PlantWake(
        mass_kg=base.mass_kg * (lift - down),
        tail_download_frac=down / (lift - down),
        wing_m=(0.0, 0.0, p[6]),
        tail_m=(-18.0, 0.0, -1.5 + g[10] * p[6]),
    )
    air, rate = p[7:10], np.array([[g[1], p[2], p[3]]])
    return plant_readings(np.array([[g[0], p[0], p[1]]]), g[2:5], xi_dot=rate, omega=g[5:8], air=air, wake=wake)[0]


def expect(p: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    h, J = np.zeros(9), np.zeros((9, 9))
    kp.expected(p, g, PROBES, WK, True, h, J)
    return h, J


@given(place, st.floats(-1, 1), st.floats(0.8, 1.2), st.floats(0.4, 1.5))
def test_readings_equal_the_plants(at: tuple[float, float], h: float, kw: float, kt: float) -> None:
    p = point(*at, h=h, kw=kw, kt=kt)
    assert np.allclose(expect(p, frame())[0], plant(p, frame()), rtol=0, atol=1e-9)


@pytest.mark.parametrize("at", [(0.3, 8.5), (56.0, 0.5), (12.0, 6.0), (-3.0, 10.0)])
def test_slopes_equal_differences_of_the_plants_readings(at: tuple[float, float]) -> None:
    p, g = point(*at, h=0.2, kw=1.05, kt=0.8), frame()
    _, J = expect(p, g)
    columns = {kp.J_Y: 0, kp.J_Z: 1, kp.J_KW: 4, kp.J_KT: 5, kp.J_H: 6, kp.J_W: 7, kp.J_W + 1: 8, kp.J_W + 2: 9}
    e = 1e-4
    for c, i in columns.items():
        d = np.zeros(10)
        d[i] = e
        assert np.allclose(J[:, c], (plant(p + d, g) - plant(p - d, g)) / (2 * e), rtol=1e-5, atol=1e-8), c
    d = np.zeros(11)
    d[0] = e
    assert np.allclose(J[:, kp.J_X], (plant(p, g + d) - plant(p, g - d)) / (2 * e), rtol=1e-5, atol=1e-8)


@given(place)
def test_velocity_acts_as_the_opposite_wind_and_height_as_the_opposite_place(at: tuple[float, float]) -> None:
    g = frame()
    g[10] = 1.0  # the whole wake moves
    p = point(*at)
    q = p.copy()
    q[2] += 0.7
    q[8] += 0.7
    r = p.copy()
    r[1] += 0.6
    r[6] += 0.6
    for other in (q, r):
        assert np.allclose(expect(p, g)[0], expect(other, g)[0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("mask", [0b111111111, 0b110111011, 0b100010111, 0b000111000])
@pytest.mark.parametrize("common", [0.0, 0.5, 3.0])
def test_weights_are_the_inverse_of_the_covariance(mask: int, common: float) -> None:
    ok = np.array([(mask >> c) & 1 for c in range(9)])
    sig, com = np.array([0.4, 0.01, 0.02]), common * np.array([1.0, 0.1, 0.05])
    r = np.random.default_rng(1).normal(size=9)
    w = r.copy()
    weigh(w, ok, sig, com)
    want = 0.0
    for v in range(3):
        use = [3 * v + i for i in range(3) if ok[3 * v + i]]
        R = sig[v] ** 2 * np.eye(len(use)) + com[v] ** 2
        want += r[use] @ np.linalg.solve(R, r[use]) if use else 0.0
    assert w @ w == pytest.approx(want, rel=1e-10)


def test_unbounded_common_error_is_the_limit_and_removes_offsets() -> None:
    sig = np.array([0.4, 0.01, 0.02])
    r = np.random.default_rng(2).normal(size=9)
    a, b, c = r.copy(), r.copy(), r + np.repeat([5.0, -3.0, 1.0], 3)
    weigh(a, ALL, sig, np.full(3, np.inf))
    weigh(b, ALL, sig, np.full(3, 1e7))
    weigh(c, ALL, sig, np.full(3, np.inf))
    assert np.allclose(a, b, rtol=1e-6, atol=1e-6) and np.allclose(a, c, rtol=0, atol=1e-9)


FREE, NONE = np.zeros(ks.N, dtype=np.int64), np.zeros((9, 9))


def random_filter(seed: int) -> tuple[np.ndarray, np.ndarray]:
    r = np.random.default_rng(seed)
    A = r.normal(size=(ks.N, ks.N)) * 0.1
    gusts, errors = r.normal(size=6) * 0.3, r.normal(size=12) * 0.01
    x = np.array([0.2, 8.4, 0.1, -0.1, 0.02, -0.1, 0.05, *gusts, 0.01, -0.01, 0.2, *errors])
    s2 = [0.5, 0.5, 0.1, 0.1, 0.01, 0.1, 0.05, *[0.2] * 6, 1e-4, 1e-4, 0.5, *[0.1] * 3, *[1e-2] * 6, 0.04, 0.04, 1e-3]
    return x, A @ A.T + np.diag(s2)


@pytest.mark.parametrize("dt", [0.01, 0.05, 0.5])
def test_step_equals_the_matrix_exponential(dt: float) -> None:
    """Van Loan's discretisation of the continuous model, by scipy's expm."""
    tau, sigma = np.array([2.67, 300.0, 200.0, 100.0, 60.0, 1.5]), np.array([0.39, 2.0, 0.02, 1.0, 0.1, 0.02])
    q = np.array([0.05, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006])
    A, Q = np.zeros((ks.N, ks.N)), np.zeros((ks.N, ks.N))
    for a in range(2):
        A[a, 2 + a], A[2 + a, 13 + a] = 1.0, -1.0
        Q[2 + a, 2 + a] = q[0] ** 2
    for i, w in zip([*range(7, 16), 25, 26, 27], [0, 0, 0, 1, 1, 1, 2, 2, 3, 4, 4, 5], strict=True):
        A[i, i], Q[i, i] = -1.0 / tau[w], 2.0 * sigma[w] ** 2 / tau[w]
    for a in range(3):
        Q[4 + a, 4 + a] = q[1 + a] ** 2
    for c in range(9):
        Q[16 + c, 16 + c] = q[4 + c // 3] ** 2
    E = expm(np.block([[-A, Q], [np.zeros_like(A), A.T]]) * dt)
    F = E[ks.N :, ks.N :].T
    Qd = F @ E[: ks.N, ks.N :]
    x, P = random_filter(3)
    want_x, want_P = F @ x, F @ P @ F.T + Qd
    want_x[:4] += np.array([0.5 * dt * dt * 0.3, 0.5 * dt * dt * -0.2, dt * 0.3, dt * -0.2])
    ks.propagate(x, P, 0.3, -0.2, dt, q, tau, sigma)
    # within a step the bias is held and does not drive velocity noise: both differ by its time constant only
    assert np.allclose(x, want_x, rtol=0, atol=1e-2 * dt**2)
    assert np.allclose(P, want_P, rtol=0, atol=2e-2 * dt**2)


def dense(
    x: np.ndarray, P: np.ndarray, y: np.ndarray, ok: np.ndarray, sig: np.ndarray, r_att: float
) -> tuple[np.ndarray, np.ndarray, float]:
    h, H = np.zeros(9), np.zeros((9, ks.N))
    ks.linearise(x, frame(), PROBES, WK, h, H)
    use = np.nonzero(ok)[0]
    R = np.diag(np.repeat(sig, 3) ** 2)
    for v in (1, 2):
        R[3 * v : 3 * v + 3, 3 * v : 3 * v + 3] += r_att**2
    H, R, d = H[use], R[np.ix_(use, use)], (y - h)[use]
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    return x + K @ d, P - K @ S @ K.T, d @ np.linalg.solve(S, d)


@pytest.mark.parametrize("mask", [0b111111111, 0b101110011, 0b000111000])
def test_single_pass_equals_the_textbook_filter(mask: int) -> None:
    sig, r_att = np.array([0.447, 7.8e-4, 7.8e-4]), 3.5e-4
    ok = np.array([(mask >> c) & 1 for c in range(9)])
    x, P = random_filter(4)
    P *= 1e-3
    e, S = np.zeros(9), np.zeros((9, 9))
    kf.foresee(x, P, frame(), r_att, PROBES, WK, e, S)
    y = e + np.random.default_rng(5).normal(size=9) * np.repeat(sig, 3)
    want_x, want_P, nis = dense(x, P, y, ok, sig, r_att)
    out = np.zeros(2)
    assert kf.correct(x, P, y, ok, sig, frame(), r_att, PROBES, WK, 3, 1e9, 1e9, FREE, NONE, out) == kf.OK
    assert out[0] == pytest.approx(nis, rel=1e-8) and out[1] == ok.sum()
    assert np.allclose(x, want_x, rtol=0, atol=1e-9) and np.allclose(P, want_P, rtol=0, atol=1e-11)
    assert np.array_equal(P, P.T) and np.linalg.eigvalsh(P).min() > 0


def test_iterated_pass_reaches_the_maximum_of_the_posterior() -> None:
    """A wide prior 4 m off: the end point is stationary for the posterior density (slopes by scipy's differences)."""
    sig = np.array([0.02, 4e-5, 4e-5])
    x = np.zeros(ks.N)
    x[:2] = 3.0, 10.5
    P = np.diag(
        [16.0, 16.0, 1e-4, 1e-4, 1e-4, 1e-2, 1e-2, *[0.04] * 6, 1e-6, 1e-6, 1e-2, *[1e-10] * 9, 1e-4, 1e-4, 1e-6]
    )
    x0, P0 = x.copy(), P.copy()
    g = frame()
    p = np.zeros(10)
    ks.point_of(np.array([0.5, 7.5, *np.zeros(ks.N - 2)]), p)
    y, _ = expect(p, g)
    out = np.zeros(2)
    assert kf.correct(x, P, y, ALL, sig, g, 0.0, PROBES, WK, 60, 0.0, 1e9, FREE, NONE, out) == kf.OK

    def density(u: np.ndarray) -> float:
        h, H = np.zeros(9), np.zeros((9, ks.N))
        v = x0 + np.sqrt(np.diag(P0)) * u
        ks.linearise(v, g, PROBES, WK, h, H)
        return float(u @ u + np.sum(((y - h) / np.repeat(sig, 3)) ** 2))

    u = (x - x0) / np.sqrt(np.diag(P0))
    start = np.abs(approx_fprime(np.zeros(ks.N), density, 1e-7)).max()
    assert density(u) < 1e-3 * density(np.zeros(ks.N))
    assert np.abs(approx_fprime(u, density, 1e-7)).max() < 1e-4 * start
    assert np.hypot(x[0] - 0.5, x[1] - 7.5) < 0.5


def test_gate_and_bad_covariance_change_nothing() -> None:
    sig, out = np.array([0.447, 7.8e-4, 7.8e-4]), np.zeros(2)
    x, P = random_filter(6)
    e, S = np.zeros(9), np.zeros((9, 9))
    kf.foresee(x, P, frame(), 0.0, PROBES, WK, e, S)
    x0, P0 = x.copy(), P.copy()
    assert kf.correct(x, P, e + 50.0, ALL, sig, frame(), 0.0, PROBES, WK, 3, 1.0, 8.0, FREE, NONE, out) == kf.GATED
    assert np.array_equal(x, x0) and np.array_equal(P, P0) and out[0] > 72.0
    P[:] = -P0 * 1e3
    assert kf.correct(x, P, e, ALL, sig, frame(), 0.0, PROBES, WK, 3, 1.0, 8.0, FREE, NONE, out) == kf.BROKEN
    assert np.array_equal(x, x0)
    assert (
        kf.correct(x, P0, e, ALL * 0, sig, frame(), 0.0, PROBES, WK, 3, 1.0, 8.0, FREE, NONE, out) == kf.OK
        and out[1] == 0
    )
