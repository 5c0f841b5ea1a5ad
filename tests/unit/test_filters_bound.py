"""The Cramer-Rao recursion against the Kalman filter, the information form of its source, and Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightsw.filters.factory import make_filter
from flightsw.filters.kalman import KalmanFilter
from hil_scripts.studies.lee.bound import PosteriorBound, jacobian, trajectory_bound

Array = np.ndarray


def system(seed: int, n: int, nq: int, m: int) -> tuple[Array, Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    F = np.eye(n) + 0.2 * rng.normal(size=(n, n))
    return F, 0.3 * rng.normal(size=(n, nq)), rng.normal(size=(m, n)), 0.1 + rng.random(m), rng.normal(size=(n, n))


@given(st.integers(0, 2**31), st.integers(1, 8), st.integers(0, 8), st.integers(1, 6))
def test_linear_bound_is_the_kalman_covariance(seed: int, n: int, nq: int, m: int) -> None:
    F, SQ, H, r, S0 = system(seed, n, nq, m)
    b, kf = PosteriorBound(S0), KalmanFilter(n, m, nq)
    kf.set_factor(S0)
    for _ in range(10):
        b.predict(F, SQ)
        kf.predict_linear(F, SQ)
        b.update(H, r)
        kf.update_linear(H, np.zeros(m), r)
        scale = max(1e-3, np.abs(kf.P).max())
        assert np.abs(b.P - kf.P).max() < 1e-9 * max(1.0, scale)
    assert not np.triu(b.S, 1).any()
    assert b.sigmas() == pytest.approx(np.sqrt(np.diag(b.P)))


def test_equals_the_information_recursion_of_the_source() -> None:
    """Tichavsky (21): J' = D22 - D21 (J + D11)^-1 D12, which needs a regular Q."""
    F, _, H, r, S0 = system(1, 4, 4, 2)
    SQ = 0.3 * np.tril(np.random.default_rng(2).normal(size=(4, 4))) + 0.5 * np.eye(4)
    Qi, J, b = np.linalg.inv(SQ @ SQ.T), np.linalg.inv(S0 @ S0.T), PosteriorBound(S0)
    for k in range(20):
        Fk = F * (1 + 0.05 * math.sin(k))
        D11, D12, D22 = Fk.T @ Qi @ Fk, -Fk.T @ Qi, Qi + H.T @ np.diag(r**-2) @ H
        J = D22 - D12.T @ np.linalg.solve(J + D11, D12)
        b.predict(Fk, SQ)
        b.update(H, r)
        assert np.abs(b.P @ J - np.eye(4)).max() < 1e-9


def test_singular_noise_and_singular_start_need_no_inverse() -> None:
    """A known state stays known: no noise enters it, and the information form would divide by zero."""
    F = np.array([[1.0, 0.1], [0.0, 1.0]])
    out = trajectory_bound(
        np.zeros((2, 2)),
        [F] * 5,
        [np.zeros((2, 1))] * 5,
        [None, np.eye(2)] * 2 + [None],
        [None, np.ones(2)] * 2 + [None],
    )
    assert out.shape == (5, 2)
    assert not out.any()
    b = PosteriorBound(np.diag([0.0, 1.0]))
    b.predict(F, np.zeros((2, 1)))
    b.update(np.array([[1.0, 0.0]]), np.array([0.1]))
    # position = 0.1 * velocity, so one position reading is a velocity reading of 1 m/s
    assert b.sigmas()[1] == pytest.approx(math.sqrt(0.5))


def test_a_precise_sensor_does_not_destroy_the_factor() -> None:
    b = PosteriorBound(1e6 * np.eye(3))
    H = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-7, 0.0]])
    for _ in range(3):
        b.update(H, np.full(2, 1e-6))
    # three readings of the first row; the second tells x_2 (to 8 m) and so nothing more about the sum
    assert np.linalg.norm(b.S.T @ np.array([1.0, 1.0, 0.0])) == pytest.approx(1e-6 / math.sqrt(3), rel=1e-3)
    assert b.sigmas()[1] == pytest.approx(math.sqrt(2 / 3) * 1e-6 / 1e-7, rel=1e-3)
    assert b.sigmas()[2] == pytest.approx(1e6)


