"""Receiver estimator variants on frames of the plant: bounded errors, rotational wind, probes, colour, adaptation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import dcm_from_euler, quat4, quat_from_euler, vec3
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.missions.receiver.relative_aids import calculated_wind
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.motion import air_velocity, relative_velocity
from flightsw.strict import ConfigError
from flightsw.types import SensorFrame

from .refuel_rig import Rig, rms

AC = load_aircraft("learjet24")
SETTLE_S = 15.0
ROT = {"nav__rotational_wind": True}
PRINTED = {  # chapter 6: calculated wind instead of velocity, diagonal Q, filter as printed
    "nav__cmw": True, "nav__velocity": False, "nav__correlated_wind": False, "nav__filter": "srukf_printed",
    "nav__q_V": 0.4, "nav__q_beta": 0.002, "nav__q_alpha": 0.002,
}  # fmt: skip


def after(log: dict[str, dict[str, np.ndarray]], name: str, key: str) -> np.ndarray:
    return log[name][key][log["truth"]["t"] > SETTLE_S]


def state(r: np.random.Generator) -> np.ndarray:
    x = np.zeros(18)
    x[:3] = r.uniform(185, 205), *r.uniform(-0.03, 0.03, 2)
    x[3:6], x[6:9] = r.uniform(-0.05, 0.05, 3), r.uniform(-0.2, 0.2, 3)
    x[9:12], x[12:15], x[15:18] = r.uniform(-40, 40, 3), r.uniform(-15, 15, 3), r.uniform(-0.05, 0.05, 3)
    return x


def stage(r: np.random.Generator) -> np.ndarray:
    R = np.zeros(9)
    dcm_from_euler(r.uniform(-3, 3), r.uniform(-0.2, 0.2), r.uniform(-0.5, 0.5), R)
    v = R.reshape(3, 3).T @ np.array([195.0, 0.0, 10.0])
    return np.concatenate((R, r.uniform(-0.05, 0.05, 3), np.zeros(3), v))


def test_calculated_wind_is_exact_for_exact_readings_and_the_printed_signs_are_not() -> None:
    """Lee (6.14), erratum E7: with xi for its rate, R_BW transposed, or S(w) = +[w x], the wind is off by metres per second."""
    r = np.random.default_rng(2)
    R, v, q = np.zeros(9), np.zeros(3), np.zeros(4)
    off = np.zeros(3)
    for _ in range(20):
        x, tk = state(r), stage(r)
        dcm_from_euler(x[6], x[7], x[8], R)
        relative_velocity(x, tk, R, v)
        C, T = R.reshape(3, 3), tk[:9].reshape(3, 3)
        own = C @ T
        e = (math.atan2(own[0, 1], own[0, 0]), -math.asin(own[0, 2]), math.atan2(own[1, 2], own[2, 2]))
        quat_from_euler(*e, q)
        f = SensorFrame(rel_pos_t=vec3(x[9:12]), rel_vel_t=vec3(v), att_q_nb=quat4(q))
        assert np.abs(calculated_wind(f, x[:3], tk) - x[12:15]).max() < 1e-9
        ua, cross = np.array(air_velocity(*x[:3])), np.cross(tk[9:12], x[9:12])
        back = np.array(
            [x[0] * math.cos(x[2]) * math.cos(x[1]), -x[0] * math.cos(x[2]) * math.sin(x[1]), -x[0] * math.sin(x[2])]
        )
        for i, wrong in enumerate((x[9:12] + cross - C.T @ ua, v + cross - C.T @ back, v - cross - C.T @ ua)):
            off[i] += np.abs(tk[15:18] + T.T @ wrong - x[12:15]).max() / 20
    assert (off > 0.5).all(), off


# --- choice ------------------------------------------------------------------------------------------------------------


def test_what_an_estimator_cannot_do_is_refused_by_name() -> None:
    for bad in (NavParams(model="hybrid"), NavParams(local_probes=True, colour="removed", colour_tau_s=1.0)):
        with pytest.raises(ConfigError, match=r"nav\.(model|local_probes)"):
            RelativeNav(AC, bad)
    for bad in (NavParams(rotational_wind=True), NavParams(local_probes=True)):
        with pytest.raises(ConfigError, match="receiver only"):
            AirframeNav(AC, bad)


# --- on the plant's frames ---------------------------------------------------------------------------------------------

WHITE: dict[str, dict[str, Any]] = {
    "rotational": ROT,
    "local": {"nav__local_probes": True},
    "local_rotational": {"nav__local_probes": True, **ROT},
    "printed": PRINTED,
    "single": {"nav__adapt_wind": "single"},
    "bank": {"nav__adapt_wind": "bank"},
    "dryden": {"nav__wind_model": "dryden"},
    "dryden_bank": {"nav__wind_model": "dryden", "nav__adapt_wind": "bank"},
    "gauss_markov": {"nav__wind_model": "gauss_markov"},
    "ukf_rotational": {"nav__filter": "ukf", **ROT},
}


@pytest.fixture(scope="module")
def white() -> dict[str, dict[str, np.ndarray]]:
    return Rig(5, 25.0, mismatch=0.1, shadows=WHITE).run()


@pytest.mark.parametrize("name", WHITE)
def test_white_noise_variants_stay_within_their_bounds(white: dict[str, dict[str, np.ndarray]], name: str) -> None:
    """Relative position, relative velocity and wind, ten per cent aerodynamic error, wake; printed method: its own bound."""
    rel, vel, wind = (rms(after(white, name, k)) for k in ("rel", "vel", "wind"))
    print(f"{name}: rms position {rel.round(3)} m, velocity {vel.round(3)} m/s, wind {wind.round(3)} m/s")
    printed = name == "printed"
    assert after(white, name, "valid").all()
    assert (rel < (0.5 if printed else 0.25)).all()
    assert (vel < (0.6 if printed else 0.2)).all()
    assert (wind < 0.8).all()


def test_square_root_and_covariance_form_agree(white: dict[str, dict[str, np.ndarray]]) -> None:
    assert np.abs(white["ukf_rotational"]["rot"] - white["rotational"]["rot"]).max() < 1e-6


@pytest.mark.parametrize("seeds", [(11, 12, 13)])
def test_rotational_wind_follows_the_wake_and_what_it_does_to_station_keeping(seeds: tuple[int, ...]) -> None:
    """q_eff is about -0.02 rad/s at contact. Exact model: its error is well below not estimating it; effect on the loop."""
    q, without, xi = [], [], []
    for seed in seeds:
        a, b = Rig(seed, 25.0).run(), Rig(seed, 25.0, receiver=ROT).run()
        true = after(b, "truth", "wind_rot")
        assert -0.035 < true[:, 1].mean() < -0.012
        e = rms(after(b, "flown", "rot") - true)
        assert (np.abs(after(b, "flown", "rot") - true) < 4.0 * after(b, "flown", "rot_sigma")).mean() > 0.97
        q.append(e[1])
        without.append(rms(true)[1])
        xi.append(rms(after(b, "truth", "xi")) - rms(after(a, "truth", "xi")))
        assert (rms(after(b, "flown", "w_b")) < rms(after(a, "flown", "w_b"))).all()
    n = len(seeds)
    half = float(student.ppf(0.975, n - 1)) * np.std(q, ddof=1) / math.sqrt(n)
    print(f"q_eff rms error {np.mean(q):.4f} +- {half:.4f} rad/s (95 %), without {np.mean(without):.4f}")
    print(f"station keeping, with less without: {np.mean(xi, axis=0).round(4)} m rms")
    assert np.mean(q) + half < 0.75 * np.mean(without)
    assert np.abs(np.mean(xi, axis=0)).max() < 0.01


def test_aerodynamic_error_passes_for_rotational_wind_but_does_no_harm() -> None:
    """A moment error of ten per cent is as large as the wake's damping moment: the state then absorbs both."""
    for seed in (11, 16):
        log = Rig(seed, 25.0, mismatch=0.1, shadows={"rot": ROT}).run()
        e = rms(after(log, "rot", "rot") - after(log, "truth", "wind_rot"))
        print(f"seed {seed}: rotational wind rms error {e.round(4)} rad/s with 10 % aerodynamic error")
        assert (e < 0.1).all()
        assert (rms(after(log, "rot", "rel")) < rms(after(log, "flown", "rel")) + 0.01).all()
        assert (rms(after(log, "rot", "wind")) < rms(after(log, "flown", "wind")) + 0.1).all()


