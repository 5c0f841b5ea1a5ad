"""Wind-shear estimators against matrix exponentials, textbook formulas and exact kinematics; starts, refusals, bad input."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import approx_fprime

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import monitor_kernel as kk
from flightsw.missions.windshear.estimator import ALL, NO_ACCELEROMETERS, WindshearNav, WindshearParams, start_sigma
from flightsw.missions.windshear.model import (
    DEG,
    FOOT,
    WindshearNoise,
    WindshearSensors,
    parameter_vector,
    process_covariance,
    triple_integrator,
)
from flightsw.missions.windshear.monitor import MonitorParams, WindshearMonitor
from hil_scripts.studies.jing import flight as jf
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams
from sim_plant.wind.microburst import MICROBURSTS

P = parameter_vector(twinjet())
X0 = np.array([-3000.0, 200.0, 76.0, -0.05, 0.07, 0.01, 30.0, -2.0, 0.5, 0.3, -0.2, 0.05, 0.02, 1.05, 0.95])
U = np.array([35.0, 0.01])
DT = 0.02


def rates(x: np.ndarray) -> np.ndarray:
    out = np.zeros(15)
    k.rates(x, U, P, out)
    return out


def outputs(x: np.ndarray) -> np.ndarray:
    Y = np.zeros((1, k.NY))
    k.measure(np.array([x]), np.arange(k.NY), k.NY, U, P, Y)
    return Y[0]


def test_transition_and_output_matrices_of_the_ekf() -> None:
    nav = WindshearNav(WindshearParams(adaptive=False, turbulence=0.0))
    nav.start(X0, start_sigma(nav.p))
    A = np.array([approx_fprime(X0, lambda x, i=i: rates(x)[i], 1e-6) for i in range(15)])
    z = outputs(X0)
    nav.step(z, ALL, U, DT)
    F = nav.f.F  # type: ignore[attr-defined]
    assert pytest.approx(expm(A * DT), abs=3e-4) == F  # midpoint rule: third order in A dt
    H = nav.f.H[: k.NY]  # type: ignore[attr-defined]
    want = np.array([approx_fprime(X0, lambda x, i=i: outputs(x)[i], 1e-6) for i in range(k.NY)])
    assert pytest.approx(want, rel=2e-2, abs=2e-2) == H


def test_accelerations_do_not_hold_the_wind_rates() -> None:
    x = X0.copy()
    a = outputs(x)
    x[k.WXD : k.KL] += np.array([1.0, -2.0, 0.3, 0.4])
    assert outputs(x) == pytest.approx(a, abs=1e-14)
    assert rates(x)[k.VA] != pytest.approx(rates(X0)[k.VA], abs=0.5)


def test_wind_noise_is_the_exact_one() -> None:
    A, B = np.diag([1.0, 1.0], 1), np.zeros((6, 6))
    B[:3, :3], B[:3, 3:], B[3:, 3:] = -A, np.diag([0.0, 0.0, 0.7]), A.T
    E = expm(B * 0.3)  # Van Loan (1978)
    assert triple_integrator(0.7, 0.3) == pytest.approx(E[3:, 3:].T @ E[:3, 3:], rel=1e-9)
    Q = process_covariance(WindshearNoise(), 15, DT)
    assert Q[np.ix_([7, 9, 11], [7, 9, 11])] == pytest.approx(triple_integrator(0.01 * FOOT**2, DT))
    assert Q[7, 8] == 0.0 and Q[k.VA, k.VA] == 0.0 and Q[k.KL, k.KL] == pytest.approx(1e-6 * DT)
    R = process_covariance(WindshearNoise().with_fictitious(), 13, DT)
    assert np.diag(R)[2:5] / DT == pytest.approx([0.2 * FOOT**2, 0.05 * DEG**2, 0.05 * DEG**2])


def test_noise_of_the_third_rates_grows_with_the_first() -> None:
    """Variance that one step adds to the wind's block: the square of 1 + gain |rate| times that without, up to a limit."""

    def added(gain: float, rate: float) -> np.ndarray:
        nav = WindshearNav(WindshearParams(adaptive=False, turbulence=0.0, wind_gain_s2pm=gain, wind_gain_max=5.0))
        x = X0.copy()
        x[[k.WXD, k.WHD]] = 0.6 * rate, -0.8 * rate
        nav.start(x, np.zeros(15))
        nav.step(outputs(x), 0, U, DT)
        return np.array(nav.P)

    plain = added(0.0, 2.0)
    for gain, rate, factor in ((0.7, 2.0, 2.4), (1.0, 0.0, 1.0), (3.0, 2.0, 5.0)):
        P2 = added(gain, rate)
        ends = [k.WXD + 2, k.WHD + 2]
        assert np.diag(P2)[ends] == pytest.approx(factor**2 * np.diag(plain)[ends], rel=1e-6)
        assert P2[k.Q, k.Q] == pytest.approx(plain[k.Q, k.Q]) and P2[k.T, k.T] == pytest.approx(plain[k.T, k.T])


