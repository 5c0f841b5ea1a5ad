"""Parameters, commands, message intervals, time synchronisation."""

from __future__ import annotations

import dataclasses
import math
import sys
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw import plugins, types
from flightsw.icd import wire
from flightsw.icd.codec_orders import COMMANDS_MAX
from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.missions.base import MissionSpec
from flightsw.missions.gust.laws import LAWS as GUST_LAWS
from flightsw.missions.receiver import refuel
from flightsw.missions.windshear.guidance import LAWS as ESCAPE_LAWS
from flightsw.process.node import Node
from flightsw.process.services import ACCEPT, ANSWERS_MAX, PACKETS_MAX
from ground.link.merge import SequenceGaps

from .flight_fakes import FakeApp, FakePlant, config, fields, names

GCS = wire.Sender(255, 190)

MISSIONS = plugins.parts(plugins.MISSIONS, MissionSpec)


class Bench:
    """A node flown one tick per call, with something from the ground."""

    def __init__(self, app: FakeApp | None = None) -> None:
        self.app = app or FakeApp()
        self.node = Node(config(), self.app)
        self.plant = FakePlant()
        self.k = 0

    def tick(self, *ground: bytes, n: int = 1) -> bytes:
        """Telemetry of the next n ticks; `ground` arrives with the first."""
        out = b""
        for _ in range(n):
            reply = self.node.step([self.plant.at(self.k)], None, ground)
            assert reply
            self.last = self.node._snap
            out += b"".join(self.node.after())
            self.k += 1
            ground = ()
        return out

    def command(self, command: int, *params: float, target: int = 2) -> list[dict[str, Any]]:
        """Acks of a command."""
        p = {f"param{i + 1}": v for i, v in enumerate(params)}
        out = self.tick(GCS.named("COMMAND_LONG", target_system=target, target_component=1, command=command, **p))
        return fields(out, "COMMAND_ACK")


def test_mission_command_is_answered_by_the_mission() -> None:
    b = Bench()
    [ack] = b.command(31010, 3.0)
    assert (ack["command"], ack["result"], ack["target_system"], ack["target_component"]) == (31010, 0, 255, 190)


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (400, (1.0,), 3),  # arm: not a command of this aircraft
        (246, (2.0,), 2),  # only the plant ends a run
        (512, (148.0,), 0),
        (512, (30.0,), 0),
        (512, (999.0,), 3),
        (512, (53015.0,), 3),  # log only
        (512, (math.nan,), 2),
        (511, (30.0, 50_000.0), 0),
        (511, (30.0, 100.0), 2),  # faster than the base rate
        (511, (30.0, -5.0), 2),
        (511, (30.0, math.inf), 2),
        (511, (999.0, 1000.0), 3),
        (520, (1.0,), 0),
    ],
)
def test_every_command_gets_one_true_answer(command: int, params: tuple[float, ...], result: int) -> None:
    b = Bench()
    [ack] = b.command(command, *params)
    assert ack["result"] == result
    assert not b.node.done


def test_command_for_another_aircraft_is_not_answered() -> None:
    b = Bench()
    assert b.command(31010, 3.0, target=1) == []
    assert len(b.command(31010, 3.0, target=0)) == 1


def test_only_its_own_component_is_addressed() -> None:
    b = Bench()
    for component, answers in ((0, 1), (1, 1), (2, 0), (190, 0), (255, 0)):
        for name in ("COMMAND_LONG", "COMMAND_INT"):
            out = b.tick(GCS.named(name, target_system=2, target_component=component, command=31010, param1=1.0))
            assert len(fields(out, "COMMAND_ACK")) == answers, (component, name)
        ask = GCS.named("PARAM_REQUEST_READ", target_system=2, target_component=component, param_index=0)
        assert len(fields(b.tick(ask), "PARAM_VALUE")) == answers
        out = b.node.handle([b.plant.at(b.k, GCS.named("COMMAND_LONG", target_component=component, command=31010))])
        b.k += 1
        assert len(fields(out.reply, "COMMAND_ACK")) == answers


