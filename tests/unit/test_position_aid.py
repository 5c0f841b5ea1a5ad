"""Aids of the relative position: calibration against the relative sensor, weight of the wake position, repair of readings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.filters.gating import BENCH
from flightsw.filters.group_gate import HELD, SCORE
from flightsw.missions.receiver.aids import AidParams, PositionAid, StationHold, VelocityAid
from flightsw.missions.receiver.airdata.air_path import rate_slopes
from flightsw.missions.receiver.airdata.airdata import AirData
from flightsw.missions.receiver.airdata.airdata_params import AirDataParams
from flightsw.missions.receiver.airdata.repair import repaired
from flightsw.missions.receiver.airdata.reports import FdiStatus, WakeFix
from flightsw.missions.receiver.airdata.state import TAUGHT
from flightsw.missions.receiver.airdata.wake_filter import TRACKING
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.missions.receiver.relative_state import PEER_COAST_S, REL_MAX_S
from flightsw.refusal import REL_POS, GateParams
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, UPD_PEER, UPD_REL, Health, PeerState, SensorFrame

LEARJET = load_aircraft("learjet24")
LEVEL = np.eye(3).ravel()
TANKER = (1000.0, -200.0, -7000.0)
XI = (-35.0, 1.0, 9.0)
BIAS = np.array([1.5, -0.7, 2.0])


def core() -> EstimatorCore:
    return EstimatorCore(LEARJET, NavParams(), 20)


def frame(k: int, bias: np.ndarray = BIAS) -> SensorFrame:
    f = SensorFrame(t_us=50_000 * k, gnss_t_us=50_000 * k, rel_pos_t=XI, rel_valid=True)
    f.gnss_pos_n = tuple(float(v) for v in np.add(TANKER, XI) + bias)
    return f


def test_gnss_difference_gives_the_calibrated_position_when_the_sensor_is_silent() -> None:
    a, c = PositionAid(AidParams()), core()
    for k in range(1, 101):
        a.gnss(c, frame(k), LEVEL, np.array(TANKER), np.zeros(3), True)
    assert c.m == 0 and a.offset == pytest.approx(BIAS)
    f = frame(101)
    f.rel_pos_t = (0.0, 0.0, 0.0)  # not looked at
    a.gnss(c, f, LEVEL, np.array(TANKER), np.zeros(3), False)
    assert c.codes[: c.m].tolist() == [9, 10, 11] and c.y[:3] == pytest.approx(XI)
    a.gnss(c, f, LEVEL, np.array(TANKER), np.zeros(3), False)
    assert c.m == 3  # the same sample counts once


def test_an_uncalibrated_difference_is_not_used() -> None:
    a, c = PositionAid(AidParams()), core()
    a.gnss(c, frame(1), LEVEL, np.array(TANKER), np.zeros(3), False)
    assert c.m == 0
    for k in range(2, 60):
        a.gnss(c, frame(k), LEVEL, np.array(TANKER), np.zeros(3), True)
    a.reset()
    a.gnss(c, frame(60), LEVEL, np.array(TANKER), np.zeros(3), False)
    assert c.m == 0


def test_correlated_fixes_carry_the_information_of_one_per_two_correlation_times() -> None:
    """A white sequence every T with the variance given must hold as much information in the long run as a first-order process."""
    p = AidParams(fix_tau_s=4.0)
    a, c = PositionAid(p), core()
    T = 0.05
    for k in range(1, 3):
        c.m = 0
        fix = WakeFix(t_us=round(1e6 * T * k), valid=True, pos_f=(-35.0, 1.0, 9.0), cov_yy=0.04, cov_zz=0.09)
        a.wake(c, fix, LEVEL, -35.0)
    assert c.codes[:2].tolist() == [10, 11] and c.y[:2] == pytest.approx([1.0, 9.0])
    # sample mean over n samples of AR(1): variance -> s^2 (1 + phi) / (1 - phi) / n
    phi = math.exp(-T / p.fix_tau_s)
    assert c.r[0] ** 2 == pytest.approx(0.04 * (1 + phi) / (1 - phi), rel=1e-3)
    assert c.r[1] ** 2 == pytest.approx(0.09 * (1 + phi) / (1 - phi), rel=1e-3)
    c.m = 0
    a.wake(c, WakeFix(t_us=10**6, valid=False), LEVEL, -35.0)
    assert c.m == 0


@pytest.mark.parametrize(("cov", "valid", "good"), [(0.5, True, True), (0.7, True, False), (0.1, False, False)])
def test_what_may_hold_a_station(cov: float, valid: bool, good: bool) -> None:
    a = StationHold(AidParams(fix_sigma_max_m=0.8))
    assert a.good(WakeFix(valid=valid, cov_yy=0.01, cov_zz=cov)) is good
    assert not a.good(None)


def test_velocity_difference_is_freed_of_its_bias() -> None:
    rng = np.random.default_rng(3)
    v, out = VelocityAid(AidParams()), np.zeros(3)
    tk = np.zeros(18)
    tk[:9] = LEVEL
    tk[11] = 0.03  # turning: w x xi belongs to the inertial difference
    tk[15:18] = 195.0, 0.0, 0.0
    rate = np.array([0.2, -0.1, 0.05])
    true = rate + np.cross(tk[9:12], XI)
    for k in range(1, 800):
        f = SensorFrame(gnss_t_us=50_000 * k, rel_pos_t=XI, rel_vel_t=tuple(rate + 0.1 * rng.standard_normal(3)))
        f.gnss_vel_n = tuple(float(x) for x in tk[15:18] + true + (0.05, -0.03, 0.04))
        used = v.step(f, tk, True, out)
        assert used is (k > 20) or k in (20, 21)  # from 1 s of comparison on
        assert not v.step(f, tk, True, out)
    assert out == pytest.approx(true, abs=0.02)  # 0.1 m/s over 30 s at 20 Hz: 4 mm/s
    v.reset()
    assert v.known_s == 0.0


def test_repair_takes_the_place_of_a_bad_reading_from_the_others() -> None:
    e = np.array([195.0, 194.0, 194.5, 0.0, 0.01, -0.01, 0.05, 0.04, 0.045])
    f, y = SensorFrame(air_mask=0b101), e + 0.002
    y[4] = math.nan
    given, f = f, repaired(f, y, 0x1FF & ~(1 << 4), e)
    assert given == SensorFrame(air_mask=0b101)  # as it came
    assert f.air_beta == pytest.approx(tuple(e[3:6] + 0.002)) and f.air_bad == 0 and f.air_mask == 7
    f = repaired(f, y, 0x1FF & ~(7 << 3), e)  # no sideslip at all
    assert f.air_bad == 7 << 3
    f = repaired(f, y, 0x1FF & ~7, e)  # nor airspeed,
    assert f.air_bad & 7 == 7
    f = repaired(f, y, 0x1FF & ~7, e, 190.0)  # but one that is known without
    assert not f.air_bad & 7 and f.air_V == pytest.approx((190.5, 189.5, 190.0))


def test_nothing_is_begun_anew_or_learnt_at_an_unconfirmed_place() -> None:
    """The position of both filters is that of the relative sensor only where nobody disputes it."""
    rel = RelativeNav(LEARJET, NavParams(), aid=AidParams())
    air = AirData(LEARJET, AirDataParams(on=True, gusts_s=0.0))
    every = UPD_AIR | UPD_IMU | UPD_ATT | UPD_GNSS | UPD_REL | UPD_PEER
    u = np.array([0.0, -0.02, 0.0, 15000.0])

    def step(k: int, confirmed: bool, xi: tuple[float, float, float] = XI) -> None:
        t = 50_000 * k
        f = SensorFrame(
            t_us=t, gnss_t_us=t, air_t_us=t, att_t_us=t, rel_t_us=t, rel_valid=True, rel_pos_t=xi, air_mask=7
        )
        f.gyro_count, f.gnss_vel_n = 5, (195.0, 0.0, 0.0)
        f.gnss_pos_n = tuple(float(v) for v in np.add(TANKER, XI))
        f.air_V, f.air_alpha, f.air_beta = (195.0,) * 3, (0.0,) * 3, (0.0,) * 3
        f.peer = PeerState(t_us=t, pos_n=TANKER, vel_n=(195.0, 0.0, 0.0))
        rel.step(air.step(f, rel, Health(), every, confirmed), u, Health(), every)

    for k in range(1, 120):
        step(k, False)
    assert rel.out.rel_valid and air.wake.mode != TRACKING and air.learn.mode != TRACKING
    step(120, True)
    assert air.wake.mode == air.learn.mode == TRACKING
    for k in range(121, 133):  # half a second is bridged
        step(k, False)
    known, what = air.learn.P[TAUGHT, TAUGHT].copy(), air.learn.x[TAUGHT].copy()
    step(133, False)
    assert air.learn.mode != TRACKING or (air.learn.P[TAUGHT, TAUGHT] >= known).all()
    assert np.array_equal(air.learn.x[TAUGHT], what)
    for k in range(134, 200):
        if air.wake.mode == TRACKING:
            air.wake.x[:2] = 40.0, 40.0  # far from where the sensor says, and from what the readings bear out
        step(k, False)
        assert air.wake.mode != TRACKING or air.wake.x[0] > 20.0
    for k in range(200, 245):
        step(k, True)
    assert air.wake.mode == TRACKING and abs(air.wake.x[0]) < 10.0


def test_without_air_data_neither_monitor_nor_wake_position_is_published_as_valid() -> None:
    air, rel = AirData(LEARJET, AirDataParams(on=True)), RelativeNav(LEARJET, NavParams())
    air.status, air.fix = FdiStatus(t_us=10**7, valid=True, excluded=2), WakeFix(t_us=10**7, valid=True, reason="")
    air._air_us, air._told.valid = 10**7, True
    air.step(SensorFrame(t_us=10**7 + 400_000), rel, Health(), 0)  # a gap is none yet
    assert air.status.valid and air.fix.valid
    for _ in range(2):
        air.step(SensorFrame(t_us=10**7 + 600_000), rel, Health(), 0)
    assert not air.status.valid and air.status.excluded == 2
    assert not air.fix.valid and air.fix.reason == "no air data"
    assert [t.text for t in air.texts] == ["wake position lost: no air data"]


def test_rate_slopes_agree_with_the_cross_product() -> None:
    r = np.array([[6.5, 0.0, 0.2], [-0.5, -5.2, 0.1], [-0.5, 5.2, -0.3]])
    w = np.array([0.1, -0.2, 0.3])
    u = np.cross(w, r)
    got = (rate_slopes(r) @ w).reshape(3, 3).T
    assert got == pytest.approx(u)


@pytest.mark.parametrize("false_alarm", [0.0, 1e-6])
def test_every_aid_at_once_beside_a_relative_sensor_that_is_kept_out_has_room(false_alarm: float) -> None:
    """Its readings go on bearing witness while wake position, GNSS difference and closure rate stand in for it."""
    nav = RelativeNav(LEARJET, NavParams(gate=GateParams(false_alarm=false_alarm)), aid=AidParams())
    u = np.array([0.0, -0.02, 0.0, 15000.0])
    every = UPD_AIR | UPD_IMU | UPD_ATT | UPD_GNSS | UPD_REL | UPD_PEER

    def step(k: int) -> int:
        t = 50_000 * k
        f = SensorFrame(
            t_us=t, gnss_t_us=t, air_t_us=t, att_t_us=t, rel_t_us=t, rel_valid=True, rel_pos_t=XI, air_mask=7
        )
        f.gyro_count, f.gnss_vel_n = 5, (195.0, 0.0, 0.0)
        f.gnss_pos_n = tuple(float(v) for v in np.add(TANKER, XI))
        f.air_V, f.air_alpha, f.air_beta = (195.0,) * 3, (0.0,) * 3, (0.0,) * 3
        f.peer = PeerState(t_us=t, pos_n=TANKER, vel_n=(195.0, 0.0, 0.0))
        nav.fix = WakeFix(t_us=t, valid=True, pos_f=XI, cov_yy=0.1, cov_zz=0.1)
        nav.rate_fix = (0.0, 0.0, 0.0)
        nav.R_ft[:] = LEVEL
        return nav.step(f, u, Health(), every).nis_dof

    for k in range(1, 60):
        step(k)
    gate = nav.core.refusals
    if gate is None:
        nav.rel_us -= 10**6
    else:
        gate.gate.groups[REL_POS, [SCORE, HELD]] = BENCH, 1.0
        gate.calm, gate._held[REL_POS], nav.rel_us = False, True, nav.rel_us - 10**6
    assert step(60) >= 20


@pytest.mark.parametrize(
    ("link_s", "rel_s", "level", "sigma", "held_s"),
    [
        (0.1, 0.1, True, 0.1, 0.0),  # nothing is lost
        (0.1, 5.0, True, 0.1, 60.0),  # relative sensor silent
        (0.1, 5.0, False, 0.1, 60.0),  # the same in a turn: the tanker is known
        (0.1, 5.0, True, 1.0, 0.0),  # wake position too uncertain
        (5.0, 0.1, True, 1.0, 30.0),  # link silent in straight flight: held by the relative sensor
        (5.0, 0.1, False, 0.1, 0.0),  # in a turn
        (5.0, 5.0, True, 0.1, 0.0),  # both
    ],
)
def test_rules_of_holding(link_s: float, rel_s: float, level: bool, sigma: float, held_s: float) -> None:
    fix, hold = WakeFix(valid=True, cov_yy=sigma**2, cov_zz=sigma**2), StationHold(AidParams())
    link, seen = link_s < PEER_COAST_S, rel_s < REL_MAX_S
    held = [hold.step(round(t * 1e6), link, seen, level, fix) for t in np.arange(10.0, 80.0, 0.05)]
    assert sum(held) * 0.05 == pytest.approx(held_s, abs=0.06)
    assert held == sorted(held, reverse=True)  # once given up, it stays so