def test_growing_noise_follows_a_core_crossed_low() -> None:
    """The managed escape at 35 m, where the wind changes fastest along the path: less error, and honest about it."""
    got = {}
    for gain in (0.0, 1.0):
        p = WindshearParams(wind_gain_s2pm=gain)
        plan = jf.FlightPlan(TwinJetAir(MICROBURSTS["seed"]), nav=p, duration_s=80.0)
        got[gain] = [jf.wind_errors(jf.fly(plan, seed), 45.0) for seed in (21, 22, 23)]
    for key, less in (("w_x.rms_mps", 0.85), ("w_h.rms_mps", 0.85), ("F.rms", 0.7)):
        before, after = ([e[key] for e in got[g]] for g in (0.0, 1.0))
        assert np.mean(after) < less * np.mean(before), key
    inside = [np.mean([e["w_x.inside_2sigma"] for e in got[g]]) for g in (0.0, 1.0)]
    assert inside[0] < 0.90 and 0.93 < inside[1] < 0.99


def test_step_of_the_wind_leaves_inertial_motion_alone() -> None:
    """The turbulence columns against the wind triangle with the step made in full."""
    SQ = np.zeros((15, 17))
    k.turbulence_columns(X0, 1e-4, 2e-4, 15, SQ)
    V, gamma, alpha = X0[k.VA], X0[k.GA], X0[k.AL]
    for col, (wx, wh) in ((15, (1e-4, 0.0)), (16, (0.0, 2e-4))):
        vx, vh = V * math.cos(gamma) - wx, V * math.sin(gamma) - wh
        path = math.atan2(vh, vx)
        want = [math.hypot(vx, vh) - V, path - gamma, gamma + alpha - path - alpha]
        assert SQ[[k.VA, k.GA, k.AL], col] == pytest.approx(want, rel=1e-4, abs=1e-11)
        assert SQ[[k.WX, k.WH], col] == pytest.approx([wx, wh])
        assert not SQ[[k.X, k.H, k.Q, k.T, k.KL, k.KD], col].any()


def test_drift_of_the_airspeed_in_white_wind_steps() -> None:
    """Mean of |v - w| over many steps of both signs against the second-order term."""
    x, q = X0.copy(), (0.8, 1.6)
    SQ = np.zeros((15, 2))
    k.turbulence_columns(x, *(s * math.sqrt(DT) for s in q), 0, SQ)
    node, weight = np.polynomial.hermite_e.hermegauss(9)
    V, gamma = x[k.VA], x[k.GA]
    mean = 0.0
    for a, wa in zip(node, weight, strict=True):
        for b, wb in zip(node, weight, strict=True):
            vx = V * math.cos(gamma) - a * q[0] * math.sqrt(DT)
            vh = V * math.sin(gamma) - b * q[1] * math.sqrt(DT)
            mean += wa * wb * math.hypot(vx, vh) / (2.0 * math.pi)
    assert k.turbulence_drift(x, *q) * DT == pytest.approx(mean - V, rel=1e-3)


@pytest.mark.parametrize("kind", ["ekf", "ukf", "srckf"])
def test_kinds_agree_on_a_calm_approach_and_are_consistent(kind: str) -> None:
    p = WindshearParams(filter=kind, states=13, adaptive=False, turbulence=0.0)
    plan = jf.FlightPlan(TwinJetAir(MICROBURSTS["seed"]), nav=p, duration_s=12.0)
    e = jf.wind_errors(jf.fly(plan, 7))
    assert e["nis_over_m"] == pytest.approx(1.0, abs=0.1)  # chi-square: 5400 values, deviation 0.02
    assert e["w_x.rms_mps"] < 0.2 and e["w_h.rms_mps"] < 0.12