@pytest.mark.parametrize(
    ("command", "params", "result", "why"),
    [
        (31011, (1.0,), 3, "command 31011 (Small UAV: choose the law): not one of mission receiver"),
        (191, (), 3, "command 191 (Jet transport: give the approach up): not one of mission receiver"),
        (400, (1.0,), 3, "command 400: not one of mission receiver"),
        (246, (2.0,), 2, "the plant ends a run, nobody else"),
        (512, (30.5,), 2, "message id 30.5: a whole number is needed"),
        (512, (999.0,), 3, "message id 999 is not sent here"),
        (511, (30.0, 100.0), 2, "interval 100 us: allowed 10000 or more, 0 default, -1 off"),
        (511, (30.0, math.nan), 2, "interval nan us: allowed 10000 or more, 0 default, -1 off"),
    ],
)
def test_a_refusal_says_why(command: int, params: tuple[float, ...], result: int, why: str) -> None:
    """As COMMAND_LONG and as COMMAND_INT, in a text the answer names."""
    b = Bench()
    p = {f"param{i + 1}": v for i, v in enumerate(params)}
    for name in ("COMMAND_LONG", "COMMAND_INT"):
        out = b.tick(GCS.named(name, target_system=2, target_component=1, command=command, **p))
        [ack] = fields(out, "COMMAND_ACK")
        said = "".join(t["text"] for t in fields(out, "STATUSTEXT") if t["id"] == ack["result_param2"])
        assert (ack["result"], said) == (result, why)
        assert ack["result_param2"] and b.node.last_text == why


def test_command_int_does_what_command_long_does() -> None:
    b = Bench()
    place = {"x": -970_000_000, "y": 350_000_000, "z": 7000.0, "frame": 5}
    out = b.tick(GCS.named("COMMAND_INT", target_system=2, command=511, param1=30.0, param2=20_000.0, **place))
    assert [a["result"] for a in fields(out, "COMMAND_ACK")] == [0]
    assert names(b.tick(n=100)).count("ATTITUDE") == 50
    out = b.tick(GCS.named("COMMAND_INT", target_system=2, command=31010, param1=3.0, **place))
    assert [(a["command"], a["result"]) for a in fields(out, "COMMAND_ACK")] == [(31010, 0)]
    [c] = b.app.commands_seen[-1:]
    assert c.params == (3.0, 0.0, 0.0, 0.0, -970_000_000.0, 350_000_000.0, 7000.0)
    link = b.node.handle([b.plant.at(b.k, GCS.named("COMMAND_INT", target_system=2, command=192))])
    assert [(a["command"], a["result"]) for a in fields(link.reply, "COMMAND_ACK")] == [(192, 3)]


def test_a_repeated_order_is_carried_out_once_and_answered_each_time() -> None:
    b = Bench()
    order = {"target_system": 2, "command": 31010, "param1": 2.0, "param5": math.nan}
    acks = []
    for confirmation in (0, 1, 2):
        acks += fields(b.tick(GCS.named("COMMAND_LONG", confirmation=confirmation, **order)), "COMMAND_ACK")
    assert [a["result"] for a in acks] == [0, 0, 0] and len(b.app.commands_seen) == 1
    b.tick(GCS.named("COMMAND_LONG", confirmation=0, **order))  # again, not a repeat
    b.tick(GCS.named("COMMAND_LONG", confirmation=1, **(order | {"param1": 3.0})))  # another one
    b.tick(wire.Sender(254, 1).named("COMMAND_LONG", confirmation=1, **order))  # another sender
    assert len(b.app.commands_seen) == 4
    for confirmation in (0, 1):  # what is asked for may have got lost: it comes again
        out = b.tick(GCS.named("COMMAND_LONG", target_system=2, confirmation=confirmation, command=512, param1=148.0))
        assert len(fields(out, "AUTOPILOT_VERSION")) == 1


def test_the_version_names_the_mission() -> None:
    b = Bench()
    [v] = fields(b.tick(GCS.named("COMMAND_LONG", target_system=2, command=512, param1=148.0)), "AUTOPILOT_VERSION")
    assert v["product_id"] == VALUES["WKF_MISSION_RECEIVER"]
    known = {e.name.removeprefix("WKF_MISSION_").lower() for e in ENUMS["WKF_MISSION"].values()}
    assert set(MISSIONS) == known


