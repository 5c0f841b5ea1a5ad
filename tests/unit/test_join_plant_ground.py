"""Range limit of the relative sensor; figures of a join-up; what the receiver watches and answers on its way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.en_route import JoinMission, JoinParams
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.strict import convert
from flightsw.types import HF_IMU, HF_PEER, HF_REL, UPD_REL, Command, SensorFrame
from ground.views.joinup.figures import wake_clearance
from sim_plant.sensors.base import View
from sim_plant.sensors.config import NoiseCfg, Rel, Suite
from sim_plant.sensors.suite import build_sensors


def rel_sensor(range_max_m: float) -> Any:
    suite = Suite(rel=Rel(range_max_m=range_max_m))
    return next(s for s in build_sensors("r", suite, NoiseCfg(), 100, 7, 0, True, False) if s.group == "rel")


def readings(range_max_m: float, distance: list[float]) -> list[tuple[bool, tuple[float, ...]]]:
    """(new?, xi) of every 20 Hz sample with the leader at these distances."""
    sensor, view, out = rel_sensor(range_max_m), View(0), []
    for k, d in enumerate(distance):
        frame = SensorFrame()
        view.rel = [-0.8 * d, 0.6 * d, 0.0, 0.0, 0.0, 0.0]
        sensor.step(5 * k, 50_000 * k, view, frame)
        out.append((bool(frame.updated & UPD_REL), frame.rel_pos_t))
    return out


def test_the_relative_sensor_is_silent_beyond_its_range() -> None:
    d = [7000.0, 6001.0, 5999.0, 100.0, 6500.0, 50.0]
    limited, free = readings(6000.0, d), readings(0.0, d)
    assert [new for new, _ in limited] == [False, False, True, True, False, True]
    assert all(new for new, _ in free)
    # what is measured in range does not depend on what was out of it: the errors are drawn all the same
    for (new, a), (_, b) in zip(limited, free, strict=True):
        assert not new or a == b


def test_a_stuck_or_dropped_sensor_out_of_range_says_nothing() -> None:
    sensor, view = rel_sensor(1000.0), View(0)
    sensor.stuck = sensor.faulty = True
    for k, d in enumerate((2000.0, 3000.0)):
        frame = SensorFrame()
        view.rel = [-d, 0.0, 0.0, 0.0, 0.0, 0.0]
        sensor.step(5 * k, 50_000 * k, view, frame)
        assert not frame.updated


def test_wake_clearance_is_the_distance_from_a_line() -> None:
    ac = load_aircraft("kc135r")
    y = math.pi / 8.0 * ac.geometry.b_m
    x0, _, z0 = ac.wake.wing_ac_m
    xi = np.array(
        [[x0 - 100.0, y, z0], [x0 - 100.0, y + 30.0, z0 + 40.0], [x0 - 50.0, 0.0, z0], [x0 + 3.0, y + 4.0, z0]]
    )
    assert wake_clearance(xi, np.zeros(4)) == pytest.approx([0.0, 50.0, y, 5.0])
    a = np.radians([4.0])
    on_core = np.array([[x0 - 70.0 * math.cos(a[0]), -y, z0 - 70.0 * math.sin(a[0])]])
    assert wake_clearance(on_core, a) == pytest.approx([0.0], abs=1e-9)


@pytest.fixture(scope="module")
def mission() -> JoinMission:
    c = load_flight("flightsw/params/receiver_rendezvous.toml")
    own = {k: v for k, v in c.tables.items() if k != "health"}
    return JoinMission(load_aircraft(c.app.aircraft), convert(own, JoinParams, "test"), 0.05)


def test_on_its_way_it_depends_on_itself_only_and_refuses_refuelling_commands(mission: JoinMission) -> None:
    assert mission.watch & HF_IMU and not mission.watch & (HF_REL | HF_PEER)
    result, why = mission.obey(Command(31010, (3.0,), 255, 190))
    assert result == 1 and "not joined" in why


def test_the_warm_up_reaches_both_halves_of_the_mission() -> None:
    app = make_app(load_flight("flightsw/params/receiver_rendezvous.toml"))
    app.warmup()  # type: ignore[attr-defined]
    assert not app.mission.joined  # type: ignore[attr-defined]  # a throw-away copy was flown


def test_after_the_hand_over_it_watches_the_tanker_and_a_command_ends_the_sequence(mission: JoinMission) -> None:
    mission.rehearse()
    assert mission.watch & HF_REL and mission.watch & HF_PEER
    mission.refuel.guid.phase = 1
    assert mission.sequence.on
    assert mission.obey(Command(31010, (3.0,), 255, 190))[0] == 1  # contact from observation: refused, rule goes on
    assert mission.sequence.on
    assert mission.obey(Command(31010, (1.0,), 255, 190))[0] == 0
    assert not mission.sequence.on


def test_an_order_of_the_sequence_that_is_refused_is_told_once_and_comes_again(mission: JoinMission) -> None:
    mission.rehearse()
    guid = mission.refuel.guid
    mission.texts()
    guid.phase, guid.blind, guid.error_m = 1, "", 125.0
    for _ in range(3):
        mission._by_rule(2)
    assert [t.text for t in mission.texts()] == ["sequence waits: to pre-contact: station error 125.0 m, allowed 4"]
    guid.error_m = 0.5
    mission._by_rule(2)
    assert guid.phase == 2 and [t.text for t in mission.texts()] == ["to pre-contact: commanded"]
