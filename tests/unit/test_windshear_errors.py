"""The filter with error states: derivatives, what it learns of one error alone, an engine, honesty; printed filters unchanged."""

from __future__ import annotations

import hashlib
import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import chi2

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.engine_out import EngineOutParams, EngineWatch, approach, escape
from flightsw.missions.windshear.errors import ErrorParams, fading
from flightsw.missions.windshear.estimator import ALL as READINGS
from flightsw.missions.windshear.estimator import RADIO, WindshearNav, WindshearParams, start_sigma
from flightsw.missions.windshear.lift_witness import LiftWitness
from flightsw.missions.windshear.model import PathDemand, parameter_vector
from flightsw.missions.windshear.trust import Trust, TrustParams
from flightsw.missions.windshear.units import SATELLITES
from flightsw.types import HF_ENGINE
from hil_scripts.studies.jing import flight as jf
from hil_scripts.studies.jing import study as jing
from hil_scripts.studies.jing.sensor_faults import FIXED
from hil_scripts.studies.jing.sensor_flight import CLEAN, OTHER_AIRCRAFT, WHO, SensorFlight
from sim_plant.aircraft.twinjet.flight import TwinJetAir, TwinJetParams
from sim_plant.failures.script import Event
from sim_plant.wind.microburst import MICROBURSTS

ERRORS = ErrorParams(airspeed_lag_s=0.1, vane_lag_s=0.05)
U = np.array([35.0, 0.01])
DT = 0.02
X0 = np.array(
    [-3000.0, 200.0, 76.0, -0.05, 0.07, 0.01, 30.0, -2.0, 0.5, 0.3, -0.2, 0.05, 0.02, 1.05, 0.95]
    + [0.1, -0.2, 0.02, 0.3, 12.0, 0.9, 1.1, 0.01, 75.5, 0.068, 1e-3]
)


def par() -> np.ndarray:
    p = parameter_vector(twinjet())
    fading(p, ERRORS)
    return p


def rates(x: np.ndarray) -> np.ndarray:
    out = np.zeros(k.NE)
    k.rates(x, U, par(), out)
    return out


def outputs(x: np.ndarray) -> np.ndarray:
    Y = np.zeros((1, k.NZ))
    k.measure(np.array([x]), np.arange(k.NZ), k.NZ, U, par(), Y)
    return Y[0]


def test_transition_and_output_matrices() -> None:
    nav = WindshearNav(WindshearParams(states=k.NE, adaptive=False, turbulence=0.0, errors=ERRORS))
    s = start_sigma(nav.p)
    nav.start(X0, np.concatenate([s, ERRORS.start()[1], s[[k.VA, k.AL]], [ERRORS.gyro_radps]]))
    A = np.array([approx_fprime(X0, lambda x, i=i: rates(x)[i], 1e-6) for i in range(k.NE)])
    nav.step(outputs(X0), READINGS | RADIO, U, DT)
    step = np.eye(k.NE) + A * DT + 0.5 * (A * DT) @ (A * DT)  # midpoint rule
    assert pytest.approx(step, abs=3e-4) == nav.f.F  # type: ignore[attr-defined]
    want = np.array([approx_fprime(X0, lambda x, i=i: outputs(x)[i], 1e-6) for i in range(k.NZ)])
    assert pytest.approx(want, rel=2e-2, abs=2e-2) == nav.f.H  # type: ignore[attr-defined]


def test_rates_of_the_wind_die_out() -> None:
    r = rates(X0)
    assert r[k.WXDD] == pytest.approx(-X0[k.WXDD] / 5.0)
    assert r[k.WHD] == pytest.approx(X0[k.WHDD] - X0[k.WHD] / 5.0)


def flight(seed: int, *more: str) -> SensorFlight:
    return SensorFlight("windshear", seed, (*OTHER_AIRCRAFT, *more))


@cache
def approach_of(name: str) -> tuple[list[float], dict[str, float]]:
    """States [26] and figures after 30 s with one error from the start; "": with what is fixed in the grade's own sensors."""
    f = flight(5, *CLEAN)
    for event in FIXED[name].events if name else ():
        f.inject(event)
    f.fly(30.0)
    return f.mission.nav.x.tolist(), f.figures()


