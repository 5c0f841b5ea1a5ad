"""Join-up guidance on a point mass: closure profile, no overshoot, wake and tanker kept clear, rules; refuelling by rule."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.missions.receiver.joinup import (
    ENROUTE,
    INIT,
    JOIN_UP,
    JoinUpGuidance,
    JoinUpParams,
    Sight,
    closure,
    may_close,
    wanted,
)
from flightsw.missions.receiver.refuel import (
    BREAKAWAY,
    CONTACT,
    DISCONNECT,
    OBSERVATION,
    PRECONTACT,
    RETURN,
    TO_CONTACT,
)
from flightsw.missions.receiver.sequence import Sequence, SequenceParams
from flightsw.strict import ConfigError
from flightsw.types import NavState, SensorFrame
from hil_scripts.studies.joinup.point import DT
from hil_scripts.studies.joinup.point import PointJoin as Flight

P = JoinUpParams()


# --- the profile ----------------------------------------------------------------------------------------------------
def test_closure_brakes_with_constant_deceleration_far_out_and_less_near_the_aim() -> None:
    g = np.linspace(0.0, 3000.0, 3001)
    v = np.array([closure(x, P) for x in g])
    assert v[0] == 0.0 and v.max() == P.v_max_mps and (np.diff(v) >= 0.0).all()
    braking = np.gradient(v, g) * v  # dv/dt along the profile
    assert braking.max() <= P.a_close_mps2 * (1.0 + 1e-6)
    inside = (v > 10.0) & (v < P.v_max_mps)
    assert braking[inside][:-2].min() > 0.85 * P.a_close_mps2
    assert closure(10.0, P) == pytest.approx(P.a_close_mps2 / P.v_slow_mps * 10.0, rel=0.2)


@given(st.floats(0.0, 1e5))
def test_closure_ahead_of_the_aim_is_backwards_and_bounded(gap: float) -> None:
    assert -P.v_back_mps <= closure(-gap, P) <= 0.0
    assert closure(gap, P) >= 0.0


@given(st.floats(-6000.0, 2000.0), st.floats(-3000.0, 3000.0), st.floats(-100.0, 1000.0))
def test_what_is_wanted_never_leads_into_the_wake(x: float, y: float, z: float) -> None:
    vx, _, want = wanted((x, y, z), P)
    assert P.aim_m[2] <= want <= P.separation_m
    if y < P.corridor_y_m:
        assert want >= P.wake_z_m
    if not may_close((x, y, z), P) and x > P.stay_back_m:
        assert vx <= 0.0


def test_positions_that_contradict_each_other_are_refused() -> None:
    with pytest.raises(ConfigError, match="aim_m"):
        replace(P, aim_m=(10.0, 65.0, 5.0))
    with pytest.raises(ConfigError, match="corridor_y_m"):
        replace(P, aim_m=(-80.0, 10.0, 5.0))


# --- flown ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("y", [-900.0, -150.0, 0.0, 60.0, 700.0])
@pytest.mark.parametrize("x", [-5200.0, -3704.0, -1500.0])
@pytest.mark.parametrize("V", [188.0, 203.7, 218.0])
def test_it_arrives_without_overshoot_and_clear_of_the_wake(x: float, y: float, V: float) -> None:
    f = Flight(x=x, y=y, V=V)
    r = f.fly(700.0, stop_when_ready=True)
    assert f.g.ready, "station keeping could take over"
    assert r[:, 0].max() < P.aim_m[0], "never past the aim"
    assert r[:, 3].max() < P.v_max_mps + max(3.0, V - f.V_tanker)
    crossing = r[(np.abs(r[:, 1]) < 25.0)]  # the cores are 15.6 m either side
    assert not len(crossing) or crossing[:, 2].min() > 100.0
    near = r[:, 0] > P.stay_back_m
    assert r[near, 1].min() > P.corridor_y_m - 5.0


def test_held_on_it_stops_at_the_aim() -> None:
    f = Flight(x=-600.0, y=65.0, z=90.0)
    r = f.fly(500.0)
    assert np.abs(r[-1, :3] - P.aim_m).max() < 2.0
    assert r[:, 0].max() < P.aim_m[0] + 2.0


@pytest.mark.parametrize("bias", [-1.5e-3, 1.5e-3])
def test_gyro_biases_do_not_keep_it_from_the_aim(bias: float) -> None:
    f = Flight(y=200.0, rate_bias=bias)
    f.fly(700.0)
    assert f.g.ready
    assert abs(f.y - P.aim_m[1]) < 3.0


@pytest.mark.parametrize("y", [-300.0, 10.0, 400.0])
def test_a_receiver_that_is_ahead_falls_back_below_before_it_climbs(y: float) -> None:
    f = Flight(x=400.0, y=y, V=200.0)
    r = f.fly(600.0, stop_when_ready=True)
    assert f.g.ready
    ahead = r[:, 0] > -40.0
    assert ahead.any() and r[ahead, 2].min() > 250.0


def test_wind_in_the_climb_does_not_disturb_it() -> None:
    calm, blown = (Flight(wind=w) for w in ((0.0, 0.0), (40.0, 30.0)))
    a, b = calm.fly(400.0, stop_when_ready=True), blown.fly(400.0, stop_when_ready=True)
    assert abs(len(a) - len(b)) * DT < 3.0


# --- rules ----------------------------------------------------------------------------------------------------------
def test_join_up_starts_once_the_tanker_flies_straight_in_sight() -> None:
    f = Flight()
    f.seen = False
    f.fly(5.0)
    assert f.g.phase == ENROUTE
    f.seen, f.turn_rate = True, math.radians(1.2)
    f.fly(20.0)
    assert f.g.phase == ENROUTE, "a turning tanker is not joined"
    f.turn_rate = 0.0
    f.fly(1.5)
    assert f.g.phase == ENROUTE
    f.fly(5.0)
    assert f.g.phase == JOIN_UP and "in sight" in f.g.reason


def test_a_tanker_that_comes_head_on_is_not_joined() -> None:
    f = Flight(heading_error=math.pi - 0.5)
    f.fly(4.0)
    assert f.g.phase == ENROUTE


def test_out_of_sight_it_goes_down_and_slower_than_the_tanker() -> None:
    f = Flight(x=-900.0, y=65.0, z=150.0, p=replace(P, track_deg=math.degrees(0.4)))
    f.fly(20.0)
    assert f.g.phase == JOIN_UP
    f.seen = False
    f.fly(P.lost_s - 0.5)
    assert f.g.phase == JOIN_UP, "a short gap is flown through"
    f.fly(120.0)
    assert f.g.phase == ENROUTE and "out of sight" in f.g.reason
    assert f.V_tanker > f.V and f.h == pytest.approx(P.alt_m, abs=5.0)


def test_station_keeping_is_not_begun_behind_a_turning_tanker() -> None:
    f = Flight(x=-110.0, y=65.0, z=8.0, V=195.0)
    f.fly(6.0)
    assert f.g.ready
    f.turn_rate = math.radians(1.7)
    f.fly(3.0)
    assert not f.g.ready


def test_the_track_is_captured_and_held_in_wind() -> None:
    f = Flight(p=replace(P, track_deg=math.degrees(0.4), track_point_m=(9500.0, -19000.0)))
    f.seen = False
    f.fly(400.0)
    c, s = math.cos(0.4), math.sin(0.4)
    cross = c * (f.pos[1] + 19000.0) - s * (f.pos[0] - 9500.0)
    assert abs(cross) < 5.0
    assert pytest.approx(P.V_mps, abs=0.1) == f.V
    assert pytest.approx(P.alt_m, abs=0.5) == f.h


def test_nothing_is_commanded_to_jump() -> None:
    f = Flight(y=-600.0)
    out = []
    for _ in range(round(300.0 / DT)):
        f.step()
        out.append((f.g.out.V, f.g.out.alt_m, f.g.out.psi_dot))
    d = np.abs(np.diff(np.array(out[2:]), axis=0)) / DT
    assert d[:, 0].max() <= P.V_accel_mps2 + 1e-9
    assert d[:, 1].max() <= P.climb_max_mps + 1e-9
    assert d[:, 2].max() <= math.radians(P.turn_accel_degps2) + 1e-9


def test_it_waits_for_navigation() -> None:
    g = JoinUpGuidance(P)
    o = g.step(0, NavState(), Sight(), DT)
    assert o.phase == INIT and not g.ready


# --- refuelling by rule ---------------------------------------------------------------------------------------------
class Clock:
    """Calls a sequence every DT in one phase after the other."""

    def __init__(self, **p: object) -> None:
        self.s = Sequence(SequenceParams(auto=True, **p))  # type: ignore[arg-type]
        self.f = SensorFrame()

    def due(self, phase: int, seconds: float, at_rest: bool = True) -> list[int]:
        n = round(seconds / DT)
        return [a for _ in range(n) if (a := self.s.step(self.f, phase, at_rest, DT))]


def test_each_phase_is_ordered_after_its_rest() -> None:
    c = Clock(observe_s=20.0, precontact_s=15.0, contact_s=60.0, leave_s=5.0)
    assert c.due(OBSERVATION, 200.0, at_rest=False) == []
    assert c.due(OBSERVATION, 19.9) == []
    assert c.due(OBSERVATION, 0.2)[0] == 2
    assert c.due(PRECONTACT, 14.9) == [] and c.due(PRECONTACT, 0.2)[0] == 3
    assert c.due(TO_CONTACT, 50.0) == []
    assert c.due(CONTACT, 59.9) == [] and c.due(CONTACT, 0.2)[0] == 4
    assert c.due(DISCONNECT, 20.0) == []
    assert c.due(PRECONTACT, 4.9) == [] and c.due(PRECONTACT, 0.2)[0] == 6
    assert c.due(RETURN, 50.0) == [] and c.due(OBSERVATION, 100.0) == []


def test_the_fuel_wanted_ends_the_contact() -> None:
    c = Clock(contact_s=1000.0, fuel_kg=2400.0)
    c.f.fuel_kg = 2500.0
    assert c.due(CONTACT, 10.0) == [], "not without the boom"
    c.f.boom_contact = True
    assert c.due(CONTACT, 0.1)[0] == 4


def test_a_breakaway_ends_the_sequence() -> None:
    c = Clock()
    assert c.due(BREAKAWAY, 0.1) == []
    assert c.due(OBSERVATION, 500.0) == [] and not c.s.on


def test_without_auto_the_ground_decides() -> None:
    s = Sequence(SequenceParams())
    assert not any(s.step(SensorFrame(), OBSERVATION, True, DT) for _ in range(2000))


@settings(deadline=None, derandomize=True, max_examples=10)
@given(
    st.floats(-5500.0, -800.0), st.floats(-1500.0, 1500.0), st.floats(190.0, 215.0), st.floats(-40.0, 40.0),
    st.floats(-40.0, 40.0),
)  # fmt: skip
def test_from_anywhere_behind_it_arrives(x: float, y: float, V: float, wn: float, we: float) -> None:
    f = Flight(x=x, y=y, V=V, wind=(wn, we))
    r = f.fly(900.0, stop_when_ready=True)
    assert f.g.ready and r[:, 0].max() < P.aim_m[0]
