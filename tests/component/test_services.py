"""Parameters, commands, message intervals, time synchronisation."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.icd import wire
from flightsw.node import Node
from flightsw.services import flatten, short_names

from .flight_fakes import FakeApp, FakePlant, config, fields, names

GCS = wire.Sender(255, 190)


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
            out += b"".join(self.node.handle([self.plant.at(self.k)], None, ground).telemetry)
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


def test_parameter_list_is_complete_and_paced() -> None:
    b = Bench()
    n = len(b.node.services.names)
    out = b.tick(GCS.named("PARAM_REQUEST_LIST", target_system=2), n=60)
    got = fields(out, "PARAM_VALUE")
    assert [g["param_index"] for g in got] == list(range(n)) and {g["param_count"] for g in got} == {n}
    values = {g["param_id"]: g["param_value"] for g in got}
    assert values["ctrl.w_pos_m.2"] == pytest.approx(0.4) and values["app.sysid"] == 2.0


def test_parameter_by_name_index_and_unknown() -> None:
    b = Bench()
    read = lambda **k: fields(b.tick(GCS.named("PARAM_REQUEST_READ", target_system=2, **k)), "PARAM_VALUE")  # noqa: E731
    [by_name] = read(param_id="app.sysid", param_index=-1)
    [by_index] = read(param_index=by_name["param_index"])
    assert by_name == by_index
    assert read(param_id="no.such", param_index=-1) == [] and read(param_index=30_000) == []


def test_set_is_refused_with_the_old_value_unless_settable() -> None:
    class Settable(FakeApp):
        def __init__(self) -> None:
            super().__init__()
            self.settable = {"ctrl.w_pos_m.0": self.set}

        def set(self, v: float) -> bool:
            ok = 0.0 < v < 1.0
            self.gain = v if ok else self.gain
            return ok

    app = Settable()
    b = Bench(app)

    def put(name: str, value: float) -> float:
        out = b.tick(GCS.named("PARAM_SET", target_system=2, param_id=name, param_value=value, param_type=9))
        return float(fields(out, "PARAM_VALUE")[0]["param_value"])

    assert put("ctrl.w_pos_m.1", 9.0) == 0.5
    assert put("ctrl.w_pos_m.0", 0.25) == 0.25 and app.gain == 0.25
    assert put("ctrl.w_pos_m.0", 7.0) == 0.25 and put("ctrl.w_pos_m.0", math.nan) == 0.25


def test_timesync_is_answered_with_sample_time() -> None:
    b = Bench()
    b.tick(n=5)
    out = b.tick(GCS.named("TIMESYNC", tc1=0, ts1=12345))
    assert fields(out, "TIMESYNC") == [{"tc1": 40_000_000, "ts1": 12345}]
    assert "TIMESYNC" not in names(b.tick(GCS.named("TIMESYNC", tc1=7, ts1=1)))


def test_ground_noise_is_counted_apart_from_the_plant_link() -> None:
    b = Bench()
    stock_mission_request = bytes.fromhex("fd0200000affbe2b00000201") + b"\0\0"
    b.tick(b"hello", stock_mission_request, GCS.named("HEARTBEAT", type=6), GCS.named("REQUEST_DATA_STREAM"))
    assert b.node.services.count.bad_length == 1 and b.node.services.count.unknown == 1
    assert b.node.count == wire.Counters()


@given(
    st.lists(st.binary(max_size=60), max_size=4), st.sampled_from(["COMMAND_LONG", "PARAM_SET", "PARAM_REQUEST_READ"])
)
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


def test_flat_view() -> None:
    tree = {"a": {"b": 1, "c": [2.0, {"d": 3}], "text": "x", "on": True}}
    assert list(flatten(tree)) == [("a.b", 1.0), ("a.c.0", 2.0), ("a.c.1.d", 3.0)]


@given(st.lists(st.text("abc.", min_size=1, max_size=40), unique=True, max_size=60))
def test_short_names_are_distinct_and_short(keys: list[str]) -> None:
    got = short_names(keys)
    assert len(set(got)) == len(keys) and all(len(n) <= 16 for n in got)


def test_configuration_is_not_written_to() -> None:
    cfg = config()
    before = dataclasses.asdict(cfg)
    Node(cfg, FakeApp()).handle([FakePlant().at(0)])
    assert dataclasses.asdict(cfg) == before
