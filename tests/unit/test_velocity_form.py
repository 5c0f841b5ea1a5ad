"""Estimator with inertial velocity in the place of wind: its coordinates, its start, and what it may know of heading."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flightsw.filters.coloured import NoiseStates
from flightsw.filters.factory import make_filter
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.velocity_form import VelocityForm
from flightsw.sixdof.velocity_form_kernel import COLUMNS, air_slope, exchange, shear
from flightsw.strict import ConfigError
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee import study as lee
from hil_scripts.studies.lee.filters import run
from hil_scripts.studies.lee.limit import wind_bound

TAU = 20.0


def state(r: np.random.Generator) -> np.ndarray:
    x = r.normal(size=15)
    x[:3] = r.uniform(150, 220), *r.uniform(-0.2, 0.2, 2)
    x[6:9] = r.uniform(-7, 7), *r.uniform(-0.6, 0.6, 2)
    return x


def air_velocity_ned(x: np.ndarray) -> np.ndarray:
    """R_BI^T u_a by scipy."""
    V, b, a = x[:3]
    ua = V * np.array([math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b)])
    return np.asarray(Rotation.from_euler("ZYX", x[6:9]).apply(ua))


def slope(x: np.ndarray) -> np.ndarray:
    """d(wind to velocity)/dx [15,15] by central differences of scipy's rotation."""
    M = np.eye(15)
    for j in COLUMNS:
        d = np.zeros(15)
        d[j] = 1e-5 * max(1.0, abs(x[j]))
        M[12:15, j] = (air_velocity_ned(x + d) - air_velocity_ned(x - d)) / (2 * d[j])
    return M


@pytest.fixture(scope="module")
def straight() -> fl.Flight:
    """40 s of level flight in the wind model and light turbulence."""
    return fl.fly("ecwm", 40.5, 7)


def test_exchange_adds_the_air_velocity_and_takes_it_back() -> None:
    r = np.random.default_rng(1)
    X = np.array([state(r) for _ in range(20)])
    Z = X.copy()
    exchange(Z, 1.0)
    assert np.abs(Z[:, 12:15] - X[:, 12:15] - [air_velocity_ned(x) for x in X]).max() < 1e-10
    exchange(Z, -1.0)
    assert np.abs(Z - X).max() < 1e-10


def test_slope_and_shear_carry_covariance_there_and_back() -> None:
    r = np.random.default_rng(2)
    A = np.zeros((3, 6))
    for _ in range(20):
        x, S = state(r), np.tril(r.normal(size=(15, 15)))
        air_slope(x, A)
        M = slope(x)
        assert np.abs(A - M[12:15, list(COLUMNS)]).max() < 1e-5
        Z = S.copy()
        shear(Z, A, 1.0)
        assert np.allclose(Z @ Z.T, M @ S @ S.T @ M.T, rtol=1e-6, atol=1e-4)
        shear(Z, A, -1.0)
        assert np.abs(Z - S).max() < 1e-9


def test_a_wind_increment_does_not_move_the_velocity() -> None:
    nav = AirframeNav(fl.study_aircraft(), NavParams(state_form="velocity"))
    r = np.random.default_rng(3)
    for _ in range(5):
        x = state(r)
        nav.core.ukf.x[:] = x
        SQ = nav.core.ukf.SQ
        steps = []
        for _ in range(2):  # what q_V and its like do to the velocity is filled anew, not summed up from step to step
            nav.core.noise_factor(Rotation.from_euler("ZYX", x[6:9]).as_matrix().T.ravel(), 0.05)
            nav.parts.form.enter()
            nav.parts.form.noise(SQ)
            nav.parts.form.leave()
            steps.append(SQ.copy())
        assert np.abs(SQ[12:15, 15:18]).max() < 1e-12
        assert np.abs(SQ[12:15, :3]).max() > 1e-3
        assert np.abs(steps[1] - steps[0]).max() < 1e-9


