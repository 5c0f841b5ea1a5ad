"""Severe air in flight: a seed in which station keeping alone breaks the receiver after 3 s."""

from __future__ import annotations

from typing import Any

import pytest

from ground.link.packets import IDS
from hil_scripts.studies.grades.flight import Timetable, settings
from hil_scripts.studies.integrity.flight import RECEIVER
from hil_scripts.studies.integrity.snapshot import INTEGRITY, STATUS, Flying, phase_in, said
from sim_plant.kernels import layout as n
from sim_plant.lost import AircraftLostError

SEED, SEVERE = 1494163559, 6.22  # [m/s]


def flown(t_s: float, *more: str) -> tuple[list[float], list[tuple[int, Any]]]:
    """Load factors of the receiver by the truth, and what it said. Raises AircraftLostError."""
    flight = Flying("refueling", SEED, (*settings("tactical", SEVERE, Timetable(), guarded=True), *more))
    heard: list[tuple[int, Any]] = []
    loads = []
    while flight.t_s < t_s:
        heard += said(flight.tick()[1][RECEIVER])
        loads.append(-flight.server.world.members[RECEIVER].view.o[n.O_F + 2] / n.G0)
    return loads, heard


def test_severe_air_is_left_by_rule_and_outlived() -> None:
    loads, heard = flown(30.0)
    assert max(loads) < 3.5 and min(loads) > -0.7  # the structure bears -1.5 to 4.7
    left = next(f for kind, f in heard if kind == STATUS and phase_in(f) == "breakaway")
    assert left["time_usec"] < 4e6
    texts = [f["text"] for kind, f in heard if kind == IDS["STATUSTEXT"]]
    assert any(t.startswith("breakaway: turbulence") for t in texts)
    assert sum("allowed 3.5" in t for t in texts) >= 3  # learnt, left, the order to pre-contact refused
    bound = [f for kind, f in heard if kind == INTEGRITY][-1]
    assert bound["turbulence"] == pytest.approx(SEVERE, rel=0.25) and bound["turbulence_max"] == pytest.approx(3.5)
    assert phase_in([f for kind, f in heard if kind == STATUS][-1]) == "breakaway"


def test_without_the_rule_it_breaks() -> None:
    with pytest.raises(AircraftLostError, match="load factor"):
        flown(10.0, "receiver.rough_air.on=false")
