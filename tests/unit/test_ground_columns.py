"""Log to columns: every field survives, cut zeros come back, damage is counted, gaps are counted."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from flightsw.icd.tlog import TlogWriter, read
from flightsw.icd.wire import SPECS, Sender
from ground.columns import LogError, hold, load, match
from ground.link.packets import DTYPES, decode, packet_time_us, split

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run folder."""
    return Synth(duration_s=20.0).write(tmp_path_factory.mktemp("run"))


def test_columns_equal_packet_by_packet_decoding(run: Path) -> None:
    log = load(run / "tlm.tlog")
    seen: dict[tuple[int, int], int] = {}
    for t_us, _, packet in read(run / "tlm.tlog"):
        fields = decode(packet)
        key = (packet[5], packet[7] | packet[8] << 8 | packet[9] << 16)
        row = seen.get(key, 0)
        seen[key] = row + 1
        table = log.get(key[0], SPECS[key[1]].name)
        assert table is not None
        assert table.t_us[row] == t_us
        for name, value in fields.items():
            cell = table[name][row]
            assert (cell.decode() if isinstance(cell, bytes) else cell.tolist()) == value
    assert sum(seen.values()) == log.packets
    assert log.junk_bytes == log.unknown == 0


def test_every_message_layout_agrees_with_the_wire_packer() -> None:
    for msgid, spec in SPECS.items():
        assert DTYPES[msgid].itemsize == spec.size, spec.name
        assert list(DTYPES[msgid].names or ()) == list(spec.slots), spec.name


def test_cut_zero_bytes_come_back(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    with_zeros = Sender(2, 1).named("NAV_STATE", time_usec=10_000, V=190.0)
    assert len(with_zeros) < DTYPES[53010].itemsize
    writer = TlogWriter(path)
    writer.write(10_000, with_zeros)
    writer.close()
    table = load(path).get(2, "NAV_STATE")
    assert table is not None
    assert table["V"][0] == 190.0
    assert table["wind"][0].tolist() == [0.0, 0.0, 0.0]
    assert packet_time_us(with_zeros) == 10_000


def test_time_survives_a_payload_cut_inside_it() -> None:
    packet = Sender(2, 1).named("HEALTH_STATUS", time_usec=65536 * 3)
    assert packet[1] < 8
    assert packet_time_us(packet) == 65536 * 3


def test_cut_end_and_damage_are_counted_not_fatal(run: Path, tmp_path: Path) -> None:
    raw = (run / "tlm.tlog").read_bytes()
    whole = load(run / "tlm.tlog").packets
    cut = tmp_path / "cut.tlog"
    cut.write_bytes(raw[:-5])
    log = load(cut)
    assert log.packets == whole - 1
    assert log.junk_bytes > 0
    dirty = tmp_path / "dirty.tlog"
    dirty.write_bytes(b"\x01\x02\x03" + raw)
    assert load(dirty).packets == whole
    assert load(dirty).junk_bytes == 3


def test_empty_and_missing_logs(tmp_path: Path) -> None:
    (tmp_path / "empty.tlog").touch()
    assert load(tmp_path / "empty.tlog").packets == 0
    with pytest.raises(LogError, match=r"nothing\.tlog"):
        load(tmp_path / "nothing.tlog")


def test_gaps_are_counted_per_system(tmp_path: Path) -> None:
    senders = {1: Sender(1, 1), 2: Sender(2, 1)}
    writer = TlogWriter(tmp_path / "g.tlog")
    for k in range(600):
        for sysid, sender in senders.items():
            packet = sender.named("SYSTEM_TIME", time_boot_ms=k * 10)
            if not (sysid == 2 and k in (5, 6, 300)):
                writer.write(k * 10_000, packet)
    writer.close()
    assert load(tmp_path / "g.tlog").dropped == {1: 0, 2: 3}


def test_split_names_each_fault() -> None:
    sender = Sender(1, 1)
    good = sender.named("HEARTBEAT", custom_mode=5)
    bad = bytearray(sender.named("HEARTBEAT", custom_mode=6))
    bad[-1] ^= 0xFF
    strange = bytearray(good)
    strange[7] = 250
    data = good + bytes(bad) + bytes(strange)
    assert [f for _, f in split(data)] == ["", "crc", "unknown"]
    assert [f for _, f in split(good + b"junk")] == ["", "magic"]
    assert [f for _, f in split(good + good[:9])] == ["", "truncated"]
    assert [f for _, f in split(good[:-1])] == ["truncated"]
    assert list(split(b"")) == []


def test_match_and_hold() -> None:
    a, b = np.array([0, 10, 20, 30]), np.array([10, 25, 30])
    ia, ib = match(a, b)
    assert ia.tolist() == [1, 3]
    assert ib.tolist() == [0, 2]
    assert hold(a, b, np.array([1.0, 2.0, 3.0]), -1.0).tolist() == [-1.0, 1.0, 1.0, 3.0]


def test_decimation_keeps_the_first_of_each_period(run: Path) -> None:
    table = load(run / "tlm.tlog").get(1, "NAV_STATE")
    assert table is not None
    assert np.diff(table.decimated(1_000_000).t_us).tolist() == [1_000_000] * 20
    assert len(table.decimated(10_000)) == len(table)