@pytest.mark.parametrize(
    ("name", "state", "size", "within"),
    [
        ("accel_up_plus", k.B_AH, 0.5, 0.05), ("accel_along_minus", k.B_AX, -0.5, 0.15), ("climb_plus", k.B_HD, 1.0, 0.1),
        ("vane_minus", k.B_AL, math.radians(-1.5), math.radians(0.2)), ("baro_plus", k.B_H, 20.0, 0.5),
    ],
)  # fmt: skip
def test_one_error_alone_is_learnt_and_costs_nothing(name: str, state: int, size: float, within: float) -> None:
    """Against the same flight without: what is fixed in the grade's own sensors is in both."""
    (x, got), (without, sound) = approach_of(name), approach_of("")
    assert x[state] - without[state] == pytest.approx(size, abs=within)
    assert got["slope_max_m"] == pytest.approx(sound["slope_max_m"], abs=2.0)
    assert got["aborted"] == 0.0


def test_the_airspeed_is_considered_and_not_learnt() -> None:
    """2 % of it goes into the wind, and the published sigma covers it."""
    f = flight(5, *CLEAN)
    f.inject(FIXED["airspeed_plus"].events[0])
    f.fly(30.0)
    s = f.mission.nav.sigma
    plain = math.sqrt(f.mission.nav.P[k.WX, k.WX])
    assert plain < 0.5 < 0.9 < s[k.WX] < 1.3


def test_height_and_vertical_wind_are_honest() -> None:
    """Mean square of error over sigma of six approaches, each error slow: one value a flight counts (chi-square, 99.9 %)."""
    of = [k.WH, k.H, k.WX]
    z = []
    for seed in range(11, 17):
        f = flight(seed, *CLEAN)
        f.fly(25.0)
        e = np.array(f.seen.x)[250:, of] - np.array(f.seen.truth)[250:, of]
        z.append(np.mean((e / np.array(f.seen.sigma)[250:, of]) ** 2, axis=0))
    for at, mean in zip(of, np.mean(z, axis=0), strict=True):
        assert chi2.ppf(5e-4, 6) / 6 < mean < chi2.ppf(0.9995, 6) / 6, at


def test_an_engine_that_stops_is_said_and_flown() -> None:
    f = flight(2, *CLEAN)
    f.fly(12.0)
    f.inject(Event(12.0, "engine_off", WHO, index=0))
    f.fly(30.0)
    assert 0.3 < f.seen.first("engine out") - 12.0 < 3.0
    assert f.mission.faults & HF_ENGINE and f.app.health.out.flags & HF_ENGINE
    assert f.mission.nav.x[k.K_T] == pytest.approx(0.5, abs=0.12)
    assert not f.given_up and f.figures()["slope_max_m"] < 15.0


def test_engine_watch_needs_to_be_sure_and_takes_it_back() -> None:
    w, x, s = EngineWatch(EngineOutParams()), X0.copy(), np.full(k.NE, 0.1)
    soon = range(round(EngineOutParams().held_s / DT) + 5)
    x[k.K_T] = 0.7
    assert not any(w.step(x, s, 40.0, DT) for _ in range(100))  # 0.7 + 2 * 0.1
    s[:] = 0.03
    assert not any(w.step(x, s, 5.3, DT) for _ in range(100))  # idle
    assert not any(w.step(x, s, 40.0, DT, doubt=True) for _ in range(100))  # readings that look like one
    assert any(w.step(x, s, 40.0, DT) for _ in soon) and w.out
    assert not w.step(x, s, 40.0, DT, doubt=True)  # said too early: taken back
    assert any(w.step(x, s, 40.0, DT) for _ in soon) and all(w.step(x, s, 40.0, DT) for _ in range(150))
    assert w.step(x, s, 40.0, DT, doubt=True)  # known for long
    x[k.K_T] = 1.0
    assert not all(w.step(x, s, 40.0, DT) for _ in soon) and not w.out
    assert not EngineWatch(EngineOutParams()).step(x[: k.NX], s[: k.NX], 40.0, DT)


def test_on_one_engine_the_slope_is_not_chased() -> None:
    p, x = EngineOutParams(), X0.copy()
    d = PathDemand("approach", 2.0, 75.0)
    assert approach(p, x, d, -4.0, False).climb_mps == -4.0
    x[k.VA] = 65.0
    assert approach(p, x, d, -4.0, False).climb_mps == pytest.approx(-4.0 - 0.4 * 5.0)
    assert approach(p, x, d, -4.0, True).speed_mps == 90.0
    x[k.H], x[k.VA] = 100.0, 75.0
    assert -p.sink_mps <= escape(p, x, True).climb_mps < -15.0 and 0.0 < escape(p, x, False).climb_mps <= 3.0
    x[k.H], x[k.VA] = 8.0, 58.0
    assert escape(p, x, True).climb_mps == 0.0 and escape(p, x, False).climb_mps == 0.0