def test_scaled_weights_are_the_corrected_ones() -> None:
    """W_c0 = lambda/(n + lambda) + (1 - a^2 + b), not lambda/((n + lambda) + (1 - a^2 + b)); columns of the factor of c P."""
    f = WindshearNav(WindshearParams(filter="ukf", states=13)).f
    lam = 0.25 * 13.0 - 13.0
    assert f.w0m == pytest.approx(lam / (13.0 + lam))  # type: ignore[attr-defined]
    assert f.w0c == pytest.approx(lam / (13.0 + lam) + 1.0 - 0.25 + 2.0)  # type: ignore[attr-defined]
    assert f.w0m + 26.0 * f.wi == pytest.approx(1.0)  # type: ignore[attr-defined]
    assert f.g**2 == pytest.approx(0.25 * 13.0)  # type: ignore[attr-defined]


def test_scales_are_learnt_and_thirteen_states_cannot() -> None:
    air = TwinJetAir(MICROBURSTS["seed"])
    wrong = {}
    for n in (13, 15):
        r = jf.fly(
            jf.FlightPlan(
                air,
                nav=WindshearParams(states=n, lift_scale=1.1, drag_scale=1.1, gate=1e6, channel_gate=1e6),
                duration_s=30.0,
            ),
            3,
        )
        wrong[n] = float(np.sqrt(np.mean((r.x[500:, k.WH] - r.truth[500:, k.WH]) ** 2)))
        if n == 15:
            assert r.x[-1, k.KL :] == pytest.approx([1.0, 1.0], abs=0.01)
    assert wrong[15] < 0.08 < 0.15 < wrong[13]


def test_cold_start_names_what_it_waits_for_and_settles() -> None:
    j = TwinJet(TwinJetParams(), TwinJetAir(MICROBURSTS["seed"]), 4, 6.0)
    nav = WindshearNav()
    u = np.array([j.controls[0] * 1e-3, j.controls[1]])
    e = nav.step(j.reading, ALL & ~(1 << k.Y_TH), u, DT)
    assert not e.valid and e.reason == "waits for theta"
    slow = j.reading.copy()
    slow[k.Y_VA] = 3.0
    assert "waits for flight" in nav.step(slow, ALL, u, DT).reason
    for _ in range(250):
        e = nav.step(j.reading, ALL, u, DT)
        j.step(j.controls)
    assert e.valid
    j.k -= 1
    d = e.x[[k.VA, k.WX, k.WH]] - j.truth[[2, 7, 8]]
    assert np.abs(d).max() < 0.5
    assert np.all(np.abs(d) < 4.0 * e.sigma[[k.VA, k.WX, k.WH]] + 0.05)


def test_bad_input_is_refused_and_says_so() -> None:
    nav = WindshearNav()
    nav.start(X0, start_sigma(nav.p))
    z = outputs(X0)
    assert "dt = 0.0" in nav.step(z, ALL, U, 0.0).reason
    assert "controls" in nav.step(z, ALL, np.array([np.nan, 0.0]), DT).reason
    z[k.Y_AL] = np.nan
    e = nav.step(z, ALL, U, DT)
    assert e.valid and e.channels == 8
    assert nav.step(z, 0, U, DT).channels == 0  # prediction only
    wild = z + 50.0
    before = nav.P[k.WX, k.WX]
    e = nav.step(wild, ALL, U, DT)
    assert e.valid and e.channels == 0 and abs(e.x[k.VA] - X0[k.VA]) < 0.5
    assert nav.P[k.WX, k.WX] > before  # refused: the wind is less certain than before
    for _ in range(nav.p.refused_max - 1):
        e = nav.step(wild, ALL, U, DT)
    assert not e.valid and nav.restarts == 1 and "starts anew" in e.reason
    for bad, text in (({"states": 14}, "states = 14"), ({"turbulence": 9.0}, "turbulence = 9.0")):
        with pytest.raises(ValueError, match=text):
            WindshearParams(**bad)  # type: ignore[arg-type]


def test_channels_can_be_left_out() -> None:
    nav = WindshearNav(WindshearParams(channels=NO_ACCELEROMETERS))
    nav.start(X0, start_sigma(nav.p))
    assert nav.step(outputs(X0), ALL, U, DT).channels == 7