def test_probes_of_their_own_help_only_when_they_are_not_biased() -> None:
    """Bias of a flow angle between probes looks like rotational wind: 0.0015 rad of 195 m/s over 7 m is 0.04 rad/s."""
    shadows = {"rot": ROT, "both": {**ROT, "nav__local_probes": True}}
    err = {}
    for scale in (0.0, 1.0):
        log = Rig(5, 25.0, plant={"noise.bias_scale": scale}, shadows=shadows).run()
        true = after(log, "truth", "wind_rot")
        err[scale] = {k: rms(after(log, k, "rot") - true) for k in shadows}
        print(f"bias scale {scale}: { ({k: v.round(4) for k, v in err[scale].items()}) } rad/s")
    assert (err[0.0]["both"] < 0.02).all()
    assert err[1.0]["both"].max() > 2.0 * err[0.0]["both"].max()


COLOURED: dict[str, dict[str, Any]] = {
    "augmented": {"nav__colour": "augmented"},
    "removed": {"nav__colour": "removed"},
    "removed_printed": {"nav__colour": "removed", "nav__colour_form": "printed"},
    "augmented_rotational": {"nav__colour": "augmented", **ROT},
    "augmented_local": {"nav__colour": "augmented", "nav__local_probes": True},
    "removed_rotational": {"nav__colour": "removed", **ROT},
    "removed_calculated": {"nav__colour": "removed", "nav__cmw": True, "nav__velocity": False},
}
TAU = {"nav__colour_tau_s": 1.0}


