"""Log files and UDP endpoints: stamps, truncated ends, refusals that name the thing."""

from __future__ import annotations

import socket
from collections import Counter
from pathlib import Path

import pytest

from flightsw.icd import tlog, wire
from flightsw.icd.link import DRAIN, EACH, SIZE, TOTAL, LinkError, UdpLink, plant_port, telemetry_port
from flightsw.icd.signing import Security

SEND = wire.Sender(1, 1)
HEARTBEAT = SEND.named("HEARTBEAT", type=1)
TEXT = SEND.named("STATUSTEXT", severity=6, text="hello")


def test_round_trip_with_link_numbers_and_grouped_datagram(tmp_path: Path) -> None:
    w = tlog.TlogWriter(tmp_path / "a.tlog")
    w.write(10_000, HEARTBEAT, tlog.LINK_OUT)
    w.write_datagram(20_000, HEARTBEAT + TEXT, tlog.GROUND_OUT)
    w.close()
    w.close()
    got = list(tlog.read(tmp_path / "a.tlog"))
    assert got == [(10_000, 1, HEARTBEAT), (20_000, 3, HEARTBEAT), (20_000, 3, TEXT)]
    stamp = int.from_bytes((tmp_path / "a.tlog").read_bytes()[:8], "big")
    assert stamp == tlog.EPOCH_US + 10_000 + 1 and tlog.EPOCH_US % 4 == 0


def test_raw_stamps_with_epoch_zero(tmp_path: Path) -> None:
    w = tlog.TlogWriter(tmp_path / "a.tlog", epoch_us=0)
    w.write(1_700_000_000_123_456, HEARTBEAT)
    w.close()
    assert next(tlog.read(tmp_path / "a.tlog", epoch_us=0))[0] == 1_700_000_000_123_456


def test_truncated_end_gives_the_whole_records(tmp_path: Path) -> None:
    w = tlog.TlogWriter(tmp_path / "a.tlog")
    for k in range(3):
        w.write(k * 10_000, HEARTBEAT)
    w.close()
    data = (tmp_path / "a.tlog").read_bytes()
    size = len(data) // 3
    for cut in range(1, size + 1):
        (tmp_path / "b.tlog").write_bytes(data[:-cut])
        assert len(list(tlog.read(tmp_path / "b.tlog"))) == 2


def test_stock_mavutil_reads_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    w = tlog.TlogWriter(tmp_path / "a.tlog")
    w.write_datagram(10_000, HEARTBEAT + TEXT, tlog.GROUND_OUT)
    w.close()
    log = mavutil.mavlink_connection(str(tmp_path / "a.tlog"), dialect="common")
    first = log.recv_match()
    assert first.get_type() == "HEARTBEAT" and abs(first._timestamp - (tlog.EPOCH_US + 10_000) * 1e-6) < 1e-5
    assert log.recv_match(type="STATUSTEXT").text == "hello"


def test_not_a_log_is_named(tmp_path: Path) -> None:
    (tmp_path / "x.tlog").write_bytes(b"this is no log at all, not even close")
    with pytest.raises(tlog.TlogError, match=r"x\.tlog: is no log: 37 of 37 bytes"):
        list(tlog.read(tmp_path / "x.tlog"))
    with pytest.raises(tlog.TlogError, match=r"gone\.tlog: cannot be read"):
        list(tlog.read(tmp_path / "gone.tlog"))


def test_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(tlog.TlogError, match=r"nowhere/a\.tlog: cannot be created: No such file"):
        tlog.TlogWriter(tmp_path / "nowhere" / "a.tlog")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_disk_is_named() -> None:
    w = tlog.TlogWriter("/dev/full")
    w.write(0, HEARTBEAT)
    with pytest.raises(tlog.TlogError, match="/dev/full: cannot be written: No space left"):
        w.flush()
    with pytest.raises(tlog.TlogError):
        w.close()


