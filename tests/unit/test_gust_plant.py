"""The UAV's plant against the print, the matrix exponential, and closed forms; and the plant against the onboard model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from flightsw.missions.gust import dynamics as onboard
from flightsw.missions.gust.model import Turbulence, linear_model, parameter_vector, published
from sim_plant.aircraft.alexis import dynamics as ka
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams, AlexisSensors
from sim_plant.wind.planar import Gust, PlanarWind, turbulence, wind_series

DT = 0.02
CALM = PlanarWind(0.0, 0.0)
SILENT = AlexisSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_linear_plant_equals_the_matrix_exponential() -> None:
    a = Alexis(AlexisParams(linear=True, direct=True, sensors=SILENT), CALM, 1, 10.0)
    a.place(0.1, 0.02, 0.5, 0.03, 2.0)
    M = linear_model()
    big = np.zeros((12, 12))
    big[:9, :9], big[:9, 9:] = M.A * DT, M.B * DT
    E = expm(big)
    x, u = a.truth.copy(), np.array([0.02, 10.0, -0.03])
    for _ in range(250):
        a.step(u)
        x = E[:9, :9] @ x + E[:9, 9:] @ u
    # the print rounds (V_K, V_K) and (alpha_K, V_K), the plant has them from g and the drag
    assert a.truth == pytest.approx(x, rel=3e-3, abs=2e-4)
    want = M.C @ x + M.D @ u + np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
    assert a.reading == pytest.approx(want, rel=3e-3, abs=5e-3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nonlinear_plant_and_onboard_model_agree_in_other_coordinates(seed: int) -> None:
    r = np.random.default_rng(seed)
    a = Alexis(
        AlexisParams(direct=True, sensors=SILENT), PlanarWind(0.0, 0.0, gusts=(Gust("down", 1.5, 0.0, 1e-6),)), 1, 1.0
    )
    a.wind[:] = 1.5, -2.0
    a.place(*(r.standard_normal(5) * np.array([0.2, 0.05, 1.0, 0.1, 5.0])).tolist())
    u = r.standard_normal(3) * np.array([0.05, 20.0, 0.1])
    x = a.truth.copy()
    par = parameter_vector(published(), Turbulence())
    par[onboard.P_WW] = par[onboard.P_WU] = 1e-12  # the plant's wind is constant: the model's must not decay
    x[0] = 0.0
    X, W = x[None, :].copy(), np.zeros((6, 9))
    for _ in range(25):
        a.step(u)
        onboard.propagate(X, u, par, DT, W)
    assert a.truth[3:] == pytest.approx(X[0, 3:], abs=2e-4)
    Y, codes = np.zeros((1, 7)), np.arange(7)
    onboard.measure(X, codes, 7, u, par, np.zeros(4), Y)
    trim = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
    assert a.reading - trim == pytest.approx(Y[0], abs=3e-3)


def test_turbulence_has_the_asked_variance_and_auxiliary_state() -> None:
    w = PlanarWind(3.5, 5.0)
    s, aux = turbulence(w, 20.0, 1_000_000, 0.05, 3)
    assert s.std(axis=0) == pytest.approx([3.5, 5.0], rel=0.02)
    lag = np.mean(s[:-20, 1] * s[20:, 1]) / np.mean(s[:, 1] ** 2)
    assert lag == pytest.approx(math.exp(-0.2), abs=0.02)
    ww = 20.0 / 93.0
    assert np.mean((aux * 20.0) ** 2) == pytest.approx((2.0 - math.sqrt(3.0)) * ww**2 * 3.5**2, rel=0.05)
    assert np.mean(aux * 20.0 * s[:, 0]) == pytest.approx(0.5 * ww * 3.5**2, rel=0.05)


def test_gust_shapes() -> None:
    t = np.array([0.0, 1.0, 1.5, 2.0, 5.0])
    assert Gust("down", 2.0, 1.0, 1.0).at(t) == pytest.approx([0.0, 0.0, 1.0, 2.0, 2.0])
    assert Gust("tail", 2.0, 1.0, 1.0, "one_cosine").at(t) == pytest.approx([0.0, 0.0, 2.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"sideways.*down, tail"):
        Gust("sideways", 1.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="square"):
        Gust("down", 1.0, 0.0, 1.0, "square")
    with pytest.raises(ValueError, match="length_s"):
        Gust("down", 1.0, 0.0, 0.0)


def test_steps_scale_turbulence_and_not_the_gusts() -> None:
    w = PlanarWind(1.0, 1.0, steps=((0.0, 0.0), (1.0, 1.0)), gusts=(Gust("tail", 3.0, 0.0, 0.1),), steady_tail_mps=2.0)
    s, aux = wind_series(w, 20.0, 400, 0.005, 1)
    assert np.abs(s[:200, 0]).max() == 0.0 == np.abs(aux[:200]).max()
    assert s[100, 1] == pytest.approx(5.0)
    assert np.abs(s[200:, 0]).max() > 0.0


@pytest.mark.parametrize("sigma", [-1.0, math.nan])
def test_turbulence_without_a_meaning_is_no_calm_air(sigma: float) -> None:
    for name, w in (("sigma_w_mps", PlanarWind(sigma, 0.0)), ("sigma_u_mps", PlanarWind(0.0, sigma))):
        with pytest.raises(ValueError, match=f"{name} = .*allowed >= 0"):
            wind_series(w, 20.0, 10, 0.01, 1)
    with pytest.raises(ValueError, match=r"steps\[1\]: time 1.0 after 2.0"):
        PlanarWind(steps=((2.0, 1.0), (1.0, 0.0)))


def test_instruments_have_the_asked_noise_and_the_vane_its_bias() -> None:
    sensors = AlexisSensors(bias_deg=1.0, bias_at_s=12.0)
    a = Alexis(AlexisParams(linear=True, direct=True, sensors=sensors), CALM, 5, 40.0)
    rows, truth = [], []
    ground = 0
    for _ in range(a.samples - 1):
        a.step(np.zeros(3))
        rows.append(a.reading.copy())
        truth.append(a.truth.copy())
        ground += a.fresh >> ka.R_GROUND & 1
    y = np.array(rows)
    assert y.std(axis=0)[[0, 2, 3, 4, 5, 6]] == pytest.approx(
        [math.radians(0.6), 0.35, math.radians(0.2), 1.0, 0.2, 0.3], rel=0.08
    )
    assert np.degrees(y[700:, 1].mean() - y[:590, 1].mean()) == pytest.approx(1.0, abs=0.05)
    assert np.array(truth)[[0, -1], 8] == pytest.approx([0.0, math.radians(1.0)])
    assert ground == (a.samples - 1) // 10


def test_process_noise_grows_as_asked() -> None:
    ends = []
    for seed in range(200):
        a = Alexis(AlexisParams(linear=True, direct=True, noise=(0.0, 0.0, 0.3, 0.0, 0.0)), CALM, seed, 0.1)
        for _ in range(5):
            a.step(np.zeros(3))
        ends.append(a.truth[5])
    assert np.std(ends) == pytest.approx(0.3 * math.sqrt(0.1), rel=0.12)


def test_same_seed_same_bytes_and_a_flight_has_an_end() -> None:
    flights = []
    for _ in range(2):
        a = Alexis(AlexisParams(), PlanarWind(1.0, 1.5), 7, 1.0)
        for i in range(50):
            a.step(np.array([0.01 * (i % 3), 0.0, 0.02]))
        flights.append(a.truth.tobytes() + a.reading.tobytes() + a.vertical.tobytes())
    assert flights[0] == flights[1]
    with pytest.raises(ValueError, match="over"):
        a.step(np.zeros(3))
    with pytest.raises(ValueError, match="duration_s"):
        Alexis(AlexisParams(), CALM, 1, 0.0)


def test_servo_limits_hold() -> None:
    a = Alexis(AlexisParams(), CALM, 1, 2.0)
    for _ in range(50):
        a.step(np.array([1.0, 0.0, -1.0]))
    assert a.surfaces == pytest.approx((math.radians(15.0), -math.radians(20.0)))