def test_turbulence_intensity_follows_the_air() -> None:
    levels = []
    for sigma in (0.0, 0.5, 1.5):
        plan = jf.FlightPlan(TwinJetAir(sigma_u_mps=sigma, sigma_w_mps=sigma), nav=WindshearParams(), duration_s=25.0)
        loop = jf.Loop(plan, 11)
        r = loop.run()
        assert loop.nav is not None
        levels.append(loop.nav.turbulence)
        assert np.nanmean(r.nis[250:]) == pytest.approx(1.0, abs=0.12)
    assert levels[0] < 0.15 < levels[1] < 0.8 < levels[2]
    fixed = jf.FlightPlan(
        TwinJetAir(sigma_u_mps=1.0, sigma_w_mps=1.0),
        nav=WindshearParams(adaptive=False, turbulence=0.0, gate=1e6, channel_gate=1e6),
        duration_s=25.0,
    )
    assert np.nanmean(jf.fly(fixed, 11).nis[250:]) > 2.0


def test_kinematic_monitor_follows_exact_kinematics() -> None:
    """Straight flight in a steady wind, readings without noise: the filter must end on the wind itself."""
    m = WindshearMonitor()
    V, theta, gamma, wx, wh = 76.0, 0.03, -0.05, 4.0, -1.0
    vx, vh = V * math.cos(gamma) + wx, V * math.sin(gamma) + wh
    z = np.array([300.0, vx, V, theta - gamma, theta, 0.0, vh, 0.0, 0.0])
    assert not m.step(z, ALL & ~1, DT)
    for i in range(400):
        z[k.Y_H] = 300.0 + vh * DT * i
        assert m.step(z, ALL, DT)
    assert m.x[[kk.K_WX, kk.K_WH]] == pytest.approx([wx, wh], abs=1e-3)
    assert pytest.approx(-wh / V, abs=1e-4) == m.F
    X = np.array([m.x.copy()])
    X[0, kk.K_WXD :] = 0.1, 0.2, 0.3, 0.4
    before = X.copy()
    kk.propagate_kinematic(X, np.array([0.5, -0.2, 0.01]), 0.5)
    assert X[0, kk.K_WX] - before[0, kk.K_WX] == pytest.approx(0.1 * 0.5 + 0.3 * 0.125)
    assert X[0, kk.K_H] - before[0, kk.K_H] == pytest.approx(before[0, kk.K_VH] * 0.5 - 0.2 * 0.125)


def test_monitor_has_no_opinion_without_its_inputs() -> None:
    """A lost accelerometer or attitude is not held against the aerodynamic model."""
    for lost in (1 << k.Y_XDD | 1 << k.Y_HDD | 1 << k.Y_Q, 1 << k.Y_TH | 1 << k.Y_XDD | 1 << k.Y_HDD, 1 << k.Y_VA):
        jet = TwinJet(TwinJetParams(), TwinJetAir(MICROBURSTS["seed"]), 4, 30.0, DT)
        m = WindshearMonitor()
        for i in range(600):
            ok = ALL & ~lost if 200 <= i < 400 else ALL
            good = m.step(jet.reading, ok, DT)
            assert good is not (205 <= i < 400), i
            jet.step(jet.controls)
        assert abs(m.x[kk.K_WX] - jet.truth[7]) < 1.0
    m = WindshearMonitor()
    for i in range(300):
        good = m.step(jet.reading, ALL & ~1 if i else ALL, DT)
    assert good  # height is not needed for the wind


def test_monitor_accuses_a_wrong_aerodynamic_model_only() -> None:
    air = TwinJetAir(MICROBURSTS["seed"])
    for scale, states, accused in ((1.0, 13, False), (1.1, 13, True), (1.1, 15, False)):
        off = {"lift_scale": scale, "drag_scale": scale}
        p = WindshearParams(states=states, gate=1e6, channel_gate=1e6, adaptive=False, turbulence=0.0, **off)
        r = jf.fly(jf.FlightPlan(air, nav=p, monitor=True, duration_s=40.0), 5)
        assert r.monitor_apart is accused, (scale, states)


def test_sensor_table_is_the_print_in_metres() -> None:
    s = WindshearSensors().sigmas()
    assert s[[0, 1, 2, 6, 7, 8]] / FOOT == pytest.approx([5.0, 3.6, 1.7, 0.5, 0.322, 0.322])
    assert np.degrees(s[3:6]) == pytest.approx([0.5, 0.05, 0.05])
    assert s[7] == pytest.approx(0.01 * 9.81, rel=1e-3)  # 0.322 ft/s^2 is a hundredth of g
    assert replace(MonitorParams(), disagree_s=1.0).disagree_s == 1.0
