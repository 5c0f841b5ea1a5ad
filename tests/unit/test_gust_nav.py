"""Gust estimators against a plain Kalman filter, the matrix exponential and chi-square theory; and bad input."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust import model
from flightsw.missions.gust.design import discrete_gain
from flightsw.missions.gust.estimate import BASIC, GROUND, VERTICAL, GustParams
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.printed import H_PRINTED, THETA
from tests.sampled import transition_and_noise

M = model.linear_model()
DT = 0.02
TRIM = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
LINEAR = GustParams(filter="kalman", model="linear", scales=(0.3,))


def readings(n: int, seed: int = 1) -> np.ndarray:
    sigma = model.SensorNoise().sigmas()
    return TRIM + np.random.default_rng(seed).standard_normal((n, 7)) * sigma * 2.0


def test_linear_filter_equals_the_textbook_recursion() -> None:
    nav = GustNav(replace(LINEAR, servo_slack_s=0.0, channel_gate=1e9))
    P = np.diag([1e-4, 1e-3, 1.0, 1e-4, 1e-4, 1.0, 1e-4, 1.0, 1e-4])
    x = np.linspace(-0.05, 0.05, 9)
    nav.start(x, P)
    Xi = 0.09 * M.Br @ M.Br.T + model.ProcessNoise().intensity()
    F, Q = transition_and_noise(M.A, Xi, DT)
    big = np.zeros((12, 12))
    big[:9, :9], big[:9, 9:] = M.A * DT, M.B * DT
    G = expm(big)[:9, 9:]
    R7 = np.diag(np.square(model.SensorNoise().sigmas()))
    r = np.random.default_rng(3)
    for i, y in enumerate(readings(200)):
        ok = BASIC | (GROUND if i % 10 == 0 else 0) | (VERTICAL if i % 3 == 0 else 0)
        rows = [c for c in range(7) if ok >> c & 1]
        u, now = r.normal(size=3) * 0.02, r.normal(size=3) * 0.02
        x, P = F @ x + G @ u, F @ P @ F.T + Q
        C, R = M.C[rows], R7[np.ix_(rows, rows)]
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        e = (y - TRIM)[rows] - C @ x - M.D[rows] @ now
        nis = e @ np.linalg.solve(C @ P @ C.T + R, e)
        x, P = x + K @ e, (np.eye(9) - K @ C) @ P
        est = nav.step(y, ok, u, DT, now)
        assert est.nis == pytest.approx(nis, rel=1e-5)
    assert nav.x == pytest.approx(x, abs=1e-7)
    assert pytest.approx(P, rel=1e-5, abs=1e-9) == nav.P
    assert est.sigma == pytest.approx(np.sqrt(np.diag(P)), rel=1e-5)


def test_covariance_settles_at_the_riccati_solution() -> None:
    nav = GustNav(LINEAR)
    nav.start(np.zeros(9), discrete_gain(M.A, M.C[:5], _xi(0.3), THETA, DT)[1])
    P0 = nav.P.copy()
    for y in readings(100):
        nav.step(y, BASIC, np.zeros(3), DT)
    assert pytest.approx(P0, rel=1e-4, abs=1e-9) == nav.P


def _xi(scale: float) -> np.ndarray:
    return scale**2 * M.Br @ M.Br.T + model.ProcessNoise().intensity()


@pytest.mark.parametrize("kind", ["ekf", "ukf", "srukf", "srckf"])
def test_nonlinear_filters_agree_with_the_linear_one_near_trim(kind: str) -> None:
    small = TRIM + 0.05 * (readings(150, 5) - TRIM)
    results = []
    for p in (
        LINEAR,
        GustParams(filter=kind, scales=(0.01,)),
        GustParams(filter="kalman", model="linear", scales=(0.01,)),
    ):
        nav = GustNav(p)
        nav.start(np.zeros(9), np.diag([1e-8, 1e-6, 1e-4, 1e-6, 1e-6, 1e-4, 1e-6, 1e-2, 1e-6]))
        for y in small:
            nav.step(y, BASIC, np.zeros(3), DT)
        results.append(nav.x.copy())
    sigma = np.sqrt(np.diag(nav.P))
    assert np.abs(results[1] - results[2]).max() < 0.05 * sigma.max()
    assert (np.abs(results[1] - results[2]) < 0.1 * sigma + 1e-5).all()


def test_constant_gain_filter_is_the_exact_solution_of_its_equation() -> None:
    est = ConstantGainGust()
    est.start(np.zeros(9))
    C = M.C[:5]
    Ac = M.A - H_PRINTED @ C
    y = TRIM + np.array([0.01, 0.02, 0.5, 0.01, 1.0, 0.0, 0.0])
    u = np.array([0.01, 0.0, -0.02])
    est.step(y, BASIC, u, 0.002)  # the reading stays from here on
    x = est.x.copy()
    for _ in range(100):
        est.step(y, BASIC, u, 0.002)
    big = np.zeros((10, 10))
    big[:9, :9], big[:9, 9] = Ac, M.B @ u + H_PRINTED @ (y - TRIM)[:5]
    want = (expm(big * 0.2) @ np.append(x, 1.0))[:9]
    assert est.x == pytest.approx(want, abs=1e-6)


def test_constant_gain_filter_refuses_a_wrong_gain_and_survives_missing_readings() -> None:
    with pytest.raises(ValueError, match=r"\(9, 4\).*\(9, 5\)"):
        ConstantGainGust(np.zeros((9, 4)))
    est = ConstantGainGust()
    y = TRIM.copy()
    y[1] = math.nan
    for _ in range(10):
        est.step(y, BASIC, np.zeros(3), DT)
        est.step(TRIM, 0, np.zeros(3), DT)
    assert est.x == pytest.approx(np.zeros(9), abs=1e-12)


def test_starts_when_the_readings_it_needs_are_there() -> None:
    nav = GustNav()
    y = TRIM + np.array([0.1, 0.05, 0.0, 0.02, 3.0, 0.0, 0.0])
    no_vane = nav.step(y, BASIC & ~(1 << k.Y_ALPHA), np.zeros(3), DT)
    assert not no_vane.valid
    assert no_vane.reason == "waits for alpha"
    est = nav.step(y, BASIC, np.zeros(3), DT)
    assert est.valid
    assert est.x[[k.Q, k.AK, k.TH, k.H]] == pytest.approx([0.1, 0.05, 0.02, 3.0])
    assert (np.linalg.eigvalsh(nav.P) > 0.0).all()


def test_missing_and_broken_readings_only_widen_the_estimate() -> None:
    nav = GustNav()
    for _ in range(100):
        nav.step(TRIM, BASIC, np.zeros(3), DT)
    before = nav.P.copy()
    bad = TRIM.copy()
    bad[[0, 2]] = math.nan, math.inf
    est = nav.step(bad, BASIC, np.zeros(3), DT)
    assert est.valid
    assert est.channels == 3
    est = nav.step(TRIM, 0, np.zeros(3), DT)
    assert est.valid
    assert est.channels == 0
    assert math.isnan(est.nis)
    assert nav.P[k.AW, k.AW] > before[k.AW, k.AW]
    refused = nav.step(TRIM, BASIC, np.array([math.nan, 0.0, 0.0]), DT)
    assert not refused.valid
    assert "finite" in refused.reason
    assert not nav.step(TRIM, BASIC, np.zeros(3), 0.0).valid
    assert nav.step(TRIM, BASIC, np.zeros(3), DT).valid


def test_an_estimate_that_is_lost_starts_again() -> None:
    nav = GustNav()
    nav.step(TRIM, BASIC, np.zeros(3), DT)
    nav.filters[0].x[:] = math.nan
    assert "restarts" in nav.step(TRIM, BASIC, np.zeros(3), DT).reason
    assert nav.restarts == 1
    assert nav.step(TRIM, BASIC, np.zeros(3), DT).valid


@pytest.mark.parametrize("scales", [(), (0.3, 0.1), (0.0,), (-1.0, 1.0), (math.nan,)])
def test_scales_must_ascend_from_above_zero(scales: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="scales"):
        GustParams(scales=scales)


def test_bank_gives_the_weight_to_the_filter_that_fits() -> None:
    for scale, want in ((0.0, 0.01), (1.0, 1.0)):
        nav = GustNav(GustParams(filter="kalman", model="linear", scales=(0.01, 0.1, 1.0)))
        r = np.random.default_rng(2)
        F, Q = transition_and_noise(M.A, _xi(1.0) if scale else _xi(1e-3), DT)
        L = np.linalg.cholesky(Q + 1e-16 * np.eye(9))
        x = np.zeros(9)
        for _ in range(400):
            x = F @ x + L @ r.standard_normal(9)
            y = TRIM + M.C @ x + r.standard_normal(7) * model.SensorNoise().sigmas()
            est = nav.step(y, BASIC, np.zeros(3), DT)
        assert est.scale == pytest.approx(want, rel=0.2)
        assert sum(est.probabilities) == pytest.approx(1.0)


def test_matched_filter_tells_the_truth_about_its_error() -> None:
    r = np.random.default_rng(4)
    F, Q = transition_and_noise(M.A, _xi(0.3), DT)
    L = np.linalg.cholesky(Q + 1e-18 * np.eye(9))
    P0 = np.diag([1e-6, 1e-4, 0.1, 1e-4, 1e-4, 0.1, 1e-5, 0.5, 1e-4])
    nees, nis = [], []
    for _ in range(20):
        nav = GustNav(LINEAR)
        x = np.linalg.cholesky(P0) @ r.standard_normal(9)
        nav.start(np.zeros(9), P0)
        for i in range(150):
            x = F @ x + L @ r.standard_normal(9)
            y = TRIM + M.C @ x + r.standard_normal(7) * model.SensorNoise().sigmas()
            est = nav.step(y, BASIC, np.zeros(3), DT)
            nis.append(est.nis / 5.0)
            if i % 50 == 49:
                d = nav.x - x
                nees.append(d @ np.linalg.solve(nav.P, d) / 9.0)
    assert np.mean(nis) == pytest.approx(1.0, abs=0.04)
    assert np.mean(nees) == pytest.approx(1.0, abs=0.2)


def test_same_readings_same_bytes() -> None:
    runs = []
    for _ in range(2):
        nav = GustNav(GustParams(scales=(0.1, 0.3, 1.0), mix=True))
        for y in readings(50):
            nav.step(y, BASIC | VERTICAL, np.zeros(3), DT)
        runs.append(nav.x.tobytes() + nav.P.tobytes())
    assert runs[0] == runs[1]


def test_joined_readings_follow_a_ramp_without_the_lag_of_held_ones() -> None:
    """Against a fine integration with the reading that truly moves between samples."""
    C, K = M.C[:5], H_PRINTED
    rate = np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    big = np.zeros((11, 11))
    big[:9, :9], big[:9, 9], big[9, 10] = M.A - K @ C, K @ rate[:5], 1.0  # states x, time, one
    want = (expm(big * 0.2) @ np.append(np.zeros(10), 1.0))[:9]
    got = {}
    for join in (True, False):
        est = ConstantGainGust(join=join)
        for i in range(11):
            est.step(TRIM + rate * i * DT, BASIC, np.zeros(3), DT if i else 0.0)
        got[join] = np.abs(est.x - want)[k.AW]
    assert got[True] < 0.02 * abs(want[k.AW])
    assert got[False] > 5.0 * got[True]


def test_parameters_survive_the_strict_loader() -> None:
    from flightsw.missions.gust.law import AlleviationParams, HoldParams
    from flightsw.strict import ConfigError, convert, to_dict

    for p in (GustParams(scales=(0.01, 0.3)), AlleviationParams(), HoldParams()):
        assert convert(to_dict(p), type(p), "gust.toml") == p
    with pytest.raises(ConfigError, match=r"gust\.toml: filter = 'kf'.*ekf"):
        convert({"filter": "kf"}, GustParams, "gust.toml")
    with pytest.raises(ConfigError, match="scales"):
        convert({"scales": [1.0, 0.5]}, GustParams, "gust.toml")


def test_start_knows_that_path_and_bias_share_the_vane() -> None:
    """Covariance at the start against many starts: alpha_K is read through a vane that has a bias and sees the wind."""
    rng, p, n = np.random.default_rng(7), GustParams(), 4000
    aw = rng.normal(size=n) * math.sqrt(GustNav(p).stationary(p.scales[-1])[1, 1])
    bias = rng.normal(size=n) * p.start_bias_rad
    read = -aw + bias + rng.normal(size=n) * p.start_alpha_rad  # of alpha_K = 0
    e = np.stack([-read, bias, aw], axis=1)
    nav = GustNav(p)
    nav.step(TRIM, BASIC, np.zeros(3), DT)
    got = nav.P[np.ix_([k.AK, k.AB, k.AW], [k.AK, k.AB, k.AW])]
    assert pytest.approx(np.cov(e.T), rel=0.08, abs=2e-5) == got


def test_more_scales_than_telemetry_carries_are_refused() -> None:
    with pytest.raises(ValueError, match="5 scales; allowed: up to 4"):
        GustParams(scales=(0.1, 0.2, 0.3, 0.4, 0.5))
