"""The continuous unscented filter of Jing et al. (2007): three readings of it; the meant one is a limit of the sampled one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flightsw.missions.windshear.continuous import ContinuousNav, make_nav, sigma_weights
from flightsw.missions.windshear.estimator import ALL, CONTINUOUS, WindshearNav, WindshearParams, start_sigma
from flightsw.missions.windshear.model import WindshearSensors
from hil_scripts.studies.jing import flight as jf
from hil_scripts.studies.jing import study as jing
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams

PLAIN = WindshearParams(states=13, adaptive=False, turbulence=0.0, wind_gain_s2pm=0.0, gate=1e9, channel_gate=1e9)


def flown(p: WindshearParams, samples: int, dt: float) -> WindshearNav:
    """The estimator after some samples of a calm approach, started where the aircraft is."""
    jet = TwinJet(TwinJetParams(), TwinJetAir(), 3, samples * dt, dt)
    x = np.zeros(15)
    jf.true_state(jet.truth, x)
    nav = make_nav(p)
    nav.start(x, start_sigma(p))
    u = np.array([jet.controls[0] * 1e-3, jet.controls[1]])
    for _ in range(samples):
        jet.step(jet.controls)
        nav.step(jet.reading, ALL, u, dt)
    return nav


def test_weights_give_mean_and_covariance_of_their_points() -> None:
    """Points drawn by c from a covariance give it back through W, whose rows add up to nothing."""
    c, wm, W = sigma_weights(13, 0.5)
    P = np.cov(np.random.default_rng(1).standard_normal((13, 40)))
    L = np.linalg.cholesky(c * P)
    X = np.concatenate([np.zeros((1, 13)), L.T, -L.T])
    assert wm.sum() == pytest.approx(1.0)
    assert np.abs(W.sum(axis=0)).max() < 1e-12
    assert np.allclose(X.T @ W @ X, P, atol=1e-10)


def test_meant_reading_is_the_sampled_filter_where_a_sample_says_little() -> None:
    """Sensors thirty times worse and steps of 2 ms: no stiffness, so that Euler's step and a sampled update agree."""
    s = WindshearSensors()
    worse = WindshearSensors(**{name: 30.0 * getattr(s, name) for name in vars(s)})
    p = replace(PLAIN, sensors=worse)
    a = flown(replace(p, filter="ukf_continuous"), 500, 0.002)
    b = flown(replace(p, filter="ukf"), 500, 0.002)
    assert a.restarts == b.restarts == 0
    assert a.sigma[:13] == pytest.approx(b.sigma[:13], rel=0.02)
    assert (np.abs(a.x - b.x)[:13] < 0.1 * b.sigma[:13]).all()


def test_meant_reading_does_not_survive_the_printed_sensors() -> None:
    assert flown(replace(PLAIN, filter="ukf_continuous"), 10, 0.02).restarts >= 1


def test_what_the_letter_and_the_stray_inverse_cost() -> None:
    """Same encounter: to the letter the gain is a hundredth of what it should be; with (43)'s inverse off it flies, worse."""
    v = {c.name: jing.run_encounter(c, 2).values for c in jing.NOMINAL.cases if c.name in ("ukf13", *CONTINUOUS[:2])}
    best, letter, hidden = v["ukf13"], v["ukf_printed"], v["ukf_43"]
    assert hidden["restarts"] == 0.0 and 1.2 * best["w_x.rms_mps"] < hidden["w_x.rms_mps"] < 0.25
    assert letter["w_h.rms_mps"] > 5.0 * best["w_h.rms_mps"]


def test_no_reading_leaves_the_prediction() -> None:
    nav = flown(replace(PLAIN, filter="ukf_43"), 5, 0.02)
    assert isinstance(nav, ContinuousNav)
    e = nav.step(np.full(9, np.nan), ALL, np.array([30.0, 0.0]), 0.02)
    assert e.valid and e.channels == 0 and np.isnan(e.nis)


@pytest.mark.parametrize("more", [{"states": 15}, {"adaptive": True, "turbulence": 0.02}, {"wind_gain_s2pm": 1.0}])
def test_what_it_cannot_obey_is_refused(more: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="ukf_43"):
        replace(PLAIN, filter="ukf_43", **more)  # type: ignore[arg-type]
