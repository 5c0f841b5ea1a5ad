"""Replay repeats a run to the bit; any change of inputs, software parameters or log shows, by name."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import LINK_IN, LINK_OUT, TlogError, TlogWriter, read
from flightsw.process.config import load_flight
from flightsw.process.node import Node
from flightsw.process.replay import Report, replay
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.replay_cmd import names_of, replay_run
from hil_scripts.launch.runfolder import make_folder, resolve
from tests.sil.launch import sil

SECONDS = 8.0
AT_US = 5_000_000  # [us] sample time of the mutation
SENSOR = wire.BY_NAME["HIL_SENSOR"]
Record = tuple[int, int, bytes]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short flight, flown in process."""
    plan = resolve("refueling", 11, [], SECONDS)
    folder = make_folder(plan, tmp_path_factory.mktemp("replay") / "run")
    flight = InProcess(plan, folder)
    while not flight.server.done:
        flight.tick()
    flight.finish()
    return folder


@pytest.fixture
def mutable(run: Path, tmp_path: Path) -> Path:
    """A copy to spoil."""
    return Path(shutil.copytree(run, tmp_path / "run"))


def rewrite(path: Path, change: Callable[[Record], Record | None]) -> int:
    """Pass every record of a log through `change` (None: leave it out); how many it altered."""
    records = list(read(path))
    altered = 0
    writer = TlogWriter(path)
    for record in records:
        new = change(record)
        altered += new != record
        if new is not None:
            writer.write(new[0], new[2], new[1])
    writer.close()
    return altered


def flip_gyro_bit(record: Record) -> Record:
    """One mantissa bit of HIL_SENSOR.xgyro at AT_US, CRC made good again."""
    t_us, link, packet = record
    if t_us != AT_US or link != LINK_IN or wire.message_id(packet) != SENSOR.id:
        return record
    ((_, values, sysid, compid, *_),) = wire.split(packet, wire.SPECS, wire.Counters())
    at = SENSOR.slots["xgyro"][0]
    (bits,) = struct.unpack("<I", struct.pack("<f", values[at]))
    (changed,) = struct.unpack("<f", struct.pack("<I", bits ^ 1 << 12))
    sender = wire.Sender(sysid, compid)
    sender.seq = packet[4]
    return t_us, link, sender.pack(SENSOR, *values[:at], changed, *values[at + 1 :])


def replay_one(folder: Path, name: str = "receiver") -> Report:
    return replay(folder / f"link_{name}.tlog", Node(load_flight(folder / f"flight_{name}.toml")))


def test_nothing_differs(run: Path) -> None:
    reports = replay_run(run)
    assert sorted(reports) == names_of(run) == ["receiver", "tanker"]
    for r in reports.values():
        assert r.ok, r.lines()
        assert r.ticks == SECONDS * 100 and r.packets > r.ticks


def test_the_mutation_itself_is_neutral(run: Path) -> None:
    """Writing a log back unchanged changes no byte, so a difference comes from the mutation."""
    before = (run / "link_tanker.tlog").read_bytes()
    assert rewrite(run / "link_tanker.tlog", lambda r: r) == 0
    assert (run / "link_tanker.tlog").read_bytes() == before


def test_one_bit_of_gyro_shows_by_name_and_time(mutable: Path) -> None:
    assert rewrite(mutable / "link_receiver.tlog", flip_gyro_bit) == 1
    r = replay_one(mutable)
    assert not r.ok and r.differences > 0
    assert any(k.startswith("NAV_STATE.") for k in r.count), r.lines()
    assert float(r.first.split()[2]) >= AT_US / 1e6
    assert all(size < 1.0 for size in r.worst.values()), r.lines()  # a hair's breadth stays one
    assert replay_one(mutable, "tanker").ok


def test_a_changed_recorded_output_shows(mutable: Path) -> None:
    controls = wire.BY_NAME["HIL_ACTUATOR_CONTROLS"]

    def change(record: Record) -> Record:
        t_us, link, packet = record
        if t_us != AT_US or link != LINK_OUT or wire.message_id(packet) != controls.id:
            return record
        ((_, values, sysid, compid, *_),) = wire.split(packet, wire.SPECS, wire.Counters())
        at = controls.slots["controls"][0] + 1
        sender = wire.Sender(sysid, compid)
        sender.seq = packet[4]
        return t_us, link, sender.pack(controls, *values[:at], values[at] + 0.25, *values[at + 1 :])

    assert rewrite(mutable / "link_receiver.tlog", change) == 1
    r = replay_one(mutable)
    assert r.count == {"HIL_ACTUATOR_CONTROLS.controls": 1}
    assert r.worst["HIL_ACTUATOR_CONTROLS.controls"] == pytest.approx(0.25, abs=1e-6)
    assert f"t = {AT_US / 1e6:.2f} s" in r.first


def test_a_lost_output_is_listed_as_one_sided(mutable: Path) -> None:
    def drop(record: Record) -> Record | None:
        return None if record[0] == AT_US and record[1] == LINK_OUT else record

    assert rewrite(mutable / "link_receiver.tlog", drop) > 0
    r = replay_one(mutable)
    assert r.differences == 0 and len(r.extra) == 1
    assert "only replayed: HIL_ACTUATOR_CONTROLS" in r.extra[0]


def test_another_onboard_parameter_differs(mutable: Path) -> None:
    cfg = load_flight(mutable / "flight_receiver.toml", {"nav.q_wind": 0.5})
    r = replay(mutable / "link_receiver.tlog", Node(cfg))
    assert any(k.startswith("NAV_STATE.wind") for k in r.count), r.lines()


@pytest.mark.parametrize("cut", [1, 40, 1000])
def test_a_log_cut_short_is_compared_as_far_as_it_goes(mutable: Path, cut: int) -> None:
    path = mutable / "link_receiver.tlog"
    path.write_bytes(path.read_bytes()[:-cut])
    r = replay_one(mutable)
    assert r.ok, r.lines()
    assert r.ticks > 0.9 * SECONDS * 100


def test_a_damaged_log_is_replayed_without_the_damage_and_it_is_said(mutable: Path) -> None:
    """A flipped bit in a packet of the plant: that packet is not used, the outputs then differ, and the reason is on screen."""
    path = mutable / "link_receiver.tlog"
    raw = bytearray(path.read_bytes())
    at = raw.index(bytes([107, 0, 0]), len(raw) // 2) + 20  # within a HIL_SENSOR
    raw[at] ^= 0x40
    path.write_bytes(bytes(raw))
    ended = sil("replay", mutable)
    assert ended.code == 1, ended.text
    assert "link_receiver.tlog: " in ended.text and "bytes are damaged, in 1 place" in ended.text
    assert "sil: " in ended.text and "Warning" not in ended.text


def test_rubbish_instead_of_a_log_is_named(mutable: Path) -> None:
    (mutable / "link_receiver.tlog").write_bytes(b"this is no log, not even nearly")
    with pytest.raises(TlogError, match=r"link_receiver\.tlog"):
        replay_one(mutable)


def test_command_reports_differences_and_exits_1(mutable: Path) -> None:
    rewrite(mutable / "link_receiver.tlog", flip_gyro_bit)
    ended = sil("replay", mutable)
    assert ended.code == 1, ended.text
    assert "first difference: t = 5." in ended.text and "NAV_STATE." in ended.text


def test_a_missing_configuration_is_named(mutable: Path) -> None:
    (mutable / "flight_tanker.toml").unlink()
    ended = sil("replay", mutable)
    assert ended.code == 2 and "flight_tanker.toml" in ended.text