def test_commands_of_the_missions_are_those_of_the_icd() -> None:
    """Algorithms do not import the ICD: their copies of its numbers are compared here."""
    for cls in MISSIONS.values():
        module = sys.modules[cls.build.__module__]
        copies = {n: v for n, v in vars(module).items() if n.startswith("MAV_CMD_")}
        assert copies == {n: VALUES[n] for n in copies}
        assert cls.commands and cls.commands <= set(ENUMS["MAV_CMD"])
    for name in ("ACCEPTED", "TEMPORARILY_REJECTED", "DENIED", "UNSUPPORTED"):
        assert getattr(types, name) == VALUES[f"MAV_RESULT_{name}"]
    for enum, own in (("WKF_ACTION", refuel.ACTIONS), ("WKF_GUST_LAW", dict(enumerate((*GUST_LAWS, "other")))),
                      ("WKF_WS_LAW", dict(enumerate(ESCAPE_LAWS)))):  # fmt: skip
        icd = {v: e.name.removeprefix(f"{enum}_").lower() for v, e in ENUMS[enum].items()}
        assert own.items() <= icd.items() and len(own) == len(icd)
    own_numbers = [c for cls in MISSIONS.values() for c in cls.commands if c >= VALUES["MAV_CMD_USER_1"]]
    families = {MISSIONS[m].commands & set(own_numbers) for m in ("receiver", "gust", "windshear")}
    assert len(families) == 3 and all(len(f) == 1 for f in families)  # no number means two things


# --- floods ---------------------------------------------------------------------------------------------------------


def test_a_storm_of_requests_costs_a_bounded_tick_and_is_told() -> None:
    b = Bench()
    ask = GCS.named("COMMAND_LONG", target_system=2, command=512, param1=30.0)
    read = GCS.named("PARAM_REQUEST_READ", target_system=2, param_index=0)
    rate = GCS.named("COMMAND_LONG", target_system=2, command=511, param1=30.0, param2=20_000.0)
    for kind, answered in ((ask, "COMMAND_ACK"), (rate, "COMMAND_ACK"), (read, "PARAM_VALUE")):
        b = Bench()
        b.tick(n=101)
        before = b.node.services.count.excess + b.node.unread_ground
        out = b.tick(*[kind * 40] * 50)
        dropped = b.node.services.count.excess + b.node.unread_ground - before
        limit = ANSWERS_MAX if kind is read else PACKETS_MAX
        assert len(fields(out, answered)) == limit and dropped >= 48
        assert names(out).count("ATTITUDE") <= 2  # asked for 64 times, sent once (and by its rate)
        assert all(len(d) <= 1400 for d in b.node.telemetry.datagrams(b.last, 0))
        rest = b.tick(n=120)
        if kind is read:
            assert len(fields(rest, answered)) == PACKETS_MAX - ANSWERS_MAX
        assert [t["text"] for t in fields(rest, "STATUSTEXT")] == [f"{dropped} packets dropped unread"]
        assert fields(rest, "SYS_STATUS")[-1]["errors_count4"] == dropped


def test_sequence_numbers_leave_no_gap_however_much_is_answered() -> None:
    """What counts as lost on the ground: cut datagrams, parameter lists, reasons in chunks, a storm."""
    b = Bench()
    foreign = GCS.named("COMMAND_LONG", target_system=2, command=31012)
    asked = {
        3: [GCS.named("PARAM_REQUEST_LIST", target_system=2)],
        20: [foreign * 40] * 5,
        21: [GCS.named("PARAM_REQUEST_READ", target_system=2, param_index=1) * 30, foreign],
    }
    gaps, many = SequenceGaps(), 0
    for k in range(60):
        reply = b.node.handle([b.plant.at(k)], None, asked.get(k, ()))
        many = max(many, len(reply.telemetry))
        for d in reply.telemetry:
            assert len(d) <= 1400
            packets = wire.split(d, wire.SPECS, wire.Counters())
            assert {"time_usec", "time_boot_ms"} & set(packets[0][0].slots)  # each begins with a time
            for _, _, sysid, compid, at, _ in packets:
                gaps.see(sysid, compid, d[at + 4])
    assert many > 3 and gaps.dropped == {2: 0} and b.node.telemetry.ctx.send.seq == gaps._last[2 << 8 | 1] + 1 & 255


