"""The onboard process without sockets: ticks, duplicates, rubbish, time, data link, end of run."""

from __future__ import annotations

import dataclasses

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.icd import wire
from flightsw.process.application import make_app
from flightsw.process.node import Node
from flightsw.strict import ConfigError
from flightsw.types import UPD_GNSS, UPD_IMU, ActuatorCmd, SensorFrame, Snapshot

from .flight_fakes import FakeApp, FakePlant, config, fields, names


def start(**changes: object) -> tuple[Node, FakeApp, FakePlant]:
    app = FakeApp()
    return Node(config(**changes), app), app, FakePlant()


def echo(reply: bytes) -> int:
    return int(fields(reply, "HIL_ACTUATOR_CONTROLS")[0]["time_usec"])


def test_one_reply_per_sensor_datagram_echoing_its_time() -> None:
    node, app, plant = start()
    for k in range(20):
        out = node.handle([plant.at(k)])
        assert names(out.reply) == ["HIL_ACTUATOR_CONTROLS"] and echo(out.reply) == k * 10_000 and not out.done
    assert app.stamps == [k * 10_000 for k in range(20)] and app.steps == [0.01] * 20
    assert set(app.updated) == {UPD_IMU}


def test_reply_comes_before_telemetry_is_made() -> None:
    node, _, plant = start()
    reply = node.step([plant.at(0)])
    assert echo(reply) == 0 and node.telemetry.ctx.send.seq == 0
    assert node.after() and node.telemetry.ctx.send.seq > 0
    assert node.after() == []


def test_repeated_tick_gets_the_same_bytes_and_no_new_tick() -> None:
    node, app, plant = start()
    d = plant.at(0)
    first = node.handle([d])
    other_bytes = plant.at(0)  # the same tick, another sequence number
    assert d != other_bytes
    for again in (node.handle([d]), node.handle([other_bytes]), node.handle([d, d])):
        assert again.reply == first.reply and again.telemetry == []
    assert app.n == 1 and node.duplicates == 4
    assert echo(node.handle([plant.at(1)]).reply) == 10_000
    assert node.count == wire.Counters()


def test_time_running_backwards_is_counted_dropped_and_not_answered() -> None:
    node, app, plant = start()
    for k in (0, 1, 2):
        node.handle([plant.at(k)])
    out = node.handle([plant.at(1)])
    assert (out.reply, out.telemetry) == (b"", []) and node.count.out_of_order == 1
    assert app.n == 3 and node.frame.gyro_b[1] == pytest.approx(2e-4)
    assert echo(node.handle([plant.at(3)]).reply) == 30_000


def test_skipped_ticks_give_the_true_time_step() -> None:
    node, app, plant = start()
    for k in (0, 1, 5):
        node.handle([plant.at(k)])
    assert app.steps == [0.01, 0.01, 0.04]


@pytest.mark.parametrize("kind", ["rubbish", "truncated", "crc", "dialect", "empty"])
def test_bad_datagram_is_counted_and_not_answered(kind: str) -> None:
    node, app, plant = start()
    node.handle([plant.at(0)])
    good = plant.at(1)
    bad = {
        "rubbish": b"\xfd" * 50 + b"rubbish",
        "truncated": good[:-7],
        "crc": good[:-1] + bytes([good[-1] ^ 1]),
        "dialect": wire.Sender(2, 190).named("TICK", time_usec=10_000),
        "empty": b"",
    }[kind]
    out = node.handle([bad])
    assert out.reply == b"" and app.n == 1
    assert node.count.bad == (0 if kind == "empty" else 1)
    assert echo(node.handle([good]).reply) == 10_000 and app.n == 2


def test_bad_packets_are_told_to_the_ground() -> None:
    node, _, plant = start()
    node.handle([b"junk"])
    out = b"".join(b"".join(node.handle([plant.at(k)]).telemetry) for k in range(100))
    assert fields(out, "HEALTH_STATUS")[0]["bad_packets"] == 1
    assert fields(out, "SYS_STATUS")[0]["errors_count1"] == 1


