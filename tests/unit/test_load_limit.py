"""The load an elevator command leads to, against the plant's flight of it, and what is made of commands beyond it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.load_limit import AHEAD_S, LoadLimit
from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.protection import Protection
from flightsw.types import ActuatorCmd, Health, NavState, SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.world import World

FELT = Felt(np.zeros(4), None)
SETS = {
    "wind.wake.source": "",
    "wind.dryden.sigma_mps": 0.0,
    "wind.prevailing": "constant",
    "wind.constant_mps": [0.0, 0.0],
}


def world() -> tuple[World, NavState, np.ndarray]:
    """The receiver in calm air in trim, its state as an estimate, and its trim command [4]."""
    w = World(load_scenario("refueling", SETS), 1)
    w.sense()
    v = w.members[1].view
    nav = NavState(
        valid=True, V=v.o[n.O_V], alpha=v.o[n.O_ALPHA], beta=v.o[n.O_BETA], q_nb=tuple(v.s[0:4]),
        pos_n=tuple(v.s[n.S_P : n.S_P + 3]), w_b=tuple(v.s[n.S_W : n.S_W + 3]),
    )  # fmt: skip
    c = w.trim_cmd(1)
    return w, nav, np.array([c.aileron, c.elevator, c.rudder, v.s[n.S_T]])


@pytest.mark.parametrize("step_deg", [-3.0, -1.0, 1.0, 3.0])
def test_load_is_that_of_the_flight_a_quarter_second_after_the_servo(step_deg: float) -> None:
    """The servo takes 0.1 to 0.2 s: the flight passes through it between 0.35 and 0.45 s."""
    w, nav, u = world()
    limit = LoadLimit(load_aircraft("learjet24"))
    frame = SensorFrame(fuel_kg=w.members[1].view.s[n.S_FUEL], fuel_t_us=1)
    limit.bound(u, frame, nav)
    level = limit.load(u, nav)
    assert level == pytest.approx(1.0, abs=0.03)
    trim = [w.trim_cmd(i) for i in range(2)]
    moved = ActuatorCmd(
        aileron=trim[1].aileron, elevator=trim[1].elevator + math.radians(step_deg), rudder=trim[1].rudder,
        throttle=trim[1].throttle,
    )  # fmt: skip
    flown = []
    for _ in range(w.rate_hz // 2):
        w.step([trim[0], moved])
        w.sense()
        flown.append(-w.members[1].view.o[2] / n.G0)
    u[1] += math.radians(step_deg)
    early, late = (flown[round((AHEAD_S + servo) * w.rate_hz)] for servo in (0.1, 0.2))
    assert min(early, late) < limit.load(u, nav) < max(early, late) and abs(late - level) > 0.3


def test_holding_an_elevator_back_is_told_once_while_it_lasts() -> None:
    _, nav, u = world()
    guard, frame = Protection(load_aircraft("learjet24"), 7010.0, 0.05), SensorFrame()
    hard = u + np.array([0.0, math.radians(14.0), 0.0, 0.0])
    for _ in range(20):
        guard.step(frame, NavState(), 0, Health(), Rejoin(), FELT, 0.05)
        assert guard.bound(hard, frame, nav)[1] < hard[1]
    [text] = guard.texts
    assert text.text.startswith("elevator held back: -") and text.severity == 4
    assert guard.bound(u, frame, nav) is u


def test_what_is_within_passes_and_what_is_beyond_is_brought_to_the_limit() -> None:
    _, nav, u = world()
    limit, frame = LoadLimit(load_aircraft("learjet24")), SensorFrame()
    assert limit.bound(u, frame, nav) is u and not limit.acting
    for sign, bound in ((-1.0, limit.most), (1.0, limit.least)):
        hard = u + np.array([0.0, sign * math.radians(14.0), 0.0, 0.0])
        out = limit.bound(hard, frame, nav)
        assert limit.acting and limit.load(out, nav) == pytest.approx(bound, abs=0.05)
        assert np.array_equal(np.delete(out, 1), np.delete(hard, 1)) and abs(out[1] - u[1]) < abs(hard[1] - u[1])
    lo, hi = load_aircraft("learjet24").structure.load_g
    assert lo < limit.least < 0.0 < 2.0 < limit.most < hi
