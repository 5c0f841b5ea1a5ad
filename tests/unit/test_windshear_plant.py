"""Microburst and twin-jet plant against continuity, quadrature, another integrator, the energy balance, the onboard model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as onboard
from flightsw.missions.windshear.model import parameter_vector
from sim_plant.aircraft.twinjet import dynamics as kt
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams, TwinJetSensors
from sim_plant.wind import microburst_kernel as km
from sim_plant.wind.microburst import MICROBURSTS, Microburst
from sim_plant.wind.planar import Gust

SEED = MICROBURSTS["seed"].vector()


def field(x: float, h: float, m: np.ndarray = SEED) -> np.ndarray:
    out = np.zeros(6)
    km.wind(x, h, m, out)
    return out


def test_parameters_are_those_of_the_source() -> None:
    assert SEED[km.M_RATE] == pytest.approx(0.09737, rel=5e-4)
    assert SEED[km.M_OUT] == pytest.approx(209.45, rel=5e-4)
    assert SEED[km.M_LAYER] == pytest.approx(16.756, rel=5e-4)


@pytest.mark.parametrize("name", ["seed", "severe"])
def test_largest_outflow_is_what_and_where_it_was_asked_for(name: str) -> None:
    b = MICROBURSTS[name]
    m = b.vector()
    best = minimize(lambda v: -field(v[0], v[1], m)[0], [900.0, 60.0], method="Nelder-Mead", options={"xatol": 1e-3})
    assert -best.fun == pytest.approx(b.outflow_mps, rel=1e-6)
    assert best.x == pytest.approx([1.1209 * b.radius_m, 46.0], rel=1e-3)


@pytest.mark.parametrize("offset", [0.0, 250.0])
@pytest.mark.parametrize("x", [-2500.0, -400.0, -3.0, 0.0, 8.9, 9.4, 600.0])
def test_slopes_are_those_of_the_field(x: float, offset: float) -> None:
    m = Microburst(24.0, 900.0, 50.0, 5.0, offset).vector()
    for h in (15.0, 120.0):
        d = 0.05
        w = field(x, h, m)
        dx = (field(x + d, h, m) - field(x - d, h, m)) / (2 * d)
        dh = (field(x, h + d, m) - field(x, h - d, m)) / (2 * d)
        assert w[2:] == pytest.approx([dx[0], dh[0], dx[1], dh[1]], rel=1e-5, abs=2e-8)


def test_air_is_neither_made_nor_lost() -> None:
    for x in (1.0, 50.0, 700.0, 2000.0):
        for h in (5.0, 46.0, 300.0):
            w = field(x, h)
            assert w[2] + w[0] / x + w[5] == pytest.approx(0.0, abs=1e-12)
    # the same in the large: what comes down through a disc leaves through its rim
    R, H = 800.0, 150.0
    down = quad(lambda r: -field(r, H)[1] * 2.0 * math.pi * r, 0.0, R)[0]
    out = quad(lambda h: field(R, h)[0] * 2.0 * math.pi * R, 0.0, H)[0]
    assert down == pytest.approx(out, rel=1e-8)
    assert field(300.0, 0.0)[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert field(300.0, -5.0)[:2] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_bad_microbursts_are_refused() -> None:
    with pytest.raises(ValueError, match="radius_m = 0"):
        Microburst(20.0, 0.0)
    with pytest.raises(ValueError, match="outflow_mps = 101"):
        Microburst(101.0)


def silent() -> TwinJetSensors:
    return TwinJetSensors(*(0.0,) * 8)


def test_start_is_steady_on_the_slope() -> None:
    j = TwinJet(TwinJetParams(sensors=silent()), TwinJetAir(MICROBURSTS["seed"]), 1, 1.0)
    assert j.reading[7:] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert j.f[kt.F_VH] / j.f[kt.F_VX] == pytest.approx(-math.tan(math.radians(3.0)))
    assert j.truth[2] == pytest.approx(76.8, abs=0.1)  # 75 m/s over the ground in 1.7 m/s of headwind


def test_flight_equals_an_independent_integrator() -> None:
    air = TwinJetAir(MICROBURSTS["severe"])
    j = TwinJet(TwinJetParams(x_m=-1500.0, height_m=180.0), air, 1, 20.0)
    u = np.array([9e4, -0.02])
    W, out = np.zeros((6, 7)), np.zeros(7)

    def rates(_: float, f: np.ndarray) -> np.ndarray:
        kt.rates(f, u, 0.0, 0.0, j.a, j.m, W[5], out)
        return out.copy()

    ref = solve_ivp(rates, (0.0, 16.0), j.f.copy(), rtol=1e-11, atol=1e-9)
    for _ in range(800):
        j.step(u)
    assert j.f == pytest.approx(ref.y[:, -1], rel=1e-6, abs=1e-6)


def test_energy_balance_and_f_factor() -> None:
    """E_s' = Va Va'/g + h' (finite differences of the flight) = Va ((T cos alpha - D)/W - F)."""
    j = TwinJet(
        TwinJetParams(x_m=-1500.0, height_m=180.0, sensors=silent()), TwinJetAir(MICROBURSTS["seed"]), 1, 20.0, 0.005
    )
    rows, drag = [], []
    for _ in range(3500):
        rows.append(j.truth.copy())
        drag.append(kt.forces(j.truth[2], j.truth[4], j.truth[5], j.controls[1], j.a)[1])
        j.step(np.array([8e4, -0.02]))
    s = np.array(rows)
    V, gamma, alpha, T = s[:, 2], s[:, 3], s[:, 4], s[:, 6]
    E = V * V / (2 * 9.81) + s[:, 1]
    F = (s[:, 9] * np.cos(gamma) + s[:, 10] * np.sin(gamma)) / 9.81 - s[:, 8] / V
    want = V * ((T * np.cos(alpha) - np.array(drag)) / (38500.0 * 9.81) - F)
    assert F.max() > 0.25
    assert np.gradient(E, 0.005)[5:-5] == pytest.approx(want[5:-5], abs=2e-4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_plant_and_onboard_model_agree_in_other_coordinates(seed: int) -> None:
    """The plant knows no wind rates, the onboard model lives on them: rates of airspeed, path, incidence must still be equal."""
    r = np.random.default_rng(seed)
    p = TwinJetParams(lift_factor=1.05, drag_factor=0.95, sensors=silent(), x_m=-800.0, height_m=150.0)
    j = TwinJet(p, TwinJetAir(MICROBURSTS["severe"]), 1, 60.0, 0.001)
    j.f[kt.F_PITCH] += r.uniform(0.0, 0.2)
    j.f[kt.F_RATE], j.f[kt.F_THRUST] = r.uniform(-0.05, 0.05), r.uniform(3e4, 8e4)
    u = np.array([6e4, r.uniform(-0.1, 0.1)])
    model = parameter_vector(twinjet(), 1.05, 0.95)
    rows = []
    for _ in range(3):
        j.step(u)
        rows.append(j.truth.copy())
    x = np.zeros(13)
    x[:11] = rows[1]
    x[6] *= 1e-3
    d = np.zeros(13)
    onboard.rates(x, np.array([60.0, u[1]]), model, d)
    seen = (rows[2] - rows[0]) / 0.002
    seen[6] *= 1e-3
    assert d[:7] == pytest.approx(seen[:7], rel=2e-4, abs=2e-6)
    assert d[7:9] == pytest.approx(seen[7:9], abs=2e-5)
    Y = np.zeros((1, 9))
    onboard.measure(x[None], np.arange(9), 9, np.array([60.0, u[1]]), model, Y)
    kt.observe(j.f, u, np.zeros(2), np.zeros(2), j.a, j.m, np.zeros((6, 7)), now := np.zeros(9), last := np.zeros(11))
    x[:11] = last
    x[6] *= 1e-3
    onboard.measure(x[None], np.arange(9), 9, np.array([60.0, u[1]]), model, Y)
    assert Y[0] == pytest.approx(now, rel=1e-9, abs=1e-9)


def test_lift_curves_of_plant_and_software_agree_and_are_smooth() -> None:
    a, p = TwinJetParams().vector(), parameter_vector(twinjet())
    alpha = np.linspace(-0.1, 0.6, 1401)
    mine = np.array([kt.lift_coefficient(v, a) for v in alpha])
    theirs = np.array([onboard.lift_curve(v, p) for v in alpha])
    assert mine == pytest.approx(theirs, abs=1e-12)
    assert alpha[np.argmax(mine)] == pytest.approx(0.23, abs=1e-3)
    slope = np.array([onboard.lift_slope(v, p) for v in alpha])
    assert np.gradient(mine, alpha)[1:-1] == pytest.approx(slope[1:-1], abs=0.03)
    assert np.abs(np.diff(slope)).max() < 0.1  # no jump of slope


def test_turbulence_and_gusts_are_felt_as_asked() -> None:
    series = TwinJetAir(sigma_u_mps=1.5, sigma_w_mps=1.0).series(75.0, 400_000, 0.02, 3)
    assert series.std(axis=0) == pytest.approx([1.5, 1.0], rel=0.06)
    # the longitudinal component is an exponential correlation with time L/V
    lag = round(260.0 / 75.0 / 0.02)
    c = np.mean(series[lag:, 0] * series[:-lag, 0]) / series[:, 0].var()
    assert c == pytest.approx(math.exp(-1.0), abs=0.06)
    air = TwinJetAir(gusts=(Gust("down", 4.0, 1.0, 2.0, "one_cosine"), Gust("tail", 3.0, 0.0, 1.0)))
    j = TwinJet(TwinJetParams(sensors=silent()), air, 1, 5.0)
    for _ in range(100):
        j.step(j.controls.copy())
    assert j.truth[7:9] == pytest.approx([3.0, -4.0])


def test_same_seed_same_bytes_and_lapsed_flight() -> None:
    def run(seed: int) -> bytes:
        j = TwinJet(TwinJetParams(), TwinJetAir(MICROBURSTS["seed"], 1.0, 1.0), seed, 2.0)
        for _ in range(99):
            j.step(np.array([5e4, 0.0]))
        return j.reading.tobytes() + j.truth.tobytes()

    assert run(5) == run(5) != run(6)
    j = TwinJet(TwinJetParams(), TwinJetAir(), 1, 0.02)
    j.step(j.controls.copy())
    with pytest.raises(ValueError, match="is over"):
        j.step(j.controls.copy())
    with pytest.raises(ValueError, match="duration_s"):
        TwinJet(TwinJetParams(), TwinJetAir(), 1, 0.0)