def test_start_from_one_reading_has_the_covariance_of_that_reading() -> None:
    """Readings of a fixed truth: the wind computed from them, and the noise states, err as the start says they do."""
    r = np.random.default_rng(4)
    truth = state(r)
    sigma = fl.SMALL.copy()
    flt = make_filter("srukf", 30, 15, 33)
    layout = NoiseStates(15, 18, sigma, np.full(15, TAU))
    form = VelocityForm(flt, sigma)
    z = np.concatenate((truth[:12], truth[12:15] + air_velocity_ned(truth)))
    d2, n = [], 2000
    for _ in range(n):
        v = sigma * r.normal(size=15)
        x = np.zeros(30)
        x[:15] = z + v
        x[12:15] -= air_velocity_ned(x)
        flt.x[:] = x
        S = np.eye(30)
        form.start(S)
        layout.start(flt.x, S, read=True)
        e = flt.x - np.concatenate((truth, v))
        d2.append(float(e[:15] @ np.linalg.solve((S @ S.T)[:15, :15], e[:15])))
        # estimate less truth of a state read off, and of its noise state: opposite, in the sample and in the factor
        assert np.abs(e[:12] + e[15:27]).max() < 1e-12
        assert np.array_equal(S[:12], -S[15:27])
    assert np.mean(d2) == pytest.approx(15.0, abs=4.0 * math.sqrt(30.0 / n))  # chi-square, 15 degrees of freedom


def test_velocity_form_alone_knows_no_more_of_heading_than_the_compass(straight: fl.Flight) -> None:
    """Straight flight, noise of 20 s colour: a constant in such noise after T is known to s sqrt(2 tau/(2 tau + T)).

    Wind as a state pretends to several times that: the gusts, as estimated, seem to tell north from east.
    """
    y = np.hstack([straight.x[:, :12], straight.v]) + fl.noise(len(straight.t), fl.LARGE, 7, TAU)
    acc = fl.accelerometer(straight, 7)
    kinds = lee.filters(fl.LARGE, "ecwm", TAU)
    k = round(40.0 / fl.DT)
    compass = fl.LARGE[6] * math.sqrt(2 * TAU / (2 * TAU + 40.0))
    sigma = {n: run(kinds[n], straight, y, acc).sigma[k] for n in ("default", "coloured_wind_form")}
    print({n: float(s[6]) / compass for n, s in sigma.items()})
    assert 0.85 < sigma["default"][6] / compass < 1.05
    assert sigma["coloured_wind_form"][6] / compass < 0.5
    # and so does the bound: across the wind, heading is what limits
    bound = wind_bound(straight, fl.LARGE, 0.39, 0.149, TAU)[k]
    assert bound[1] > 0.85 * compass * 190.0
    assert np.allclose(sigma["default"][12:15], bound, rtol=0.15)


def test_both_forms_agree_where_noise_is_small_and_white(straight: fl.Flight) -> None:
    y = np.hstack([straight.x[:, :12], straight.v]) + fl.noise(len(straight.t), fl.SMALL, 8)
    acc = fl.accelerometer(straight, 8)
    p = lee.filters(fl.SMALL, "ecwm", 0.0)["default"]
    a = run(p, straight, y, acc)
    b = run(NavParams(**{**p.__dict__, "state_form": "wind"}), straight, y, acc)
    late = straight.t > 10.0
    assert np.sqrt(np.mean((a.x - b.x)[late, 12:15] ** 2)) < 0.1 * a.sigma[late, 12:15].mean()


@pytest.mark.parametrize("more", [{"filter": "ekf"}, {"filter": "ukf"}, {"colour_tau_s": 1.0, "colour": "removed"}])
def test_other_filters_take_the_form_too(straight: fl.Flight, more: dict[str, object]) -> None:
    short = fl.Flight(*(v[:200] for v in vars(straight).values()))
    y = np.hstack([short.x[:, :12], short.v]) + fl.noise(200, fl.SMALL, 9)
    p = NavParams(**{**lee.filters(fl.SMALL, "ecwm", 0.0)["default"].__dict__, "wind_model": "random_walk", **more})
    e = run(p, short, y, fl.accelerometer(short, 9))
    assert np.abs((e.x - short.x)[100:, 12:15]).max() < 2.0


def test_noise_states_follow_the_grade_of_the_sensors() -> None:
    p = NavParams(noise_scale=3.0, colour_tau_s=1.0, colour="augmented")
    nav = AirframeNav(fl.study_aircraft(), p)
    assert nav.parts.colour.noise is not None
    assert nav.parts.colour.noise.s[0] == pytest.approx(3.0 * p.r_V)


def test_what_cannot_be_combined_is_named() -> None:
    with pytest.raises(ConfigError, match=r"adapt_wind = 'bank': allowed with state_form = velocity: off"):
        AirframeNav(fl.study_aircraft(), NavParams(state_form="velocity", adapt_wind="bank"))
    with pytest.raises(ConfigError, match=r"state_form = 'velocity': allowed for a receiver: wind"):
        RelativeNav(fl.study_aircraft(), NavParams(state_form="velocity"))
