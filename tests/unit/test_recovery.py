"""Recovery: which way surfaces and thrust go, what is believed of the sensors, when the command is taken and given back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsw import refusal as rd
from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import dcm_from_euler, quat_from_euler, rotate_dcm
from flightsw.sixdof.recovery.answer import Answer
from flightsw.sixdof.recovery.cruising import cruise
from flightsw.sixdof.recovery.degraded import Without
from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.law import RecoveryLaw, Wanted
from flightsw.sixdof.recovery.motion import angle
from flightsw.sixdof.recovery.protection import HOLDING, Protection
from flightsw.sixdof.recovery.readings import COAST_S, Readings
from flightsw.sixdof.recovery.readings_kernel import V_COAST_S
from flightsw.types import HF_ATT, UPD_AIR, UPD_ATT, UPD_BARO, UPD_IMU, Health, NavState, SensorFrame, Vec3

FELT = Felt(np.zeros(4), None)
AC = load_aircraft("learjet24")
DT, V, H = 0.05, 190.0, 7010.0
NEW = UPD_IMU | UPD_BARO | UPD_AIR | UPD_ATT
GOOD = Health()


def frame(
    euler_deg: Vec3 = (0.0, 0.0, 0.0),
    w: Vec3 = (0.0, 0.0, 0.0),
    *,
    V: float = V,
    alpha: float = 0.03,
    load: float = 1.0,
) -> SensorFrame:
    """What an aircraft reads at heading, pitch, roll [deg], rates w [rad/s], airspeed [m/s], incidence [rad], load factor."""
    q = np.zeros(4)
    quat_from_euler(*(math.radians(x) for x in euler_deg), q)
    f = SensorFrame(updated=NEW, gyro_mean_b=w, gyro_count=5, acc_mean_b=(0.0, 0.0, -9.81 * load), baro_alt_m=H)
    f.att_q_nb = (float(q[0]), float(q[1]), float(q[2]), float(q[3]))
    f.air_mask, f.air_V, f.air_beta, f.air_alpha = 7, (V,) * 3, (0.0,) * 3, (alpha + w[1] * 6.5 / V,) * 3
    return f


def command(f: SensorFrame, steps: int = 1) -> tuple[np.ndarray, float, RecoveryLaw]:
    """The law's answer after some steps of the same readings."""
    s, law = Readings(AC, H), RecoveryLaw(AC)
    for _ in range(steps):
        s.step(f, NEW, GOOD, DT)
        u, throttle = law.step(s, Wanted(V), Answer(AC, DT), DT)
    return u, throttle, law


# --- the law -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("roll", [30.0, 90.0, 150.0, 179.0])
def test_it_rolls_the_shorter_way(roll: float) -> None:
    right, left = command(frame((0.0, 0.0, roll)))[0], command(frame((0.0, 0.0, -roll)))[0]
    assert right[0] < 0.0 < left[0]  # + rolls right


def test_inverted_or_too_much_incidence_it_unloads() -> None:
    assert command(frame((0.0, 0.0, 180.0)), 20)[2]._load == pytest.approx(0.3)
    stalled = command(frame(alpha=math.radians(16.0), load=2.5))[0][1]
    c = AC.aero
    assert stalled > -(c.Cm0 + c.Cm_alpha * math.radians(16.0)) / c.Cm_de  # what holds it there; + is nose down


def test_a_dive_is_pulled_out_of_with_idle_thrust_and_a_climb_flown_with_full() -> None:
    dive, idle, law = command(frame((0.0, -50.0, 0.0)))
    assert dive[1] < command(frame())[0][1] and idle == pytest.approx(AC.engine.idle_frac)
    assert law.path == pytest.approx(math.radians(-50.0) - 0.03, abs=1e-6)
    assert command(frame((0.0, 40.0, 0.0)))[1] == pytest.approx(1.0)


def test_steep_it_goes_over_the_top_and_upright_out_of_it() -> None:
    """At 60 deg of climb inverted it stays so and pulls; at 10 deg it rolls upright."""
    over, out = command(frame((0.0, 60.0, 179.0)))[0], command(frame((0.0, 10.0, 170.0)))[0]
    assert abs(over[0]) < 0.2 * abs(out[0]) and over[1] < out[1]


