"""Recorder: one file from any interleaving, gaps and rubbish counted, clean end."""

from __future__ import annotations

import io
import json
import random
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from flightsw.icd.tlog import TlogWriter, read
from flightsw.icd.wire import Sender, frames
from ground.columns import load
from ground.link.merge import MAX_JUMP_US, Merger, SequenceGaps
from ground.link.record import Recorder, RecordError, open_socket, parse_target, run

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]


def interleave(streams: list[list[bytes]], rng: random.Random, lead: int) -> list[bytes]:
    """Any order of several streams in which none is more than `lead` datagrams ahead of another."""
    at = [0] * len(streams)
    out = []
    while any(a < len(s) for a, s in zip(at, streams, strict=True)):
        open_ = [i for i, s in enumerate(streams) if at[i] < len(s)]
        behind = min(at[i] for i in open_)
        i = rng.choice([i for i in open_ if at[i] - behind < lead])
        out.append(streams[i][at[i]])
        at[i] += 1
    return out


def record(datagrams: list[bytes], path: Path, every: int) -> Recorder:
    """Log of datagrams, written out after every `every` of them."""
    recorder = Recorder(TlogWriter(path))
    for k, datagram in enumerate(datagrams):
        recorder.take(datagram)
        if k % every == 0:
            recorder.write_ready()
    recorder.finish()
    return recorder


def test_packets_known_to_be_sound_are_recorded_as_datagrams_are(tmp_path: Path) -> None:
    """What a sender in the same process hands over is not looked through again."""
    synth = Synth(duration_s=30.0)
    datagrams = interleave([synth.telemetry(0), synth.telemetry(1)], random.Random(7), 3)
    looked = record(datagrams, tmp_path / "a.tlog", 7)
    known = Recorder(TlogWriter(tmp_path / "b.tlog"))
    for datagram in datagrams:
        known.take_sound(frames(datagram))
    known.finish()
    assert (tmp_path / "a.tlog").read_bytes() == (tmp_path / "b.tlog").read_bytes() != b""
    assert known.accounts() == looked.accounts() and known.status() == looked.status()


@pytest.mark.parametrize("seed", range(6))
def test_any_interleaving_gives_the_same_bytes(tmp_path: Path, seed: int) -> None:
    synth = Synth(duration_s=30.0)
    streams = [synth.telemetry(0), synth.telemetry(1)]
    record(interleave(streams, random.Random(99), 1), tmp_path / "a.tlog", 7)
    rng = random.Random(seed)
    recorder = record(interleave(streams, rng, 15), tmp_path / "b.tlog", rng.randint(1, 50))
    assert (tmp_path / "a.tlog").read_bytes() == (tmp_path / "b.tlog").read_bytes()
    assert recorder.merger.late == 0
    stamps = [t for t, _, _ in read(tmp_path / "b.tlog")]
    assert stamps == sorted(stamps)


def test_all_packets_of_a_datagram_share_its_first_time(tmp_path: Path) -> None:
    s = Sender(1, 1)
    late_text = s.named("NAV_STATE", time_usec=50_000) + s.named("STATUSTEXT", text="x")
    recorder = record([late_text, s.named("STATUSTEXT", text="alone")], tmp_path / "a.tlog", 1)
    assert [t for t, _, _ in read(tmp_path / "a.tlog")] == [50_000] * 3  # a datagram without time: the last one known
    assert recorder.packets == 3


