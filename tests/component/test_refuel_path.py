"""Refuelling: the path is clear of the wake and continuous. Navigation by hand, no plant."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.refuel import (
    CONTACT,
    OBSERVATION,
    PRECONTACT,
    TO_PRECONTACT,
)
from tests.component.test_onboard_guidance import ACTION, DT, Flight

TANKER = load_aircraft("kc135r")
TIP_Y = math.pi / 8 * TANKER.geometry.b_m  # half the vortex span, pi/4 b
CLEARANCE = 10.0


def vortex_distance(path: np.ndarray) -> float:
    """Smallest distance [m] from xi [k,3] to either tip vortex, which leaves the wing against the flow (alpha 0 to 6
    deg).
    """
    worst = math.inf
    for side in (-1, 1):
        for alpha in np.radians(np.arange(0.0, 6.1, 1.0)):
            root = np.array([TANKER.wake.wing_ac_m[0], side * TIP_Y, TANKER.wake.wing_ac_m[2]])
            direction = np.array([-math.cos(alpha), 0.0, -math.sin(alpha)])
            d = path - root
            along = np.maximum(d @ direction, 0.0)
            worst = min(worst, float(np.linalg.norm(d - along[:, None] * direction, axis=1).min()))
    return worst


def test_the_whole_procedure_stays_clear_of_the_tip_vortices() -> None:
    f = Flight().at(CONTACT)
    f.order("disconnect")
    f.until(PRECONTACT)
    f.order("observation")
    f.until(OBSERVATION)
    path = np.array(f.path)
    assert vortex_distance(path) > CLEARANCE
    # the lateral crossing is made well below the wake and the tanker
    crossing = path[np.abs(np.abs(path[:, 1]) - TIP_Y) < 5.0]
    assert len(crossing) and crossing[:, 2].min() > 20.0
    # never ahead of the contact position, never above the observation position
    assert path[:, 0].max() < -35.4 and path[:, 2].min() > -0.1


@settings(deadline=None, derandomize=True, max_examples=40)
@given(st.lists(st.tuples(st.sampled_from(sorted(ACTION.values())), st.integers(1, 900)), min_size=1, max_size=12))
def test_no_sequence_of_commands_leads_near_a_vortex_or_makes_the_reference_jump(orders: list[tuple[int, int]]) -> None:
    f = Flight()
    f.step(200)
    for action, steps in orders:
        f.g.command(action)
        f.step(steps)
    path, vel = np.array(f.path), np.array(f.vel)
    assert np.isfinite(path).all() and np.isfinite(vel).all()
    assert vortex_distance(path) > CLEARANCE
    fastest = np.linalg.norm(vel, axis=1).max()
    assert fastest < 6.0
    jump = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert jump.max() < 6.0 * DT
    # velocity is what position does (trapezoid; end points of segments are held exactly)
    assert np.abs(np.diff(path, axis=0) - 0.5 * DT * (vel[1:] + vel[:-1])).max() < 0.02


def test_breakaway_goes_back_and_down_without_moving_sideways() -> None:
    for phase in (CONTACT, PRECONTACT, TO_PRECONTACT, OBSERVATION):
        f = Flight().at(phase)
        start = np.array(f.g.pos)
        f.path.clear()
        f.order("breakaway")
        f.step(1000)
        path = np.array(f.path)
        assert (np.diff(path[:, 0]) <= 1e-9).all(), "never forward"
        lateral = np.abs(path[:, 1] - start[1]).max()
        assert lateral < 5.0
        assert path[-1, 0] <= -95.0 and path[-1, 2] >= 55.0
        assert vortex_distance(path) > CLEARANCE