def test_a_storm_on_the_plant_link_is_bounded_too() -> None:
    b = Bench()
    storm = GCS.named("COMMAND_LONG", target_system=2, command=512, param1=30.0) * 200
    out = b.node.handle([storm, storm, b.plant.at(0)])
    assert len(fields(out.reply, "COMMAND_ACK")) == COMMANDS_MAX and b.node.count.excess == 400 - COMMANDS_MAX
    assert names(out.reply)[0] == "HIL_ACTUATOR_CONTROLS"


def test_commands_without_ticks_are_bounded() -> None:
    """The plant is silent and the ground goes on."""
    b = Bench()
    order = GCS.named("COMMAND_LONG", target_system=2, command=31010, param1=2.0)
    for _ in range(500):
        b.node.handle([b"?"], None, [order])
    assert len(b.node._waiting) <= COMMANDS_MAX
    assert len(fields(b.tick(), "COMMAND_ACK")) <= COMMANDS_MAX


def test_request_message_and_version() -> None:
    b = Bench()
    b.tick(n=3)
    assert "ATTITUDE" in names(b.tick(GCS.named("COMMAND_LONG", target_system=2, command=512, param1=30.0)))
    out = b.tick(GCS.named("COMMAND_LONG", target_system=2, command=512, param1=148.0))
    assert fields(out, "AUTOPILOT_VERSION")[0]["capabilities"] & 8192


def test_message_interval_changes_and_returns() -> None:
    b = Bench()
    b.command(511, 30.0, 20_000.0)
    assert names(b.tick(n=100)).count("ATTITUDE") == 50
    b.command(511, 30.0, -1.0)
    assert "ATTITUDE" not in names(b.tick(n=100))
    b.command(511, 30.0, 0.0)
    assert names(b.tick(n=100)).count("ATTITUDE") == 4


def test_timesync_is_answered_with_sample_time() -> None:
    b = Bench()
    b.tick(n=5)
    out = b.tick(GCS.named("TIMESYNC", tc1=0, ts1=12345))
    assert fields(out, "TIMESYNC") == [{"tc1": 40_000_000, "ts1": 12345}]
    assert "TIMESYNC" not in names(b.tick(GCS.named("TIMESYNC", tc1=7, ts1=1)))


def test_ground_noise_is_counted_apart_from_the_plant_link() -> None:
    b = Bench()
    radio_status = bytes.fromhex("fd0200000affbe6d00000201") + b"\0\0"
    b.tick(b"hello", radio_status, GCS.named("HEARTBEAT", type=6), GCS.named("REQUEST_DATA_STREAM"))
    assert b.node.services.count.bad_length == 1 and b.node.services.count.unknown == 1
    assert b.node.count == wire.Counters()


@given(st.lists(st.binary(max_size=60), max_size=4), st.sampled_from(sorted(s.name for s in ACCEPT.values())))
@settings(max_examples=60, deadline=None)
def test_nothing_from_the_ground_raises(junk: list[bytes], name: str) -> None:
    spec = wire.BY_NAME[name]
    packets = [GCS.pack(spec, *spec.unpack(j.ljust(spec.size, b"\xff")[: spec.size])) for j in junk]
    Bench().tick(*packets, *junk, n=2)


def test_command_over_the_plant_link_is_answered_in_the_reply_and_to_the_ground() -> None:
    b = Bench()
    out = b.node.handle([b.plant.at(0, b.plant.codec.command(31010, 2.0), b.plant.codec.command(400))])
    acks = {a["command"]: a["result"] for a in fields(out.reply, "COMMAND_ACK")}
    assert acks == {31010: 0, 400: 3} and names(out.reply)[0] == "HIL_ACTUATOR_CONTROLS"
    assert {a["command"]: a["result"] for a in fields(b"".join(out.telemetry), "COMMAND_ACK")} == acks
    assert names(b.node.handle([b.plant.at(1)]).reply) == ["HIL_ACTUATOR_CONTROLS"]


def test_configuration_is_not_written_to() -> None:
    cfg = config()
    before = dataclasses.asdict(cfg)
    Node(cfg, FakeApp()).handle([FakePlant().at(0)])
    assert dataclasses.asdict(cfg) == before
