"""Link log and replay: everything comes back, differences are found and measured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from flightsw.icd import tlog, wire
from flightsw.process.node import Node
from flightsw.process.recorder import LinkRecorder
from flightsw.process.replay import read_ticks, replay

from .flight_fakes import FakeApp, FakePlant, config

GCS = wire.Sender(255, 190)


def fly(
    path: Path, ticks: int = 120, realtime: bool = False, extra: dict[int, list[bytes]] | None = None
) -> tuple[FakePlant, bytes]:
    """Fly a node with a recorder as the loops do; `extra`: tick -> ground datagrams. Returns the bytes sent."""
    extra = extra or {}
    now = (lambda: 0) if realtime else None
    node = Node(config(), FakeApp(), realtime=realtime, **({"now_us": now} if now else {}))  # type: ignore[arg-type]
    plant = FakePlant()
    rec = LinkRecorder(path, 2)
    sent = b""
    for k in range(ticks):
        datagrams: Sequence[bytes] = [plant.at(k)]
        dt = None
        if realtime:
            datagrams = [] if k == 50 else [plant.at(49), plant.at(51)] if k == 51 else datagrams
            dt = 0.02 if k == 60 else 0.01
        elif k == 40:  # between two ticks: rubbish longer than a record, a repeat, a step back
            for d in (b"\xfd" + bytes(range(256)) * 2, plant.at(39), plant.at(3)):
                assert node.tick == 40
                node.handle([d])
        out = node.handle(datagrams, dt, extra.get(k, ()))
        if realtime:
            rec.tick(node.t_us, round((dt or 0.0) * 1e6), node.exec.slips)
            node.exec.account(70.0 + k, 3.0 * k, 1 if k == 60 else 0)
        rec.inbound(node.t_us, node.take_heard())
        rec.outbound(node.t_us, out.reply, out.telemetry)
        sent += out.reply + b"".join(out.telemetry)
    out = node.handle([plant.codec.shutdown()], 0.01 if realtime else None)
    if realtime:  # the loop runs on its clock: the last datagram makes a tick of its own
        rec.tick(node.t_us, 10_000, node.exec.slips)
    rec.inbound(node.t_us, node.take_heard())
    rec.outbound(node.t_us, out.reply, out.telemetry)
    rec.close()
    return plant, sent


GROUND = {
    10: [GCS.named("COMMAND_LONG", target_system=2, command=511, param1=30.0, param2=20_000.0)],
    20: [b"noise", GCS.named("COMMAND_LONG", target_system=2, command=31010, param1=3.0)],
    30: [GCS.named("PARAM_REQUEST_LIST", target_system=2), GCS.named("TIMESYNC", ts1=5)],
}


@pytest.mark.parametrize("realtime", [False, True])
def test_replay_repeats_every_packet(realtime: bool, tmp_path: Path) -> None:
    path = tmp_path / "link_receiver.tlog"
    fly(path, realtime=realtime, extra=GROUND)
    report = replay(path, Node(config(), FakeApp(), realtime=realtime))
    assert report.ok, report.lines()
    assert report.ticks == (121 if realtime else 120) and report.packets > 250


def test_two_flights_give_the_same_file(tmp_path: Path) -> None:
    for name in ("a", "b"):
        fly(tmp_path / name, extra=GROUND)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_log_holds_all_bytes_with_sample_time_and_is_a_sound_tlog(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    _, sent = fly(path)
    records = list(tlog.read(path))
    assert b"".join(p for _, link, p in records if link in (tlog.LINK_OUT, tlog.GROUND_OUT)) == sent
    assert all(len(wire.split(p, wire.SPECS, wire.Counters())) == 1 for _, _, p in records)
    stamps = [t for t, _, _ in records]
    assert stamps == sorted(stamps) and set(stamps) == {k * 10_000 for k in range(120)}


def test_rubbish_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    fly(path)
    tick = next(t for t in read_ticks(path) if t.t_us == 400_000)
    assert tick.plant[0] == b"\xfd" + bytes(range(256)) * 2
    assert len(tick.plant) == 3  # rubbish, the step back, the tick


def test_difference_is_located_counted_and_measured(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    fly(path)
    app = FakeApp()
    app.gain = 1.5
    report = replay(path, Node(config(), app))
    assert not report.ok and not report.extra
    assert report.first.startswith("t = 0.01 s, reply: HIL_ACTUATOR_CONTROLS.controls was")
    assert report.count["HIL_ACTUATOR_CONTROLS.controls"] == 119
    top = math.radians(max(abs(x) for x in elevator_travel()))
    assert report.worst["HIL_ACTUATOR_CONTROLS.controls"] == pytest.approx(0.5 * 119e-4 / top, rel=1e-4)
    assert report.worst["MISSION_STATUS.elevator"] == pytest.approx(0.5 * 110e-4, rel=1e-4)
    assert "119 times, largest" in "\n".join(report.lines())


def elevator_travel() -> tuple[float, float]:
    from flightsw.aircraft import load_aircraft

    return load_aircraft("learjet24").controls.elevator_deg


def test_packets_only_one_side_has_are_listed(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    fly(path)
    cfg = config()
    cfg = dataclasses.replace(cfg, telemetry=dataclasses.replace(cfg.telemetry, rates_hz={"VFR_HUD": 0.0}))
    report = replay(path, Node(cfg, FakeApp()))
    assert report.extra[0] == "t = 0.20 s, telemetry: only recorded: VFR_HUD"
    cfg = dataclasses.replace(cfg, telemetry=dataclasses.replace(cfg.telemetry, rates_hz={"ATTITUDE": 5.0}))
    assert any("only replayed: ATTITUDE" in e for e in replay(path, Node(cfg, FakeApp())).extra)


def test_log_cut_off_anywhere_still_replays(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    fly(path)
    data = path.read_bytes()
    for cut in (1, 30, 100, 333, 1000):
        path.write_bytes(data[:-cut])
        report = replay(path, Node(config(), FakeApp()))
        assert report.ok and report.ticks >= 115, report.lines()


def test_limit_stops_early(tmp_path: Path) -> None:
    path = tmp_path / "l.tlog"
    fly(path)
    assert replay(path, Node(config(), FakeApp()), limit=10).ticks == 10


def test_unwritable_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(tlog.TlogError, match=r"none/link\.tlog: cannot be created"):
        LinkRecorder(tmp_path / "none" / "link.tlog", 2)
