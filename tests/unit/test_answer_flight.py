"""Surfaces and thrust that do not answer, in flight: what is said of them, whether it is true, and what is flown without them."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import pytest

from flightsw.types import HF_ENGINE
from ground.link.packets import IDS
from hil_scripts.studies.grades.flight import Timetable, settings
from hil_scripts.studies.integrity.flight import RECEIVER, TANKER
from hil_scripts.studies.integrity.snapshot import STATUS, Flying, phase_in, said
from sim_plant.failures.script import Event
from sim_plant.kernels import layout as n
from sim_plant.lost import Collision
from sim_plant.truth import truth_of

BEGIN_S = 24.0  # what is lasting is learnt in 20 s
SIDES = {"aileron": 0, "elevator": 1, "rudder": 2}


@cache
def before() -> Flying:
    """On the way to pre-contact, no fault."""
    flight = Flying("refueling", 3, settings("paper", 0.39, Timetable()))
    flight.fly_to(BEGIN_S)
    return flight


def flown(t_s: float, *events: Event) -> tuple[Flying, list[tuple[float, int, str]], list[str], list[float]]:
    """The flight t_s [s] later: texts with time and severity, phases of the receiver, gap between the airframes [m]."""
    flight = before().fork()
    for e in events:
        flight.inject(e)
    texts: list[tuple[float, int, str]] = []
    phases, gaps = [], []
    pair = Collision(flight.server.world.members[TANKER], flight.server.world.members[RECEIVER])
    while flight.t_s < BEGIN_S + t_s:
        for i, datagrams in enumerate(flight.tick()[1]):
            for kind, f in said(datagrams):
                if kind == IDS["STATUSTEXT"]:
                    texts.append((flight.t_s - BEGIN_S, f["severity"], f["text"]))
                elif kind == STATUS and i == RECEIVER:
                    phases.append(phase_in(f))
        if flight.server.tick % 20 == 0:
            flight.server.world.sense()
            gaps.append(pair.gap())
    return flight, texts, phases, gaps


def event(kind: str, surface: str = "", *value: float, target: str = "receiver", **more: Any) -> Event:
    return Event(0.0, kind, target, surface=surface, value=value, **more)


@pytest.mark.parametrize(
    ("surface", "kind", "value", "within_s"),
    [
        ("aileron", "hardover", (1.0,), 0.5), ("elevator", "slow", (0.03,), 3.0), ("elevator", "jam", (), 3.0),
        ("aileron", "jam", (), 3.0), ("rudder", "hardover", (-1.0,), 0.6), ("aileron", "slow", (0.03,), 3.0),
    ],
)  # fmt: skip
def test_who_does_not_answer_is_named_and_where_it_is_is_known(
    surface: str, kind: str, value: tuple[float, ...], within_s: float
) -> None:
    flight, texts, _, _ = flown(within_s, event(kind, surface, *value))
    said_of = [t for t in texts if "does not answer" in t[2]]
    assert said_of and said_of[0][2].startswith((surface, "breakaway: recovery: " + surface, "recovery: " + surface))
    answer = flight.nodes[RECEIVER].app.mission.guard.answer
    j = SIDES[surface]
    true = flight.server.world.members[RECEIVER].view.s[n.S_SURF + j]
    off = math.degrees(abs(answer.at[j] - true))
    assert off < {"aileron": 1.5, "elevator": 1.0, "rudder": 6.0}[surface] + (4.0 if kind == "hardover" else 0.0)


@pytest.mark.parametrize(
    ("surface", "kind", "value"),
    [
        ("rudder", "hardover", (1.0,)),
        ("aileron", "jam", ()),
        ("elevator", "slow", (0.03,)),
        ("aileron", "float", (0.5,)),
    ],
)
def test_what_the_others_trim_is_flown_away_and_level(surface: str, kind: str, value: tuple[float, ...]) -> None:
    flight, _, phases, gaps = flown(20.0, event(kind, surface, *value))
    t = truth_of(flight.server.world.members[RECEIVER], flight.server.world.t_us)
    limits = flight.server.world.members[RECEIVER].ac.limits
    assert phases[-1] == "breakaway" and min(gaps) > 8.0
    assert abs(math.degrees(t.euler[2])) < 45.0 and abs(math.degrees(t.euler[1])) < 15.0
    assert limits.V_min_mps < t.V < limits.V_max_mps


def test_half_the_thrust_lost_is_told_and_left() -> None:
    flight, texts, phases, _ = flown(4.0, event("thrust_loss", "", 0.5))
    assert flight.nodes[RECEIVER].app.mission.faults == HF_ENGINE
    when = next(t for t, _, text in texts if text.startswith("thrust -"))
    assert when < 3.0 and phases[-1] == "breakaway"


def test_thrust_that_is_there_again_is_told() -> None:
    flight, texts, _, _ = flown(30.0, event("thrust_loss", "", 0.5, for_s=4.0))
    said_of = [text for _, _, text in texts if text.startswith("thrust ") and text != "thrust does not answer"]
    assert said_of[0].endswith("kN off") and said_of[-1] == "thrust is what is commanded again" and len(said_of) == 2
    assert flight.nodes[RECEIVER].app.mission.faults == 0


@pytest.mark.parametrize(
    "e",
    [
        event("bias", "", 0.07, sensor="air", channel="alpha"), event("frozen", sensor="air"),
        event("delayed", sensor="imu", samples=10), event("bias", "", 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, sensor="imu"), None,
    ],
    ids=["vane bent by 4 deg", "air data frozen", "gyro late", "gyro biased", "nothing"],
)  # fmt: skip
def test_what_is_wrong_with_a_sensor_accuses_no_surface(e: Event | None) -> None:
    _, texts, _, _ = flown(8.0, *(() if e is None else (e,)))
    assert not [t for t in texts if "does not answer" in t[2] or "kN off" in t[2]]