@pytest.mark.parametrize("pitch", [90.0, -90.0, 89.99, -89.99])
def test_vertical_is_no_singularity(pitch: float) -> None:
    for roll in (0.0, 77.0, -160.0):
        u, throttle, _ = command(frame((13.0, pitch, roll)), 5)
        assert np.isfinite(u).all() and 0.0 < throttle <= 1.0


def test_the_load_asked_for_is_the_limit_and_more_only_in_a_steep_dive() -> None:
    low, high = AC.structure.load_g
    for pitch, roll, most in (
        (-3.0, 0.0, high / 1.5),
        (-60.0, 0.0, 0.85 * high),
        (-60.0, 180.0, 0.31),
        (70.0, 180.0, high / 1.5),
    ):
        law = command(frame((0.0, pitch, roll)), 40)[2]
        assert low / 1.5 <= law._load <= most + 1e-9, (pitch, roll)


# --- what is believed --------------------------------------------------------------------------------------------------


def test_a_leap_of_the_reference_is_not_followed_and_the_gyro_carries_on() -> None:
    s, w = Readings(AC, H), (0.3, -0.1, 0.2)
    R, out = np.zeros(9), np.zeros(9)
    dcm_from_euler(0.2, 0.1, 0.4, R)
    s.step(frame((math.degrees(0.2), math.degrees(0.1), math.degrees(0.4))), NEW, GOOD, DT)
    for _ in range(20):
        s.step(frame((90.0, -40.0, 170.0), w), NEW, GOOD, DT)  # a lie
        rotate_dcm(R, np.array(w), DT, out)
        R[:] = out
    assert angle(s.R, R) < 1e-6 and s.trusted and s.coasting_s == pytest.approx(1.0)
    for _ in range(round(COAST_S / DT) + 1):
        s.step(frame((90.0, -40.0, 170.0)), NEW, GOOD, DT)
    assert s.coasting_s < DT + 1e-9  # after half a minute there is nothing better


def test_without_a_reference_it_coasts_and_says_when_that_is_over() -> None:
    s = Readings(AC, H)
    s.step(frame((0.0, 0.0, 20.0)), NEW, GOOD, DT)
    for _ in range(round(COAST_S / DT)):
        assert s.trusted
        s.step(frame((0.0, 0.0, 20.0)), NEW, Health(failed=HF_ATT), DT)
    assert not s.trusted and s.down == pytest.approx((0.0, math.sin(math.radians(20.0)), math.cos(math.radians(20.0))))


def test_a_leap_of_all_pitots_is_carried_over_by_the_accelerometers() -> None:
    s = Readings(AC, H)
    s.step(frame(), NEW, GOOD, DT)
    for _ in range(20):
        s.step(replace(frame(V=V - 60.0), acc_mean_b=(2.0, 0.0, -9.81)), NEW, GOOD, DT)
    assert abs(s.V - V - 20 * DT * 2.0 * math.cos(s.alpha)) < 0.1 and s.V_measured
    for _ in range(round(V_COAST_S / DT)):
        s.step(frame(), NEW & ~UPD_AIR, GOOD, DT)
    assert not s.V_measured  # nor is what was refused taken for one


def test_incidence_without_vanes_comes_from_the_load() -> None:
    s = Readings(AC, H)
    s.step(frame(load=2.0), NEW & ~UPD_AIR, GOOD, DT)
    lift = 2.0 * s.mass * 9.80665 / (s.q * AC.geometry.S_m2)
    assert s.alpha == pytest.approx((lift - AC.aero.CL0) / AC.aero.CL_alpha, rel=1e-3) and not s.alpha_measured


# --- taking and giving back --------------------------------------------------------------------------------------------


def nav_of(f: SensorFrame, valid: bool = True) -> NavState:
    """An estimate that agrees with the readings."""
    return NavState(valid=valid, V=f.air_V[0], alpha=0.03, q_nb=f.att_q_nb, w_b=f.gyro_mean_b, pos_n=(0.0, 0.0, -H))


def fly(p: Protection, f: SensorFrame, nav: NavState, seconds: float, rejoin: Rejoin | None = None) -> None:
    """The same readings for a while."""
    for _ in range(round(seconds / DT)):
        r = Rejoin() if rejoin is None else rejoin
        p.step(f, nav, NEW, GOOD, r, FELT, DT)
        if p.active:
            p.fly(r, DT)


