"""Wind and calibration of the own sensors (flightsw/sixdof/windcal): closed forms, filterpy, Monte Carlo on its own model."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.stats import chi2

from flightsw.aircraft import load_aircraft
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.sixdof.windcal import kernel
from flightsw.sixdof.windcal.feed import make_wind_calibration
from flightsw.sixdof.windcal.filter import WindCalibrator
from flightsw.sixdof.windcal.histories import Histories
from flightsw.sixdof.windcal.layout import N_BEHIND, N_FREE, WAKE, Z_ALPHA, Z_BETA, Z_V
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.sixdof.windcal.record import report_values
from flightsw.strict import ConfigError
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, SensorFrame
from ground.link.packets import decode
from ground.views.base import NOT_VALID
from ground.views.refueling.view import VIEW
from tests.unit.windcal_synth import RATE, Errors, dcm, drawn, fly, quaternion

DT = 0.4  # [s]
P = WindCalParams(on=True, V_lag_s=0.0, vane_lag_s=0.0, gust_mps=0.9)


def normal(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=n)


# --- the filter's algebra ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [N_FREE, N_BEHIND])
def test_prediction_and_scalar_corrections_are_those_of_a_kalman_filter(n: int) -> None:
    r = np.random.default_rng(n)
    A, H = r.normal(size=(n, n)), r.normal(size=(3, n))
    other = KalmanFilter(dim_x=n, dim_z=3)
    other.x, other.P = r.normal(size=(n, 1)), A @ A.T
    f, q, noise = r.uniform(0.5, 1.0, n), r.uniform(0.0, 1.0, n), r.uniform(0.5, 2.0, 3)
    x, C = other.x[:, 0].copy(), other.P.copy()
    other.F, other.Q, other.H, other.R = np.diag(f), np.diag(q * q), H, np.diag(noise)
    z = r.normal(size=3)
    other.predict()
    other.update(z)
    kernel.predict(x, C, f, q)
    nu, use = z - H @ x, np.ones(3, dtype=np.int64)
    nis = kernel.correct(x, C, H, nu, noise, use, 1e9, np.zeros(n))
    assert x == pytest.approx(other.x[:, 0], rel=1e-9) and pytest.approx(other.P, rel=1e-8, abs=1e-9) == C
    assert nis == pytest.approx(float((other.y.T @ other.SI @ other.y).item())) and list(use) == [2, 2, 2]
    assert np.array_equal(C, C.T)


def test_a_reading_beyond_the_gate_changes_nothing() -> None:
    x, C, use = np.zeros(N_FREE), np.eye(N_FREE), np.array([1, 0, 1])
    H = np.zeros((3, N_FREE))
    H[0, 0] = H[1, 1] = H[2, 2] = 1.0
    nis = kernel.correct(x, C, H, np.array([9.0, 1.0, 0.5]), np.ones(3), use, 6.0, np.zeros(N_FREE))
    assert list(use) == [1, 0, 2] and x[0] == x[1] == 0.0 and C[0, 0] == C[1, 1] == 1.0
    assert x[2] == 0.25 and nis == 0.125


@pytest.mark.parametrize("n", [N_FREE, N_BEHIND])
def test_slopes_are_those_of_the_expected_readings(n: int) -> None:
    C = dcm(2.0, 0.06, 0.5)
    R, v = C.T.ravel().copy(), np.array([-60.0, 150.0, 3.0])
    x = normal(n) * 1e-3
    x[:3], x[3:6] = (9.0, -25.0, 0.3), 0.0  # no gust: slopes are taken without it
    if n > WAKE:
        x[WAKE:] = 0.2, -0.3, 4.0
    h, H, at, unused = np.zeros(3), np.zeros((3, n)), np.zeros((2, 3)), np.zeros((3, n))
    kernel.expected(x, v, R, h, H)
    for i in range(n):
        step = 1e-4
        for k, sign in enumerate((1.0, -1.0)):
            y = x.copy()
            y[i] += sign * step
            kernel.expected(y, v, R, at[k], unused)
        assert H[:, i] == pytest.approx((at[0] - at[1]) / (2 * step), rel=1e-6, abs=1e-7), i
    exact = C.T @ (v - x[:3])
    clean = np.zeros(n)
    clean[:3] = x[:3]
    kernel.expected(clean, v, R, h, H)
    speed = np.linalg.norm(exact)
    assert h == pytest.approx([speed, math.asin(exact[1] / speed), math.atan2(exact[2], exact[0])])
    assert (h[Z_V], h[Z_BETA], h[Z_ALPHA]) == tuple(h)


def test_size_of_gusts_is_learnt_whatever_the_noise() -> None:
    r, dt, tau, sigma = np.random.default_rng(3), 0.05, 2.5, 0.8
    g, f = np.zeros(3), math.exp(-dt / tau)
    trail, sums = np.full((21, 4), np.nan), np.zeros(2)
    for k in range(20_000):
        g = f * g + math.sqrt(1 - f * f) * sigma * r.normal(size=3)
        kernel.push(trail, np.array([k * dt, *(g + 0.5 * r.normal(size=3))]))
        kernel.gust_size(trail, 500.0, 200.0, 1.0, sums)
    assert math.sqrt(sums[0] / sums[1]) == pytest.approx(sigma, rel=0.05)


# --- readings at the time they are of ---------------------------------------------------------------------------------
def test_readings_of_different_lateness_give_the_wind_of_one_time() -> None:
    """Rolling at 10 deg/s with the airspeed, the vanes, the attitude and the fixes each late by its own."""
    h, wind, worst = Histories(), np.array([5.0, -20.0, 1.0]), 0.0

    def truth(t: float) -> tuple[np.ndarray, np.ndarray]:
        C = dcm(0.3 + 0.05 * t, 0.05 + 0.01 * t, math.radians(10.0 * t))
        return C, np.array([180.0 + 2.0 * t, 40.0 - 3.0 * t, 0.5 * t]) + wind

    def reading(t: float) -> tuple[float, float, float]:
        C, v = truth(t)
        u = C.T @ (v - wind)
        V = float(np.linalg.norm(u))
        return V, math.asin(u[1] / V), math.atan2(u[2], u[0])

    w = np.zeros(3)
    for k in range(4, 80):
        t = 0.05 * k
        f = SensorFrame(
            t_us=round(t * 1e6), att_t_us=round((t - 0.02) * 1e6), gnss_t_us=round((t - 0.1) * 1e6), gyro_count=1
        )
        f.att_q_nb = tuple(
            quaternion(0.3 + 0.05 * (t - 0.02), 0.05 + 0.01 * (t - 0.02), math.radians(10.0 * (t - 0.02)))
        )
        f.gnss_vel_n = tuple(truth(t - 0.1)[1].tolist())
        f.acc_mean_b = tuple((truth(t - 0.02)[0].T @ (np.array([2.0, -3.0, 0.5]) - [0, 0, 9.80665])).tolist())
        f.air_t_us = round((t - 0.02) * 1e6)
        V, vanes = reading(t - 0.12)[0], reading(t - 0.07)[1:]
        assert h.take(f, UPD_AIR | UPD_ATT | UPD_GNSS, np.array([V, *vanes]))
        if not math.isnan(h.align(0.1, 0.05)) and k > 10:
            kernel.raw_wind(h.z, h.v, h.R, w)
            worst = max(worst, float(np.abs(w - wind).max()))
    assert 0.0 < worst < 0.02  # [m/s]; 50 ms of lateness not allowed for: 1.5


# --- what it knows ----------------------------------------------------------------------------------------------------
def test_a_turn_teaches_what_straight_flight_cannot() -> None:
    straight, turned = WindCalibrator(P, 0.0, False), WindCalibrator(P, 0.0, False)
    n = round((60.0 + math.pi / RATE) / DT)
    list(fly(straight, Errors(n), DT, 1e9))
    list(fly(turned, Errors(n), DT, 60.0))
    a, b = straight.report(), turned.report()
    assert a.scale_sigma > 0.99 * P.V_scale and b.scale_sigma < 0.35 * P.V_scale
    assert a.attitude_sigma[2] > 0.98 * math.hypot(P.att_constant, P.att_gm)
    assert b.airspeed_sigma < 0.25 * a.airspeed_sigma
    along, across = math.sqrt(a.wind_cov[0]), math.sqrt(a.wind_cov[3])
    # straight north: the airspeed's errors along, those of heading and vane across
    assert along == pytest.approx(math.hypot(195.0 * P.V_scale, P.V_offset_mps, P.V_gm_mps), rel=0.05)
    assert across == pytest.approx(195.0 * math.hypot(P.att_constant, P.att_gm, P.vane_offset, P.vane_gm), rel=0.05)
    assert max(b.wind_cov[0], b.wind_cov[3]) < 0.7**2


@pytest.mark.parametrize(("behind", "probes"), [(False, 1), (True, 3)])
def test_errors_are_as_large_as_the_covariance_says(behind: bool, probes: int) -> None:
    """Draws from its own model: normalised squared errors of straight flight, in the turn and after half a circle."""
    n, draws, looks = round(170.0 / DT), 16, [round(t / DT) for t in (45.0, 85.0, 168.0)]
    nees = np.zeros((draws, len(looks)))
    for k in range(draws):
        c = WindCalibrator(P, 0.0, behind)
        e = drawn(P, 100 + k, n, DT, probes, behind)
        for i, s in enumerate(fly(c, e, DT, 60.0, probes)):
            if i in looks:
                nees[k, looks.index(i)] = s.error @ np.linalg.solve(s.cov, s.error)
    lo, hi = chi2.ppf((0.0005, 0.9995), 3 * draws)
    assert all(lo < x < hi for x in nees.sum(axis=0)), nees.mean(axis=0) / 3


# --- faults and settings ----------------------------------------------------------------------------------------------
def test_a_spike_is_left_out_and_a_lasting_lie_begins_anew() -> None:
    n = round(40.0 / DT)
    e = Errors(n)
    e.air[50, 0] = 60.0
    c = WindCalibrator(P, 0.0, False)
    steps = list(fly(c, e, DT, 1e9))
    assert c.out.refused == 1 and c.out.restarts == 0 and all(s.nav.wind_valid for s in steps[10:])
    e.air[60:, 0] = 60.0
    c = WindCalibrator(P, 0.0, False)
    list(fly(c, e, DT, 1e9))
    assert [t.text for t in c.tell()] == ["air data contradict the wind estimate, it begins anew"] and not c.tell()
    assert c.out.restarts == 1 and c.out.refused >= P.restart_s / DT


def test_readings_kept_out_are_not_used_and_sigma_grows() -> None:
    c, step = WindCalibrator(P, 0.0, False), WindCalibrator.step
    steps = fly(c, Errors(300), DT, 1e9)
    before = [next(steps) for _ in range(150)][-1].nav.wind_sigma
    c.step = lambda f, updated, air, probes: step(c, f, updated, air + [9.0, 0.0, 0.0], probes, 1)  # type: ignore[method-assign, assignment]
    after = list(steps)[-1]
    assert abs(after.error[0]) < 0.1 and after.nav.wind_sigma[0] > before[0] and c.out.refused == 0


def test_nothing_is_forgotten_while_all_air_data_are_kept_out() -> None:
    c, step = WindCalibrator(P, 0.0, False), WindCalibrator.step
    steps = fly(c, Errors(300), DT, 10.0)
    known = [next(steps) for _ in range(250)] and c.report().scale_sigma
    c.step = lambda f, updated, air, probes: step(c, f, updated, air, probes, 0b111)  # type: ignore[method-assign, assignment]
    assert not list(steps)[-1].nav.wind_valid
    assert c.out.restarts == 0 and c.report().scale_sigma == pytest.approx(known) and known < 0.5 * P.V_scale


def test_losing_probes_opens_the_estimate() -> None:
    c, f = WindCalibrator(P, 0.0, False), Errors(100)
    list(fly(c, f, DT, 1e9, probes=3))
    three = c.report().airspeed_sigma
    c._regroup(1)
    one = c.report().airspeed_sigma
    assert three < one == pytest.approx(math.sqrt(3.0) * three, rel=0.02)


def test_no_reading_no_wind() -> None:
    c = WindCalibrator(P, 0.0, False)
    steps = fly(c, Errors(100), DT, 1e9)
    assert [next(steps).nav.wind_valid for _ in range(50)][-1]
    c.step = lambda *a: None  # type: ignore[method-assign]
    assert not list(steps)[-1].nav.wind_valid and not c.out.valid


def test_a_copy_goes_on_to_the_bit() -> None:
    c = WindCalibrator(P, 0.0, True)
    e = drawn(P, 5, 60, DT, 1, True)
    flight = fly(c, e, DT, 4.0)
    for _ in range(30):
        next(flight)
    twin = copy.deepcopy(c)
    f = SensorFrame(t_us=12_000_000, att_t_us=12_000_000, gnss_t_us=12_000_000, air_t_us=12_000_000, gyro_count=1)
    for one in (c, twin):
        one.step(f, UPD_AIR | UPD_ATT | UPD_GNSS, np.array([195.0, 0.0, 0.05]), 1)
    assert np.array_equal(c.x, twin.x) and np.array_equal(c.P, twin.P) and c.t == twin.t


def test_keys_that_nothing_obeys_are_refused_by_name() -> None:
    ac = load_aircraft("kc135r")
    assert make_wind_calibration(ac, WindCalParams()) is None
    assert make_wind_calibration(ac, WindCalParams(on=True)) is not None
    with pytest.raises(ConfigError, match=r"wind_calibration\.V_scale = 0\.02: nothing obeys it without"):
        make_wind_calibration(ac, WindCalParams(V_scale=0.02))
    with pytest.raises(ConfigError, match=r"wind_calibration\.wake_down_mps = 4\.0: allowed for a receiver only"):
        make_wind_calibration(ac, replace(WindCalParams(on=True), wake_down_mps=4.0))
    assert make_wind_calibration(ac, WindCalParams(on=True, wake_down_mps=4.0), behind=True) is not None


# --- on the wire ------------------------------------------------------------------------------------------------------
def test_what_was_learnt_goes_down_and_is_on_the_monitor() -> None:
    c, e = WindCalibrator(P, 0.0, False), Errors(40, scale=0.01)
    list(fly(c, e, DT, 1e9))
    r = c.report()
    packet = Sender(1, 1).pack(BY_NAME["WIND_CALIBRATION"], *next(report_values(r)))
    m = decode(packet)
    assert m["wind"] == pytest.approx(r.wind, rel=1e-6) and m["wind_cov"][3] == pytest.approx(c.P[1, 1], rel=1e-6)
    assert (m["scale"], m["vanes_sigma"][1]) == pytest.approx((r.scale, r.vanes_sigma[1]), rel=1e-6)
    assert m["attitude_sigma"] == pytest.approx(r.attitude_sigma, rel=1e-6)
    assert (m["valid"], m["restarts"], m["nis_dof"]) == (1, 0, 3)
    (line,) = VIEW.words({"WIND_CALIBRATION": m})  # type: ignore[arg-type]
    assert line.label == "sensors" and line.text.startswith("airspeed ") and " heading " in line.text
    (line,) = VIEW.words({"WIND_CALIBRATION": m | {"valid": 0}})  # type: ignore[arg-type]
    assert line.text == NOT_VALID
