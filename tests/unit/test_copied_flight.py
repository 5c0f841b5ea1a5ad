"""A copy of a flight goes on as the flight does: its air, and faults under way and still to come."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from sim_plant.scenario import load_scenario
from sim_plant.world import World

AIR: dict[str, Any] = {
    "wind.dryden.sigma_mps": 0.0, "wind.dryden.level": "moderate", "wind.dryden.model": "von_karman", "wind.wake.path": "flown",
    "wind.wake.meander": 1.0, "wind.bow.source": "receiver", "wind.density": "sounding", "wind.slow.sigma_mps": 1.0,
}  # fmt: skip
BEGUN, AT, LATER, END = 0.1, 20, 0.5, 62  # [s], ticks: past the end of a block of gusts
FAULTS = (
    {"sensor": "air", "kind": "blocked", "index": 0},
    {"sensor": "air", "kind": "iced", "index": 1, "value": [0.5]},
    {"sensor": "air", "kind": "frozen", "index": 2, "channel": "alpha"},
    {"sensor": "baro", "kind": "blocked", "for_s": 0.5},
    {"sensor": "gnss", "kind": "garbage", "value": [1.0]},
    {"sensor": "att", "kind": "intermittent"},
    {"kind": "slow", "surface": "elevator"},
)
EVENTS = [{"target": "receiver", "t_s": t, **f} for t in (BEGUN, LATER) for f in FAULTS]


def _fly(w: World, ticks: int) -> list[str]:
    """Everything the sensors say, and the states."""
    cmds, out = [w.trim_cmd(0), w.trim_cmd(1)], []
    for _ in range(ticks):
        out.append(repr(w.sense()) + repr([m.s.tolist() for m in w.members]))
        w.step(cmds)
    return out


@pytest.mark.parametrize("over", ["field", "mil"])
def test_a_copied_world_goes_on_as_the_one_it_was_copied_from(over: str) -> None:
    w = World(load_scenario("refueling", {**AIR, "wind.dryden.over": over, "event": EVENTS}), 1)
    before = _fly(w, AT)
    twin = copy.deepcopy(w)
    assert before[0] != before[-1] and _fly(w, END) == _fly(twin, END)