@pytest.fixture(scope="module")
def coloured() -> dict[str, dict[str, np.ndarray]]:
    shadows = {k: {**TAU, **v} for k, v in COLOURED.items()}
    shadows["ignored"] = {}
    return Rig(5, 25.0, plant={"noise.tau_s": 1.0}, tanker=TAU, receiver=TAU, shadows=shadows).run()


@pytest.mark.parametrize("name", ["flown", *COLOURED])
def test_coloured_noise_variants_stay_within_their_bounds(
    coloured: dict[str, dict[str, np.ndarray]], name: str
) -> None:
    """Noise of all sensors of both aircraft with tau 1 s; "flown" is scaled R."""
    rel, vel, wind = (rms(after(coloured, name, k)) for k in ("rel", "vel", "wind"))
    print(f"{name}: rms position {rel.round(3)} m, velocity {vel.round(3)} m/s, wind {wind.round(3)} m/s")
    removed = name.startswith("removed")
    assert after(coloured, name, "valid").all()
    assert (rel < (0.9 if removed else 0.5)).all()
    assert (vel < (0.9 if removed else 0.4)).all()
    assert (wind < 1.2).all()


def test_noise_states_know_the_closure_rate_best(coloured: dict[str, dict[str, np.ndarray]]) -> None:
    vel = {
        k: float(np.linalg.norm(rms(after(coloured, k, "vel")))) for k in ("flown", "augmented", "removed", "ignored")
    }
    print(f"relative velocity rms: {vel}")
    assert vel["augmented"] < min(vel["flown"], vel["removed"])


@pytest.mark.parametrize(("sigma", "factor"), [(0.39, 1.0), (2.0, 5.1)])
def test_adapted_wind_noise_is_within_ten_per_cent_of_the_tuned_filter(sigma: float, factor: float) -> None:
    """Same parameters at two turbulence levels, both aircraft; reference: q_wind scaled with the true sigma."""
    ways: dict[str, dict[str, Any]] = {"single": {"nav__adapt_wind": "single"}, "bank": {"nav__adapt_wind": "bank"}}
    log = Rig(
        3, 45.0, plant={"wind.dryden.sigma_mps": sigma, "noise.bias_scale": 0.0},
        tanker_shadows={**ways, "tuned": {"nav__q_wind": 0.33 * factor}},
        shadows={**ways, "tuned": {"nav__q_wind": 0.40 * factor}},
    ).run()  # fmt: skip
    for side in ("tanker.", ""):
        e = {k: float(np.linalg.norm(rms(after(log, side + k, "wind")))) for k in (*ways, "tuned", "flown")}
        q = {k: round(float(after(log, side + k, "q").mean()), 2) for k in ways}
        print(
            f"sigma {sigma} {side or 'receiver'}: wind rms { ({k: round(v, 3) for k, v in e.items()}) } m/s, mean q {q}"
        )
        for way in ways:
            assert e[way] < 1.10 * e["tuned"], (side, way)


def test_scatter_of_the_tankers_rates_does_not_pull_the_position_to_the_tanker() -> None:
    """Errors in variables: w_T x xi with a noisy w_T taken as exact, beside closure rates trusted to a millimetre per second."""
    off = {"nav__gate__false_alarm": 0.0}  # a gate told the scatter is zero would refuse what the test is about
    own = {**TAU, **off, "nav__colour": "augmented"}
    shadows = {"allowed": own, "exact": {**own, "nav__r_peer_rate": 0.0}}
    log = Rig(5, 25.0, plant={"noise.tau_s": 1.0}, tanker=own, receiver=TAU | off, shadows=shadows).run()
    x = {k: abs(float(after(log, k, "rel")[:, 0].mean())) for k in shadows}
    print(f"mean error of xi_x: {x} m")
    assert x["allowed"] < 0.5 * x["exact"]
    assert x["allowed"] < 0.8
