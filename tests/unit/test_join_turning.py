"""Join-up behind a tanker that turns: rules of axes and guard against closed forms, distance and closing kept at any time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.receiver.join_guard import Guard, follow, in_turning_axes, nearest
from hil_scripts.campaign.study import Case
from hil_scripts.studies.joinup.study import TIMES_S, flight, run_one


def test_place_held_in_turning_axes_moves_on_its_circle() -> None:
    """A point at (x, y) of axes turning at omega has the velocity omega x r: integrated it stays at its distance."""
    omega, p = 0.03, np.array([-350.0, 65.0])
    r0, angle, dt = float(np.hypot(*p)), 0.0, 0.01
    at = p.copy()  # in axes that do not turn
    for _ in range(3000):
        c, s = math.cos(angle), math.sin(angle)
        here = (c * at[0] + s * at[1], c * at[1] - s * at[0], 0.0)
        vx, vy = in_turning_axes((0.0, 0.0), here, omega)
        at += np.array([c * vx - s * vy, s * vx + c * vy]) * dt
        angle += omega * dt
    assert math.hypot(*at) == pytest.approx(r0, rel=2e-3)
    assert (here[0], here[1]) == pytest.approx(tuple(p), abs=2.0)


def test_followed_tanker_is_closed_on_along_the_line_to_the_point_behind_it() -> None:
    vx, vy = follow((-3000.0, 400.0, 305.0), 350.0, 10.0)
    assert math.hypot(vx, vy) == pytest.approx(10.0) and math.atan2(vy, vx) == pytest.approx(math.atan2(-400.0, 2650.0))
    assert follow((-350.0, 0.0, 305.0), 350.0, 5.0) == (0.0, 0.0)


def test_nearest_point_of_straight_and_of_curved_paths() -> None:
    assert nearest((-100.0, 50.0, 0.0), (20.0, 0.0, 0.0), 0.0) == pytest.approx(50.0)
    assert nearest((-100.0, 50.0, 0.0), (-20.0, 0.0, 0.0), 0.0) == pytest.approx(math.hypot(100.0, 50.0))
    # 2 s at 2 m/s^2: 4 m, then 4 m/s for 10 s
    assert nearest((0.0, 100.0, 0.0), (0.0, 0.0, 0.0), -2.0) == pytest.approx(100.0 - 4.0 - 40.0)


def test_guard_gives_way_until_it_is_clear() -> None:
    g = Guard(75.0, 250.0)
    assert not g.step((-300.0, 65.0, 5.0), (2.0, 0.0, 0.0), 0.0)
    assert g.step((-120.0, 40.0, 5.0), (10.0, 0.0, 0.0), 0.0)
    assert g.step((-200.0, 60.0, 20.0), (-5.0, 1.0, 1.0), 0.0), "opening, not yet far enough"
    assert g.step((-300.0, 60.0, 20.0), (1.0, 0.0, 0.0), 0.0), "far enough, but closing"
    assert not g.step((-300.0, 60.0, 20.0), (-1.0, 0.0, 0.0), 0.0)


@pytest.mark.parametrize("at", TIMES_S[::2])
@pytest.mark.parametrize("seed", [1, 2])
def test_it_keeps_its_distance_and_its_closing_whenever_the_tanker_turns(at: float, seed: int) -> None:
    v = run_one(Case("rules", {"at_s": at, "rules": True}), seed).values
    assert v["least_m"] > 90.0 and v["ready"] == 1.0 and v["gave_way"] == 0.0
    assert v["closing_excess_mps"] < 4.0
    assert not v["ahead_m"] > -50.0  # never ahead of the aim when near and not well below


def test_a_turn_is_told_and_its_end_too() -> None:
    f = flight(220.0, 3, True)
    f.fly(600.0, stop_when_ready=True)
    said = [t.text for t in f.g.texts]
    assert "tanker turns: closing stopped" in said and "tanker straight: closing goes on" in said


def test_a_receiver_driven_at_the_tanker_gives_way_and_comes_back() -> None:
    """A push of 25 m/s towards the tanker from a place beside it: down and away, then a join-up like any other."""
    f = flight(1e6, 4, True)
    f.fly(700.0, stop_when_ready=True)
    f.V += 25.0
    r = f.fly(400.0)
    said = [t.text for t in f.g.texts]
    assert "too near the tanker: giving way" in said and "clear of the tanker" in said
    assert np.sqrt((r[:, :3] ** 2).sum(axis=1)).min() > 60.0