def test_late_packets_are_kept_and_counted(tmp_path: Path) -> None:
    s = Sender(1, 1)
    times = [0, 10_000_000, 20_000_000, 5_000_000, 20_010_000]
    recorder = record([s.named("SYSTEM_TIME", time_boot_ms=t // 1000) for t in times], tmp_path / "a.tlog", 1)
    assert recorder.merger.late == 1
    assert sorted(t for t, _, _ in read(tmp_path / "a.tlog")) == sorted(times)


def test_rubbish_is_counted_by_kind_and_not_stored(tmp_path: Path) -> None:
    s = Sender(2, 1)
    good = s.named("NAV_STATE", time_usec=10_000, V=1.0)
    bad_crc = bytearray(s.named("NAV_STATE", time_usec=20_000, V=1.0))
    bad_crc[-2] ^= 1
    mad = s.named("NAV_STATE", time_usec=10_000 + 2 * MAX_JUMP_US)
    recorder = record([good, bytes(bad_crc), b"hello", good[:20], b"", mad], tmp_path / "a.tlog", 1)
    assert recorder.junk == {"crc": 1, "magic": 1, "truncated": 1, "time": 1}
    assert [p for _, _, p in read(tmp_path / "a.tlog")] == [good]


def test_sequence_gaps() -> None:
    gaps = SequenceGaps()
    for seq in (254, 255, 0, 3, 3, 2, 4):  # 1 and 2 missing at first; a repeat and a late one are no loss
        gaps.see(1, 1, seq)
    for seq in (7, 8):
        gaps.see(2, 1, seq)
    gaps.see(2, 190, 99)  # another component counts for itself
    assert gaps.dropped == {1: 2, 2: 0}


def test_merger_holds_the_window() -> None:
    merger = Merger(window_us=100)
    merger.push(0, 2, b"b")
    merger.push(0, 1, b"a")
    assert merger.ready() == []
    merger.push(101, 1, b"c")
    assert merger.ready() == [(0, b"a"), (0, b"b")]
    assert merger.flush() == [(101, b"c")]


def test_phase_in_the_status_line(tmp_path: Path) -> None:
    synth = Synth(duration_s=20.0)
    recorder = Recorder(TlogWriter(tmp_path / "a.tlog"))
    for a, b in list(zip(synth.telemetry(0), synth.telemetry(1), strict=True))[:100]:
        recorder.take(a)
        recorder.take(b)
    recorder.finish()
    status = recorder.status()
    assert status["phase"] == {"1": "LEG", "2": "CONTACT"}
    assert status["t"] == pytest.approx(9.9)


def test_recording_over_udp_and_forwarding(tmp_path: Path) -> None:
    synth = Synth(duration_s=5.0)
    streams = [synth.telemetry(0), synth.telemetry(1)]
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
    ):
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
        probe.close()
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(5.0)
        target = f"127.0.0.1:{listener.getsockname()[1]}"
        stop, out = threading.Event(), io.StringIO()
        box: list[Recorder] = []
        thread = threading.Thread(
            target=lambda: box.append(run(tmp_path / "new", port, forward=[target], stop=stop.is_set, status_to=out))
        )
        thread.start()
        while "listening" not in out.getvalue() and thread.is_alive():
            time.sleep(0.01)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tx:
            for a, b in zip(*streams, strict=True):
                tx.sendto(a, ("127.0.0.1", port))
                tx.sendto(b, ("127.0.0.1", port))
        assert listener.recv(65536) == streams[0][0]
        stop.set()
        thread.join()
    record(interleave(streams, random.Random(1), 1), tmp_path / "expected.tlog", 1)
    assert (tmp_path / "new" / "tlm.tlog").read_bytes() == (tmp_path / "expected.tlog").read_bytes()
    final = json.loads(out.getvalue().splitlines()[-1])
    assert final["done"] is True
    assert final["dropped"] == {"1": 0, "2": 0}
    assert box[0].packets == final["packets"] == load(tmp_path / "new" / "tlm.tlog").packets


@pytest.mark.parametrize("signum", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_process_with_the_log_flushed(
    tmp_path: Path, next_port_offset: Callable[[], int], signum: int
) -> None:
    offset = next_port_offset()
    command = [sys.executable, "-m", "ground", "record", "--out", str(tmp_path), "--port-offset", str(offset)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["listening"] == 14550 + offset
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tx:
            tx.sendto(Sender(1, 1).named("SYSTEM_TIME", time_boot_ms=1000), ("127.0.0.1", 14550 + offset))
        process.send_signal(signum)
        rest, _ = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    assert json.loads(rest.splitlines()[-1])["packets"] == 1
    assert [t for t, _, _ in read(tmp_path / "tlm.tlog")] == [1_000_000]


def test_busy_port_is_named(tmp_path: Path) -> None:
    with open_socket("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(RecordError, match=str(port)):
            run(tmp_path, port, stop=lambda: True)


def test_unwritable_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="file"):
        run(tmp_path / "file" / "below", 0, stop=lambda: True)


def test_full_disk_is_named(tmp_path: Path) -> None:
    (tmp_path / "tlm.tlog").symlink_to("/dev/full")
    with open_socket("127.0.0.1", 0) as probe:
        port = probe.getsockname()[1]
    sent = []

    def stop() -> bool:
        if not sent:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tx:
                tx.sendto(Sender(1, 1).named("SYSTEM_TIME", time_boot_ms=10), ("127.0.0.1", port))
            sent.append(1)
            return False
        return True

    with pytest.raises(RecordError, match=r"tlm\.tlog.*[Nn]o space"):
        run(tmp_path, port, stop=stop, status_to=io.StringIO())


@pytest.mark.parametrize("text", ["nowhere", "host:", "host:0", "host:70000", ":14550"])
def test_bad_forward_target_is_named(text: str) -> None:
    with pytest.raises(RecordError, match="host:port"):
        parse_target(text)