@given(st.lists(st.one_of(st.binary(max_size=80), st.integers(0, 6)), max_size=20))
@settings(max_examples=100, deadline=None)
def test_any_mixture_keeps_time_rising_and_answers_only_sound_ticks(items: list[bytes | int]) -> None:
    node, app, plant = start()
    for item in items:
        out = node.handle([plant.at(item) if isinstance(item, int) else item])
        if isinstance(item, bytes):
            assert out.reply == b"" or len(item) > 60
    assert app.stamps == sorted(app.stamps)


def test_shutdown_command_ends_the_run_and_is_not_passed_on() -> None:
    node, app, plant = start()
    node.handle([plant.at(0)])
    out = node.handle([plant.codec.shutdown()])
    assert out.done and out.reply == b"" and app.n == 1
    node, app, plant = start()
    out = node.handle([plant.at(0, plant.codec.shutdown())])
    assert out.done and echo(out.reply) == 0


def test_other_reboot_commands_do_not_end_it() -> None:
    node, _, plant = start()
    out = node.handle([plant.at(0, plant.codec.command(246, 1.0))])
    assert not out.done and fields(out.reply, "COMMAND_ACK")[0]["result"] == 2


def test_command_without_sensor_packet_waits_for_the_tick() -> None:
    node, _, plant = start()
    node.handle([plant.at(0)])
    assert node.handle([plant.codec.command(31010, 1.0)]).reply == b""
    out = node.handle([plant.at(1)])
    assert fields(out.reply, "COMMAND_ACK")[0]["command"] == 31010
    assert fields(node.handle([plant.at(2)]).reply, "COMMAND_ACK") == []


def test_broadcast_of_own_state_at_20_hz() -> None:
    cfg = config()
    node, _, plant = start(link=dataclasses.replace(cfg.link, broadcast_peer=True))
    replies = [names(node.handle([plant.at(k)]).reply) for k in range(100)]
    with_peer = [k for k, r in enumerate(replies) if "FOLLOW_TARGET" in r]
    assert with_peer == list(range(0, 100, 5))
    assert replies[0] == ["HIL_ACTUATOR_CONTROLS", "FOLLOW_TARGET", "WIND_COV"]


