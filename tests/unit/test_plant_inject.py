"""MAV_CMD_INJECT_FAILURE: what the plant accepts, what it answers, what it does and what it writes down."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as stock

from flightsw.icd.tlog import read
from flightsw.icd.wire import Sender
from flightsw.strict import ConfigError
from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED
from ground.columns import load
from sim_plant.failures import numbers as inject
from sim_plant.failures.judge import judge
from sim_plant.failures.script import CMD_INJECT_FAILURE
from sim_plant.scenario import load_scenario
from sim_plant.server import PlantServer

AIR, ALL = inject.UNIT_AIRSPEED, 0
GROUND = Sender(255, 190)
FITTED = inject.Fitted(3, 20.0, {"baro": 10.0}, ("aileron", "elevator", "rudder"), True)


def test_numbers_are_those_of_the_standard() -> None:
    assert CMD_INJECT_FAILURE == stock.MAV_CMD_INJECT_FAILURE
    assert inject.UNIT_AIRSPEED == stock.FAILURE_UNIT_SENSOR_AIRSPEED
    assert inject.UNIT_SERVO == stock.FAILURE_UNIT_SYSTEM_SERVO
    assert inject.UNIT_LINK == stock.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL
    for unit, name in (
        (0, "GYRO"),
        (1, "ACCEL"),
        (2, "MAG"),
        (3, "BARO"),
        (4, "GPS"),
        (6, "VIO"),
        (7, "DISTANCE_SENSOR"),
    ):
        assert unit == getattr(stock, f"FAILURE_UNIT_SENSOR_{name}") and unit in inject.GROUPS
    for name in ("OK", "OFF", "STUCK", "GARBAGE", "WRONG", "SLOW", "DELAYED", "INTERMITTENT"):
        assert getattr(inject, name) == getattr(stock, f"FAILURE_TYPE_{name}")
    for name in ("ACCEPTED", "DENIED", "UNSUPPORTED"):
        assert globals()[name] == getattr(stock, f"MAV_RESULT_{name}")


@pytest.mark.parametrize(
    ("command", "params", "result", "text"),
    [
        (420, (AIR, inject.OFF, 2), ACCEPTED, "air probe 2: off"),
        (420, (AIR, inject.WRONG, 3, 2, -0.02, 5), ACCEPTED, "air probe 3 alpha: bias -0.02 for 5 s"),
        (420, (AIR, inject.WRONG), ACCEPTED, "air all probes: bias 3"),
        (420, (AIR, inject.DELAYED, 1, 0, 0.5), ACCEPTED, "air probe 1: delayed 10 samples"),
        (420, (AIR, inject.OK), ACCEPTED, "clear"),
        (511, (AIR, inject.OFF, 2), UNSUPPORTED, "command 511: the plant takes 420"),
        (
            420,
            (4, inject.OFF),
            UNSUPPORTED,
            "failure unit 4: receiver has 3 (baro), 8 (air), 102 (surface), 105 (radio)",
        ),
        (420, (AIR, 8), UNSUPPORTED, "failure type 8: allowed 0 to 7, 64 to 67, 71, 72"),
        (420, (AIR, -1), UNSUPPORTED, "failure type -1"),
        (420, (AIR, inject.OFF, 4), DENIED, "instance 4: receiver has probes 1 to 3"),
        (420, (AIR, inject.OFF, -1), DENIED, "instance -1"),
        (420, (AIR, inject.OFF, 1, 4), DENIED, "channel 4: allowed 1 V, 2 alpha, 3 beta"),
        (420, (AIR, inject.OFF, 1.5), DENIED, "whole"),
        (420, (AIR, inject.OFF, math.nan), DENIED, "numbers"),
        (420, (AIR, inject.WRONG, 1, 1, math.inf), DENIED, "numbers"),
        (420, (AIR, inject.WRONG, 1, 0, 2.0), DENIED, "without a channel"),
        (420, (AIR, inject.WRONG, 1, 1, 2.0, -1.0), DENIED, "duration -1 s"),
        (420, (AIR, inject.GARBAGE, 1, 1, -2.0), DENIED, "garbage needs more than 0"),
        (420, (AIR, inject.DELAYED, 1, 0, -1.0), DENIED, "delay -1 s: allowed 0.05"),
        (420, (AIR, inject.INTERMITTENT, 1, 0, 1.0), DENIED, "share 1: allowed above 0 and below 1"),
        (420, (AIR, inject.OFF, 2, math.nan, math.nan, math.nan), ACCEPTED, "air probe 2: off"),  # as MAVSDK sends it
        (420, (3, inject.STUCK, 0, math.nan, math.nan, 7.0), ACCEPTED, "baro: stuck for 7 s"),
        (420, (3, inject.INTERMITTENT), ACCEPTED, "baro: intermittent"),
        (420, (3, inject.WRONG), UNSUPPORTED, "failure type 4 of baro: its reading is not of that kind"),
        (420, (AIR, inject.FROZEN, 2, 2), ACCEPTED, "air probe 2 alpha: frozen"),
        (420, (AIR, inject.BLOCKED, 1), ACCEPTED, "air probe 1: blocked"),
        (420, (AIR, inject.BLOCKED, 1, 1), DENIED, "of a pitot tube, channel 0"),
        (420, (AIR, inject.BLOCKED, 1, 0, 2.0), DENIED, "value 2: failure type 71 takes none"),
        (420, (AIR, inject.ICED, 0, 0, 0.1, 9), ACCEPTED, "air all probes: iced 0.1 for 9 s"),
        (420, (AIR, inject.ICED, 0, 0, -0.1), DENIED, "rate -0.1 1/s: allowed above 0"),
        (420, (AIR, inject.FROZEN, 2, 2, 0.1), DENIED, "value 0.1: failure type 66 takes none"),
        (420, (3, inject.STUCK, 1, 0, 5.0), DENIED, "value 5: failure type 2 takes none"),
        (420, (3, inject.STUCK, 2), DENIED, "instance 2: receiver has one baro"),
        (420, (3, inject.OK, 0, 0, 0, 9), DENIED, "duration 9 s: failure type 0 lasts no time"),
        (420, (3, inject.BLOCKED), ACCEPTED, "baro: blocked"),
        (420, (3, inject.ICED), UNSUPPORTED, "failure type 72 of baro: it has no tube or port that could"),
        (420, (102, inject.STUCK, 2), ACCEPTED, "elevator: jam"),
        (420, (102, inject.STUCK, 0), DENIED, "instance 0: receiver has 1 aileron, 2 elevator, 3 rudder"),
        (420, (102, inject.OFF, 2), UNSUPPORTED, "failure type 1 of a surface: allowed 0 ok, 2 stuck"),
        (420, (105, inject.OFF, 0, 0, 0, 3), ACCEPTED, "radio: link_loss for 3 s"),
        (420, (105, inject.STUCK), UNSUPPORTED, "failure type 2 of the radio: allowed 0 ok, 1 off, 7 intermittent"),
    ],
)
def test_answers(command: int, params: tuple[float, ...], result: int, text: str) -> None:
    v = judge(command, params, "receiver", FITTED)
    assert (v.result, text in v.text, v.event is not None) == (result, True, result == ACCEPTED)


def test_an_aircraft_without_probes_has_none_to_fail() -> None:
    assert judge(420, (AIR, inject.OFF), "glider", inject.Fitted()).result == UNSUPPORTED


class Fake:
    """A plant flown by its trim commands, its desk asked at chosen ticks."""

    def __init__(self, run_dir: Path | None = None, **over: Any) -> None:
        self.s = PlantServer(load_scenario("refueling", {"meta.duration_s": 2.0, **over}), 1, run_dir)
        self.out: list[bytes] = []
        self.readings: list[np.ndarray] = []
        self.masks: list[int] = []

    def fly(self, to_tick: int, orders: dict[int, list[bytes]] | None = None) -> list[bytes]:
        """Fly until the tick is begun; orders {tick: datagrams} arrive while that tick is open. The ACKs."""
        acks: list[bytes] = []
        w = self.s.world
        while True:
            self.out += self.s.begin_tick()
            f = w.sense()[1]
            self.readings.append(np.array([f.air_V, f.air_alpha, f.air_beta]))
            self.masks.append(f.air_mask)
            for d in (orders or {}).get(w.tick, ()):
                acks += self.s.desk.take(d)
            if w.tick >= to_tick:
                return acks
            w.step([w.trim_cmd(0), w.trim_cmd(1)])
            self.s._out = []


def order(*params: float, target: int = 2, command: int = 420, confirmation: int = 0, component: int = 190) -> bytes:
    named = {f"param{i + 1}": p for i, p in enumerate(params)}
    return GROUND.named(
        "COMMAND_LONG",
        target_system=target,
        target_component=component,
        command=command,
        confirmation=confirmation,
        **named,
    )


def acks(packets: list[bytes]) -> list[tuple[int, int, int, int]]:
    """(aircraft, component, command, result) as the stock dialect reads them; addressed to the asker."""
    out = []
    for m in stock.MAVLink(None).parse_buffer(b"".join(packets)) or []:
        if m.get_type() == "STATUSTEXT":  # the reason of a refusal
            continue
        assert (m.target_system, m.target_component) == (255, 190)
        out.append((m.get_srcSystem(), m.get_srcComponent(), m.command, m.result))
    return out


def test_a_live_failure_acts_from_the_next_tick_and_ok_ends_it() -> None:
    ref, f = Fake(), Fake()
    ref.fly(150)
    got = f.fly(150, {49: [order(AIR, inject.WRONG, 2, 1, -3.0)], 99: [order(AIR, inject.OK, 2)]})
    assert acks(got) == [(2, 190, 420, ACCEPTED)] * 2
    for k in range(150):
        d = f.readings[k] - ref.readings[k]
        expected = np.zeros((3, 3))
        expected[0, 1] = -3.0 if 50 <= k < 100 else 0.0
        assert np.allclose(d, expected, atol=1e-12)


def test_other_sensors_a_surface_and_the_radio_fail_and_come_back() -> None:
    """GNSS silent, the elevator jammed, the radio dead; each cleared by OK, and by its own time."""
    f = Fake()
    world, out = f.s.world, f.s.world.faults.outage["receiver"]
    gnss = next(s for s in world.members[1].sensors if s.group == "gnss")
    seen = []
    for tick, orders in (
        (20, [order(4, inject.OFF), order(102, inject.STUCK, 2), order(105, inject.OFF, 0, 0, 0, 0.1)]),
        (25, []), (40, [order(4, inject.OK), order(102, inject.OK, 2)]), (45, []),
    ):  # fmt: skip
        got = f.fly(tick, {tick: orders} if orders else None)
        assert [a[3] for a in acks(got)] == [ACCEPTED] * len(orders)
        seen.append((gnss.dropped, list(out.jam), out.link_down))
    free, down = (False, [0.0] * 3, False), (True, [0.0, 1.0, 0.0])
    assert seen == [free, (*down, True), (*down, False), free]


def test_truthful_answers_and_no_answer_for_others() -> None:
    f = Fake()
    got = f.fly(
        20,
        {
            5: [order(AIR, inject.OFF, 9)],  # no such probe
            6: [order(100, inject.OFF)],  # a unit the plant does not fail
            7: [order(2.0, command=246)],  # the plant is not shut down by the ground
            8: [order(AIR, inject.OFF, 1, target=77)],  # no such aircraft
            9: [order(AIR, inject.OFF, 1, component=42)],  # for a component that is not here
            10: [b"rubbish", order(AIR, inject.OFF, 1, target=0)],  # everybody
        },
    )
    assert acks(got) == [(2, 190, 420, 2), (2, 190, 420, 3), (2, 190, 246, 3), (1, 190, 420, 0), (2, 190, 420, 0)]
    assert f.s.desk.count.bad > 0
    assert any("sysid 77" in n for n in f.s.notes)
    assert any("receiver: instance 9" in n and "refused, result 2" in n and "tick 6" in n for n in f.s.notes)


def test_a_repeated_command_is_answered_again_and_done_once() -> None:
    """A drift would start anew."""
    first = [AIR, inject.SLOW, 1, 1, 1.0]
    once, twice = Fake(), Fake()
    once.fly(150, {20: [order(*first)]})
    got = twice.fly(150, {20: [order(*first)], 90: [order(*first, confirmation=1)]})
    assert acks(got) == [(2, 190, 420, ACCEPTED)] * 2
    assert np.array_equal(once.readings, twice.readings)
    assert len([n for n in twice.s.notes if "drift" in n]) == 1


def test_a_new_command_of_the_same_kind_replaces_the_old_one() -> None:
    ref, f = Fake(), Fake()
    ref.fly(60)
    f.fly(60, {10: [order(AIR, inject.WRONG, 1, 1, 2.0)], 30: [order(AIR, inject.WRONG, 1, 1, 5.0)]})
    assert f.readings[55][0, 0] - ref.readings[55][0, 0] == pytest.approx(5.0)


def test_part_of_a_wider_failure_cannot_be_cleared_alone() -> None:
    f = Fake()
    got = f.fly(40, {10: [order(AIR, inject.STUCK)], 20: [order(AIR, inject.OK, 2)], 30: [order(AIR, inject.OK)]})
    assert [a[3] for a in acks(got)] == [ACCEPTED, DENIED, ACCEPTED]
    assert np.array_equal(f.readings[25], f.readings[10]) and not np.array_equal(f.readings[35], f.readings[10])


def test_a_duration_ends_by_itself() -> None:
    f = Fake()
    f.fly(150, {20: [order(AIR, inject.OFF, 3, 0, 0, 0.5)]})
    assert f.masks[24] == 7 and {f.masks[k] for k in range(25, 71, 5)} == {3} and f.masks[75] == 7


EVENT = {"t_s": 0.5, "kind": "command", "target": "plant.receiver", "command": 420}
CASES = [
    [AIR, inject.GARBAGE, 1, 2, 0.1, 1.0],
    [AIR, inject.INTERMITTENT, 2, 0, 0.3],
    [AIR, inject.WRONG, 0, 3, -0.0175],
    [AIR, inject.DELAYED, 3],
]


@pytest.mark.parametrize("params", CASES, ids=str)
def test_scripted_and_live_are_the_same_run(params: list[float], tmp_path: Path) -> None:
    """Same bytes to both aircraft, same record: a live run can be flown again from its record."""
    live, scripted = Fake(tmp_path / "live"), Fake(tmp_path / "scripted", event=[{**EVENT, "params": params}])
    ref = Fake()
    ref.fly(180)
    live.fly(180, {49: [order(*params)]})
    scripted.fly(180)
    assert live.out == scripted.out
    assert live.out != ref.out
    for f in (live, scripted):
        f.s.close()
    a, b = ((tmp_path / d / "plant.tlog").read_bytes() for d in ("live", "scripted"))
    assert a == b


def test_the_record_shows_order_answer_and_words(tmp_path: Path) -> None:
    f = Fake(tmp_path)
    f.fly(100, {49: [order(AIR, inject.WRONG, 2, 3, -0.5)], 60: [order(AIR, inject.OFF, 9)]})
    f.s.close()
    assert [t for t, _, _ in read(tmp_path / "plant.tlog")] == [500_000] * 3 + [610_000] * 3
    log = load(tmp_path / "plant.tlog")
    asked, answered, said = log.get(255, "COMMAND_LONG"), log.get(2, "COMMAND_ACK"), log.get(2, "STATUSTEXT")
    assert asked is not None and answered is not None and said is not None
    assert [list(asked[f"param{i}"]) for i in range(1, 6)] == [[8, 8], [4, 1], [2, 9], [3, 0], [-0.5, 0]]
    assert list(asked["target_system"]) == [2, 2] and list(answered["result"]) == [ACCEPTED, DENIED]
    assert said["text"][0].startswith(b"air probe 2 beta: bias -0.5")
    assert log.junk_bytes == 0 and not any(log.dropped.values())


def test_without_commands_there_is_no_record(tmp_path: Path) -> None:
    f = Fake(tmp_path)
    f.fly(20)
    f.s.close()
    assert not (tmp_path / "plant.tlog").exists()


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (
            {"params": [8.0, 1.0, 7.0]},
            r"event\[0\]\.params: refused by the plant: instance 7: receiver has probes 1 to 3",
        ),
        ({"params": [103.0, 1.0]}, r"event\[0\]\.params: refused by the plant: failure unit 103"),
        ({"command": 511}, r"event\[0\]: command = 511: the plant takes command = 420"),
        ({"action": "hold"}, r"event\[0\]: action = 'hold': the plant takes"),
        ({"target": "plant.nobody"}, r"'plant\.nobody': allowed: tanker, receiver, plant, plant\.tanker, plant\.rec"),
        (
            {"target": "plant.receiver", "kind": "jam", "surface": "rudder", "command": 0, "params": []},
            r"allowed: tanker, receiver$",
        ),
        ({"params": [8.0] * 8}, r"at most 7 values, got 8"),
    ],
)
def test_scripted_mistakes_are_named(event: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        Fake(event=[{**EVENT, **event}])


def test_the_plant_as_target_means_every_aircraft() -> None:
    f = Fake(event=[{**EVENT, "target": "plant", "params": [8.0, 1.0, 1.0]}])
    f.fly(60)
    assert [fr.air_mask & 1 for fr in f.s.world.sense()] == [0, 0]


def test_no_aircraft_may_be_called_plant() -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.plant\.name = 'plant': reserved"):
        load_scenario("refueling", {"aircraft.receiver.name": "plant"})