def test_a_second_of_log_time_is_not_held_back(tmp_path: Path) -> None:
    """What a process killed outright has written is whole to the second, whichever way it writes; also if time steps back."""
    path = tmp_path / "a.tlog"
    for write in (tlog.TlogWriter.write, tlog.TlogWriter.write_datagram):
        w = tlog.TlogWriter(path)
        for k in range(451):
            write(w, 10_000 * k, HEARTBEAT)
        assert max(t for t, _, _ in tlog.read(path)) == 4_000_000
        write(w, 1_000_000, HEARTBEAT)
        assert [t for t, _, _ in tlog.read(path)][-2:] == [4_500_000, 1_000_000]
        w.close()


def test_a_deleted_file_is_told_instead_of_written(tmp_path: Path) -> None:
    w = tlog.TlogWriter(tmp_path / "a.tlog")
    w.write(0, HEARTBEAT)
    w.flush()
    (tmp_path / "a.tlog").unlink()
    w.write(10, HEARTBEAT)
    with pytest.raises(tlog.TlogError, match=r"a\.tlog: cannot be written: the file has been deleted"):
        w.write(2_000_000, HEARTBEAT)
    with pytest.raises(tlog.TlogError, match="deleted"):
        w.close()


def test_busy_port_is_named() -> None:
    a = UdpLink(0, "first")
    with pytest.raises(LinkError, match=rf"127\.0\.0\.1:{a.port} \(plant link of tanker\) is already in use"):
        UdpLink(a.port, "plant link of tanker")
    a.close()
    with pytest.raises(LinkError, match=r"192\.0\.2\.1:\d+ \(far\) cannot be opened"):
        UdpLink(a.port, "far", host="192.0.2.1", security=Security(unsigned=True))
    with pytest.raises(LinkError, match="70000"):
        UdpLink(70000, "high")


def test_send_and_receive() -> None:
    a, b = UdpLink(0, "a"), UdpLink(0, "b")
    to = ("127.0.0.1", b.port)
    assert b.recv(0.0) is None and b.recv(0.01) is None
    for k in range(3):
        assert a.send(bytes([k]), to)
    got = b.recv(1.0)
    assert got == (b"\x00", ("127.0.0.1", a.port))
    assert [d for d, _ in b.take()] == [b"\x01", b"\x02"]
    assert b.sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) > 100_000
    assert not a.send(b"x" * 70_000, to) and a.dropped == 1
    a.close()
    b.close()


def test_what_one_call_takes_is_bounded_and_fair() -> None:
    """Strangers share what there is; the peer is first and gets all its own; too large is dropped; repeats are one."""
    a, b, c, to_all = UdpLink(0, "a"), UdpLink(0, "b"), UdpLink(0, "c"), UdpLink(0, "all")
    to = ("127.0.0.1", to_all.port)
    for k in range(20):
        a.send(b"a%d" % k, to)
        b.send(b"b%d" % k, to)
    a.send(b"x" * (SIZE + 1), to)
    b.send(b"y" * 60_000, to)
    for _ in range(5):
        c.send(b"c", to)
    c.send(b"z" * SIZE, to)
    friend = ("127.0.0.1", b.port)
    got = [d for d, _ in to_all.take(friend)]
    assert got[:20] == [b"b%d" % k for k in range(20)]  # first and whole
    assert got[20:] == [*(b"a%d" % k for k in range(EACH)), b"c", b"z" * SIZE]
    assert to_all.unread == 20 - EACH + 2 and to_all.take() == []
    for k in range(30):
        for s in (a, b, c):
            s.send(b"%d" % k, to)
    got_by = Counter(sender[1] for _, sender in to_all.take())
    assert sum(got_by.values()) == TOTAL and max(got_by.values()) <= EACH and len(got_by) == 3
    for _ in range(DRAIN // 10 + 2):
        for k in range(20):
            a.send(b"%d" % k, to)
    to_all.take()
    assert to_all.recv(0.0) is not None  # the call ended before the queue did
    for s in (a, b, c, to_all):
        s.close()


def test_port_plan() -> None:
    assert [plant_port(1), plant_port(2), plant_port(2, 100)] == [4560, 4561, 4661]
    assert [telemetry_port(1), telemetry_port(2, 20)] == [14601, 14622]