def test_a_fix_goes_out_with_each_tick_that_brings_one_that_health_lets_through() -> None:
    node, app, plant = start(link=dataclasses.replace(config().link, broadcast_peer=True, raw_fix=True))
    inner = app.tick

    def tick(frame: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        k = round(frame.t_us / 10_000)
        frame.updated = UPD_IMU | (UPD_GNSS if k % 10 == 3 and k != 43 else 0)  # 43: refused
        frame.gnss_t_us = frame.t_us - 20_000
        return inner(frame, dt_s)

    app.tick = tick  # type: ignore[method-assign]
    replies = [node.handle([plant.at(k)]).reply for k in range(60)]
    sent = {k: fields(r, "RAW_FIX")[0]["time_usec"] for k, r in enumerate(replies) if "RAW_FIX" in names(r)}
    assert sent == {k: 10_000 * k - 20_000 for k in (3, 13, 23, 33, 53)}


def test_two_nodes_with_the_same_input_give_the_same_bytes() -> None:
    a, b = Node(config(), FakeApp()), Node(config(), FakeApp())
    plant = FakePlant()
    for k in range(250):
        d = plant.at(k)
        assert a.handle([d]) == b.handle([d])


def test_heard_keeps_everything_but_repeats() -> None:
    node, _, plant = start()
    d0, d1, junk = plant.at(0), plant.at(1), b"\xfdjunk"
    node.handle([d0])
    node.handle([d0])
    node.handle([junk])
    node.handle([d1], None, [b"?"])
    assert node.take_heard() == [(0, True, d0), (0, False, junk), (0, True, d1), (2, False, b"?")]
    assert node.take_heard() == []


# --- real time ------------------------------------------------------------------------------------------------------


def realtime() -> tuple[Node, FakeApp, FakePlant]:
    app = FakeApp()
    return Node(config(), app, realtime=True, now_us=iter(range(10**9)).__next__), app, FakePlant()


def test_realtime_runs_without_a_frame_and_time_goes_on() -> None:
    node, app, plant = realtime()
    assert node.handle([], 0.01).reply == b"" and app.n == 0  # nothing ever heard
    node.handle([plant.at(0)], 0.01)
    out = node.handle([], 0.01)
    assert out.reply and app.updated == [UPD_IMU, 0] and app.stamps == [0, 10_000]
    node.handle([plant.at(1)], 0.01)  # came late: time holds rather than running back
    node.handle([plant.at(2), plant.at(3)], 0.02)
    assert app.stamps == [0, 10_000, 10_000, 30_000] and app.steps == [0.01, 0.01, 0.01, 0.02]


def test_what_every_rate_group_costs_goes_down_once_a_second_in_real_time_only() -> None:
    node, _, plant = realtime()
    sent = [fields(b"".join(node.handle([plant.at(k)], 0.01).telemetry), "RATE_GROUP") for k in range(201)]
    assert [k for k, rows in enumerate(sent) if rows] == [0, 100, 200]
    [app] = sent[200]
    assert (app["label"], app["group"], app["divisor"], app["offset"], app["runs"]) == ("app", 0, 1, 0, 201)
    assert app["last"] == app["mean"] == app["max"] == 1.0  # this clock counts its readings
    node, plant = Node(config(), FakeApp()), FakePlant()
    assert not any(fields(b"".join(node.handle([plant.at(k)]).telemetry), "RATE_GROUP") for k in range(101))


def test_realtime_newest_frame_wins_and_older_are_merged() -> None:
    node, app, plant = realtime()
    node.handle([plant.at(0)], 0.01)
    air = dataclasses.replace(node.frame, t_us=10_000, updated=16, air_t_us=10_000, air_mask=1, air_V=(190.0,))
    air.air_alpha, air.air_beta = (0.1,), (0.0,)
    node.handle([plant.codec.sensors(air), plant.at(2)], 0.01)
    assert app.updated[-1] == UPD_IMU | 16 and node.frame.air_V == (190.0,)
    assert node.frame.gyro_b[1] == pytest.approx(2e-4) and app.stamps[-1] == 20_000


def test_realtime_reply_says_it_is_not_lockstep() -> None:
    node, _, plant = realtime()
    assert fields(node.handle([plant.at(0)], 0.01).reply, "HIL_ACTUATOR_CONTROLS")[0]["flags"] == 0
    node2, _, _ = start()
    assert fields(node2.handle([plant.at(0)]).reply, "HIL_ACTUATOR_CONTROLS")[0]["flags"] == 1


def test_realtime_timing_and_slip_warning_reach_the_ground() -> None:
    node, _, plant = realtime()
    texts = []
    timing = []
    for k in range(201):
        out = b"".join(node.handle([plant.at(k)], 0.01).telemetry)
        texts += [t["text"] for t in fields(out, "STATUSTEXT")]
        timing += fields(out, "LOOP_TIMING")
        node.exec.account(100.0 + k, 50.0, 1 if k in (20, 30) else 0)
    assert texts == ["loop slipped 2 periods"]
    assert timing[-1]["slips"] == 2 and timing[-1]["late_p99"] > 40 and timing[-1]["exec_mean"] > 100


def test_real_application_refuses_an_unknown_mission() -> None:
    cfg = config()
    cfg = dataclasses.replace(cfg, app=dataclasses.replace(cfg.app, mission="bombing"))
    with pytest.raises(ConfigError, match=r"app\.mission = 'bombing': allowed: gust, receiver, receiver_rendezvous"):
        make_app(cfg)