@pytest.mark.parametrize(
    ("f", "word"),
    [
        (frame((0.0, 0.0, 66.0)), "bank"), (frame((0.0, 26.0, 0.0)), "pitch"), (frame((0.0, -26.0, 0.0)), "pitch"),
        (frame(w=(0.0, 0.4, 0.0)), "rates"), (frame(V=237.0), "airspeed"), (frame(V=138.0), "airspeed"),
    ],
)  # fmt: skip
def test_what_is_beyond_the_envelope_is_taken_and_announced(f: SensorFrame, word: str) -> None:
    p = Protection(AC, H, DT)
    fly(p, f, nav_of(f), 1.5)
    assert p.active and p.texts[0].severity == 4 and p.texts[0].text.startswith(f"recovery: {word}")


@pytest.mark.parametrize(
    "f", [frame((0.0, 0.0, 60.0)), frame((0.0, 20.0, -60.0)), frame(V=145.0), frame(w=(0.8, 0.0, 0.0))]
)
def test_what_is_inside_is_left_alone(f: SensorFrame) -> None:
    p = Protection(AC, H, DT)
    fly(p, f, nav_of(f), 3.0)
    assert not p.active and not p.texts


def test_one_sensor_alone_takes_no_command() -> None:
    """Airspeed or incidence the estimate does not share is a sensor's; one that has no estimate to ask goes by it."""
    p, slow = Protection(AC, H, DT), frame(V=130.0)
    fly(p, slow, replace(nav_of(slow), V=V), 3.0)
    assert not p.active
    fly(p, slow, nav_of(slow, valid=False), 2.0)
    assert p.active


def test_it_comes_back_by_steps_and_the_estimate_begins_again() -> None:
    p, over, level = Protection(AC, H, DT), frame((0.0, 0.0, 80.0)), frame((0.0, 1.7, 0.0))
    fly(p, over, nav_of(over), 0.1)
    assert p.active
    p.readings.known = False  # as if it had rolled back in between
    p.step(level, nav_of(level), NEW, GOOD, Rejoin(ready=False), FELT, DT)
    anew = 0
    for _ in range(round(12.0 / DT)):
        p.step(level, nav_of(level), NEW, GOOD, Rejoin(ready=False), FELT, DT)
        p.fly(Rejoin(), DT)
        anew += p.anew
    assert p.active and p._phase == HOLDING and anew == 1  # level, and not where the law can have it
    fly(p, level, replace(nav_of(level), V=V + 15.0), 4.0)
    assert p.active  # the estimate is not what the sensors say
    fly(p, level, nav_of(level), 3.0)
    assert not p.active and [t.text for t in p.texts][1:] == ["recovery: level", "recovery: control given back"]


def test_lost_navigation_is_flown_level_once_there_has_been_one() -> None:
    p, f = Protection(AC, H, DT), frame((0.0, 1.7, 0.0))
    fly(p, f, nav_of(f, valid=False), 3.0)
    assert not p.active
    fly(p, f, nav_of(f), 1.0)
    fly(p, f, nav_of(f, valid=False), 1.5)
    assert p.active and p.why == "recovery: navigation lost"


def test_thrust_beyond_command_is_flown_down_and_aside_from_what_is_close_ahead() -> None:
    f = frame((0.0, 1.7, 0.0))
    away = Rejoin(path=-0.05, side=-1.0, ready=True)
    p = Protection(AC, H, DT)
    p.answer.weak, p.answer._missed = True, (4e3, 2e3)
    fly(p, f, nav_of(f), 1.0, away)
    assert not p.active  # too little falls behind by itself
    p.answer._missed = (2e3, 4e3)
    fly(p, f, nav_of(f), 1.0)
    assert not p.active  # nothing close ahead
    fly(p, f, nav_of(f), 0.1, away)
    assert p.active and p.why == "recovery: thrust does not answer"
    u, _ = p.fly(away, DT)
    level, _ = RecoveryLaw(AC).step(p.readings, Wanted(p.readings.V), p.answer, DT)
    assert u[0] < level[0] - 0.05 and u[1] > level[1]  # to the left, and down
    fly(p, f, nav_of(f), 20.0, away)
    assert p.active