def judged(
    t: Trust, baro: float, satellite: float, radio: float, h: float, seconds: float = 2.0, sigma: float = 0.0
) -> str:
    z, x, s = np.zeros(k.NZ), np.zeros(k.NX), np.zeros(k.NX)
    z[k.Y_H], z[k.Y_RA], x[k.H], s[k.H] = baro, radio, h, sigma
    why = ""
    for _ in range(round(seconds / DT)):
        why = t.step(z, READINGS | RADIO, satellite, x, s, 1.0, 0, DT)
    return why


def test_two_heights_are_judged_by_the_third() -> None:
    t = Trust(TrustParams(on=True))
    assert judged(t, 215.0, 203.0, 200.0, 200.0, 4.0) == "" and t.mask == 0
    assert judged(t, 420.0, 203.0, 200.0, 200.0) == "" and t.mask == 1 << k.Y_H  # the barometer is the odd one
    assert t.texts == ["barometer differs from the other two heights: left out"]
    assert judged(t, 205.0, 203.0, 200.0, 200.0) == "" and t.mask == 0
    assert judged(t, 205.0, 203.0, 120.0, 200.0) == "" and t.mask == RADIO
    assert judged(t, 205.0, 250.0, 200.0, 200.0, 1.5) == "" and t.mask == SATELLITES
    assert judged(t, 205.0, 250.0, 200.0, 200.0) == "without Vg, h'"  # what tells its height tells its velocity
    assert judged(Trust(TrustParams(on=True)), 205.0, 203.0, 200.0, 90.0) == "height contradicted by two instruments"


@pytest.mark.parametrize("sigma", [0.0, 4.0, 20.0])
def test_an_estimate_that_says_it_may_be_off_is_not_contradicted_within_that(sigma: float) -> None:
    """Satellites and the barometer they have set agree on one height, radio and estimate on another: by more than an instrument
    may be wrong and twice what the estimate allows itself, or by less."""
    p = TrustParams(on=True)
    for apart in (p.satellite_m + 2.0 * sigma - 0.5, p.satellite_m + 2.0 * sigma + 0.5):
        why = judged(Trust(p), 350.0 + apart, 350.0 + apart, 350.0, 350.0, sigma=sigma)
        assert (why == "height contradicted by two instruments") is (apart > p.satellite_m + 2.0 * sigma)


def test_airspeed_that_stands_still_is_told_by_the_lift() -> None:
    """Level flight with the lift of the model, 7 % of it unknown: as read and by lift agree, then the true airspeed falls."""
    p = parameter_vector(twinjet())
    w = LiftWitness(0.08, 1.0, p)
    z, ok = np.zeros(k.NZ), READINGS
    told = []
    for i in range(2000):
        V = 80.0 - max(i * DT - 15.0, 0.0)
        need = p[k.P_M] * p[k.P_G] / (0.93 * 0.5 * p[k.P_RHO] * p[k.P_S] * V * V)
        z[k.Y_VA], z[k.Y_AL] = 80.0, (need - p[k.P_L0]) / p[k.P_LA]
        told.append(w.step(z, ok, 0.0, DT))
    first = told.index(True) * DT
    assert 15.0 + 6.0 < first < 15.0 + 11.0


def test_a_vital_reading_that_is_missing_gives_the_approach_up() -> None:
    f = flight(3, *CLEAN)
    f.fly(8.0)
    f.inject(Event(8.0, "off", WHO, sensor="air", channel="alpha"))
    f.fly(10.0)
    assert f.given_up and f.seen.first("no reading of alpha") < 9.3
    assert f.seen.first("estimate not trusted: without alpha") < 9.3


def test_printed_filters_keep_their_bytes() -> None:
    """Digests of flights in a severe microburst and light turbulence: filters without error states stay as they are."""
    for name, digest in (("ukf13", "5d9dbae156b307e8"), ("ekf15", "78319dbf49ca6aab")):
        sky = TwinJetAir(MICROBURSTS["severe"], 1.07, 0.77)
        law = jing.law("managed", jing.AS_SPECIFIED)
        start = TwinJetParams(x_m=-2500.0, height_m=245.0)
        r = jf.fly(jf.FlightPlan(sky, start, jing.estimator(name), law, duration_s=50.0, monitor=True), 3)
        rows = b"".join(a.tobytes() for a in (r.truth, r.x, r.sigma, r.u, r.monitor))
        assert hashlib.sha256(rows).hexdigest()[:16] == digest, name