def test_more_sensors_or_less_noise_never_raise_the_bound() -> None:
    F, SQ, H, r, S0 = system(5, 5, 3, 3)
    base = trajectory_bound(S0, [F] * 30, [SQ] * 30, [H] * 30, [r] * 30)
    worse = trajectory_bound(S0, [F] * 30, [SQ] * 30, [H[:2]] * 30, [r[:2]] * 30)
    assert (worse >= base * (1 - 1e-12)).all()
    assert (trajectory_bound(S0, [F] * 30, [0.5 * SQ] * 30, [H] * 30, [r] * 30) <= base * (1 + 1e-12)).all()


def test_jacobian_of_a_vector_model() -> None:
    def f(X: Array) -> Array:
        return np.stack((np.sin(X[:, 0]) * X[:, 1], X[:, 0] ** 3, X[:, 1] / X[:, 0]), axis=1)

    x = np.array([0.7, -7000.0])
    want = np.array([[math.cos(0.7) * -7000, math.sin(0.7)], [3 * 0.49, 0.0], [7000 / 0.49, 1 / 0.7]])
    assert jacobian(f, x, np.ones(2)) == pytest.approx(want, rel=1e-8, abs=1e-8)
    assert jacobian(lambda X: X * 2.0, np.zeros(2), np.full(2, 1e-3)) == pytest.approx(2 * np.eye(2), rel=1e-9)


# --- nonlinear: no filter beats the bound, a good one comes close ------------------------------------------------------
DT = 0.1
R = np.array([0.5, 0.004])
SQ_T = np.diag([0.01, 0.01, 0.05, 0.002, 0.002])
X0 = np.array([300.0, 100.0, 20.0, 0.4, 0.15])
S0_T = np.diag([3.0, 3.0, 1.0, 0.05, 0.03])


def turn(X: Array) -> Array:
    x, y, v, psi, w = X.T
    mid = psi + 0.5 * w * DT
    return np.stack((x + v * DT * np.cos(mid), y + v * DT * np.sin(mid), v, psi + w * DT, w), axis=1)


def polar(X: Array) -> Array:
    return np.stack((np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])), axis=1)


def test_no_filter_beats_the_bound_and_the_good_ones_are_within_ten_percent() -> None:
    runs, steps = 200, 60
    rng = np.random.default_rng(4)
    scale = np.array([1.0, 1.0, 1.0, 0.1, 0.1])
    bound, kinds = np.zeros((steps, 5)), ("srukf", "ekf")
    err = {k: np.zeros((runs, steps, 5)) for k in kinds}
    flts = {k: make_filter(k, 5, 2, 5) for k in kinds}
    for i in range(runs):
        truth = X0 + S0_T @ rng.normal(size=5)
        for f in flts.values():
            f.x[:] = X0
            f.set_factor(S0_T)
        Fs, Hs = [], []
        for k in range(steps):
            if i < 20:
                Fs.append(jacobian(turn, truth, scale))
            truth = turn(truth[None])[0] + SQ_T @ rng.normal(size=5)
            if i < 20:
                Hs.append(jacobian(polar, truth, scale))
            y = polar(truth[None])[0] + R * rng.normal(size=2)
            for name, f in flts.items():
                f.predict(turn, SQ_T)
                f.update(polar, y, R)
                err[name][i, k] = f.x - truth
        if i < 20:
            bound += trajectory_bound(S0_T, Fs, [SQ_T] * steps, Hs, [R] * steps) ** 2 / 20
    bound = np.sqrt(bound)
    for name in kinds:
        ratio = np.sqrt(np.mean(err[name] ** 2, axis=0)) / bound
        mean = ratio[10:].mean(axis=0)
        print(f"{name}: RMS over bound {np.round(mean, 3)}")
        # 200 runs: a single ratio scatters by 5 %
        assert (mean > 0.9).all()
        assert (mean < 1.1).all()


def test_non_positive_sensor_noise_is_refused() -> None:
    with pytest.raises(ValueError, match=r"r = \[0.0\]; allowed > 0"):
        PosteriorBound(np.eye(1)).update(np.eye(1), np.zeros(1))