def test_a_law_of_height_is_given_the_aircraft_near_its_height() -> None:
    nav = NavState(valid=True, V=V, pos_n=(0.0, 0.0, -6000.0))
    low = cruise(V, H, nav)
    assert not low.ready and low.path == pytest.approx(math.radians(3.0))
    assert cruise(V, 6010.0, nav).ready and not cruise(V + 20.0, 6010.0, nav).ready


@pytest.mark.parametrize("rate", [-60.0, -20.0])
def test_an_airspeed_that_runs_away_is_not_followed_and_one_that_is_felt_is(rate: float) -> None:
    """A tube that ices over in seconds: 20 m/s off what the accelerometers make of the speed it is taken no more."""
    s, felt = Readings(AC, H), Readings(AC, H)
    for k in range(round(5.0 / DT)):
        V_now = max(V + rate * k * DT, 60.0)
        s.step(frame(V=V_now), NEW, GOOD, DT)
        slowing = frame(V=max(V - 5.0 * k * DT, 60.0))
        slowing.acc_mean_b = (-5.0, 0.0, -9.81)
        felt.step(slowing, NEW, GOOD, DT)
    assert abs(s.V - V) < 20.0
    assert pytest.approx(V - 25.0, abs=1.0) == felt.V and felt.V_measured


def test_lift_that_is_too_much_below_the_tanker_is_turned_away_at_once_and_by_no_single_reading_of_the_place() -> None:
    s, without = Readings(AC, H), Without(AC)
    f = frame(load=1.6)
    s.step(f, NEW, GOOD, DT)
    banks = [without.bank(s, 0.03, -0.05, -1.0 if k == 8 else 1.0, DT) for k in range(60)]
    assert min(banks) > 0.0  # one reading on the other side
    assert max(banks) == pytest.approx(math.radians(85.0)) and banks[0] == max(banks)
    assert without.lifted
    assert banks[-1] == pytest.approx(math.radians(60.0))  # not for longer than it takes
    other = [without.bank(s, 0.03, -0.05, -1.0, DT) for _ in range(20)]
    assert other[0] > 0.0 > other[-1]  # it is there that stays there
    clear, weight = Without(AC), Readings(AC, H)
    assert clear.bank(s, 0.03, 0.0, 1.0, DT) <= math.radians(60.0)  # nothing above it
    weight.step(frame(), NEW, GOOD, DT)
    assert Without(AC).bank(weight, 0.0, -0.05, 1.0, DT) <= math.radians(60.0)  # no more than its weight


def test_ailerons_that_stand_elsewhere_than_believed_are_held_against_by_more_sideslip() -> None:
    s, without = Readings(AC, H), Without(AC)
    s.step(frame(w=(-0.04, 0.0, 0.0)), NEW, GOOD, DT)  # it rolls on although it is asked back
    rudders = [without.rudder(s, -0.045, 0.2, 0.0, 2.5, DT) for _ in range(1000)]
    assert np.all(np.diff(rudders[:100]) < 0.0)  # the nose away from the falling wing
    assert rudders[-1] == rudders[-2] < rudders[0] - 0.1  # and no more once that is the most
    s.step(frame(w=(0.2, 0.0, 0.0)), NEW, GOOD, DT)
    held = [without.rudder(s, -0.045, 0.2, 0.0, 2.5, DT) for _ in range(10)]
    assert held[-1] == pytest.approx(held[0])


def test_what_the_estimate_keeps_out_is_not_gone_by() -> None:
    """A tube that closes over half a minute is slow enough to be followed; the estimate has found it by then."""
    s, told = Readings(AC, H), Health(kept_out=1 << rd.V | 1 << rd.ALPHA)
    s.step(frame(), NEW, GOOD, DT)
    for k in range(round(30.0 / DT)):
        f = frame(V=max(V - 8.0 * k * DT, 1.0))
        s.step(replace(f, air_alpha=(0.3,) * len(f.air_alpha)), NEW, told, DT, V - 3.0)
        assert s.V == V - 3.0 and not s.V_measured and not s.alpha_measured and s.alpha < 0.1
    for _ in range(20):  # the estimate begins anew, and with it everything is taken for good again
        s.step(frame(V=1.0), NEW, GOOD, DT)
    assert pytest.approx(V - 3.0, abs=1.0) == s.V
    s.step(frame(V=V), NEW, GOOD, DT)
    assert s.V == V and s.V_measured
