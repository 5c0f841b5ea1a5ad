"""Sensors read together, of one aircraft and of all, against the same sensors one by one."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from sim_plant.failures.script import Event
from sim_plant.scenario import load_scenario
from sim_plant.sensors.bank import Bank
from sim_plant.world import World

FAULTS = (
    Event(t_s=0.3, kind="spike", target="receiver", sensor="baro", value=(30.0,)),
    Event(t_s=0.5, for_s=0.4, kind="bias", target="receiver", sensor="imu", value=(0.1,) * 6),
    Event(t_s=0.6, for_s=0.3, kind="stuck", target="tanker", sensor="gnss"),
    Event(t_s=0.7, for_s=0.5, kind="dropout", target="receiver", sensor="rel"),
)


def flown(w: World, ticks: int, apart: bool = False) -> list[Any]:
    """Frames of so many ticks, whole, in words: to the bit, and NaN equal to NaN."""
    cmds, out = [w.trim_cmd(0), w.trim_cmd(1)], []
    if apart:
        for m in w.members:
            m.bank.read = lambda *a, s=m.sensors: Bank.one_by_one(s, *a)  # type: ignore[method-assign]
    for _ in range(ticks):
        out.append(repr(w.sense()))
        w.step(cmds)
    return out


@pytest.mark.parametrize("grade", ["paper", "navigation", "tactical", "mems"])
def test_sensors_read_together_read_to_the_bit_what_each_reads_by_itself(grade: str) -> None:
    """Over the border of a block, with faults that begin and end on the way, and of every form of reading."""
    read = []
    for together, apart in ((True, False), (False, False), (False, True)):
        sc = load_scenario("refueling", {f"sensors.{a}.grade": grade for a in ("tanker", "receiver")})
        w = World(sc, 4, together)
        for e in FAULTS:
            w.faults.inject(e, round(e.t_s * 100))
        read.append(flown(w, 1100, apart))
    assert read[0] == read[2] and read[1] == read[2]


def test_a_copied_flight_reads_on_as_the_flight_it_was_copied_from() -> None:
    w = World(load_scenario("refueling", {"sensors.receiver.grade": "tactical"}), 4)
    flown(w, 30)
    twin = copy.deepcopy(w)
    assert flown(twin, 60) == flown(w, 60)
