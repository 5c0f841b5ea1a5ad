"""Damaged, cut and foreign logs: what is read was written, what is lost is counted, and rubbish is refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import common as v1
from pymavlink.dialects.v20 import common as v2

from flightsw.icd import tlog
from flightsw.icd.damage import LogDamageWarning
from flightsw.icd.framing import TIME
from flightsw.icd.scan import EDGE_US, STAMP_SLACK_US, scan
from flightsw.icd.wire import SPECS, Counters, Sender, split
from ground.columns import LogError, load
from ground.link.packets import DTYPES
from ground.link.packets import split as split_any

Record = tuple[int, bytes]


def flight(n: int = 24) -> list[Record]:
    """(stamp [us], packet): two senders, timed and untimed messages, whole packets inside a payload."""
    senders = Sender(1, 1), Sender(2, 1)
    inner = Sender(7, 1).named("HEARTBEAT", custom_mode=0xFDFEFDFE)
    out = []
    for k in range(n):
        s, t = senders[k % 2], tlog.EPOCH_US + (k // 4) * 10_000
        own = t - tlog.EPOCH_US
        if k % 4 == 0:
            out.append((t, s.named("TRUTH", time_usec=own, pos_n=(1.0 * k, -2.0, -7010.0), V=190.0)))
        elif k % 4 == 1:
            out.append((t, s.named("NAV_STATE", time_usec=own, V=190.0 + k)))
        elif k % 4 == 2:
            out.append((t, s.named("STATUSTEXT", severity=6, text=f"line {k} \x7d")))
        else:
            data = (bytes(8) + inner).ljust(240, b"\xfd")
            out.append((t, s.named("RAW_BYTES", count=len(inner) + 8, data=data)))
    return out


FLIGHT = flight()
WHOLE = b"".join(t.to_bytes(8, "big") + p for t, p in FLIGHT)
ENDS = {
    FLIGHT[k][1] for k in (0, 2, 3, 22, 23)
}  # untimed before the first or behind the last timed one of their sender
TIMED = {i.to_bytes(3, "little") for i in TIME}
PLACES = np.cumsum([0] + [8 + len(p) for _, p in FLIGHT]).tolist()


def found(raw: bytes) -> list[Record]:
    log = scan(raw)
    rows = zip(log.stamp[log.known].tolist(), log.head[log.known].tolist(), log.size[log.known].tolist(), strict=True)
    return [(t, raw[at : at + n]) for t, at, n in rows]


def test_a_whole_log_is_read_to_the_byte() -> None:
    log = scan(WHOLE)
    assert found(WHOLE) == FLIGHT
    assert (log.junk_bytes, log.bad_stamps, log.damage) == (0, 0, "")


@settings(max_examples=300, deadline=None)
@given(st.lists(st.integers(0, 8 * len(WHOLE) - 1), min_size=1, max_size=4, unique=True))
def test_no_flipped_bit_gets_through_and_each_costs_one_packet(bits: list[int]) -> None:
    raw = bytearray(WHOLE)
    for b in bits:
        raw[b // 8] ^= 1 << b % 8
    log, got = scan(bytes(raw)), found(bytes(raw))
    written = {p: t for t, p in FLIGHT}
    for t, packet in got:
        assert packet in written  # every packet is different: sequence numbers
        timed = packet[7:10] in TIMED or packet not in ENDS
        assert abs((t & ~3) - written[packet]) <= (STAMP_SLACK_US if timed else EDGE_US)
    if len(bits) < 3:  # more of them around one record may leave nothing to tell it by
        assert len(FLIGHT) - len(got) <= len(bits)
    lost = len(FLIGHT) - len(got) - int((~log.known).sum())
    assert (log.junk_bytes > 0 or log.bad_stamps > 0) == (lost > 0) == (log.damage != "")


def test_every_stamp_bit_beyond_the_slack_is_seen() -> None:
    """In mid-log; the packet is left out, its neighbours are not."""
    at = PLACES[12]
    for bit in range(64):
        raw = bytearray(WHOLE)
        raw[at + bit // 8] ^= 0x80 >> bit % 8
        shift = abs(int.from_bytes(raw[at : at + 8], "big") - FLIGHT[12][0])
        log = scan(bytes(raw))
        assert log.bad_stamps == (shift > STAMP_SLACK_US), bit
        assert len(log) == len(FLIGHT) - log.bad_stamps


def test_a_packet_that_came_late_is_no_damage() -> None:
    """Its own time bears its stamp out."""
    late = [*FLIGHT]
    send = Sender(1, 9)
    for k, t in enumerate((0, 30_000_000, 5_000_000, 31_000_000)):
        late.append((tlog.EPOCH_US + t, send.named("NAV_STATE", time_usec=t, V=float(k + 1))))
    raw = b"".join(t.to_bytes(8, "big") + p for t, p in late)
    assert found(raw) == late


def test_every_cut_gives_the_whole_records_before_it() -> None:
    for cut in range(len(WHOLE) + 1):
        log = scan(WHOLE[:cut])
        whole = sum(p <= cut for p in PLACES[1:])
        assert found(WHOLE[:cut]) == FLIGHT[:whole]
        assert log.junk_bytes == log.cut_bytes == cut - PLACES[whole]
        assert ("cut off" in log.damage) == (cut not in PLACES)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, len(FLIGHT)), st.binary(min_size=1, max_size=400))
def test_foreign_bytes_between_records_cost_nothing_else(place: int, junk: bytes) -> None:
    at = PLACES[place]
    log = scan(WHOLE[:at] + junk + WHOLE[at:])
    assert found(WHOLE[:at] + junk + WHOLE[at:]) == FLIGHT
    assert log.junk_bytes == len(junk) and log.junk_places == 1


def test_a_gap_after_damage_loses_nothing_more() -> None:
    """The stamps go on a day later: still taken, after the near ones have been looked for in vain."""
    late = [(t + 86_400_000_000, p) for t, p in FLIGHT]
    tail = b"".join(t.to_bytes(8, "big") + p for t, p in late)
    assert found(WHOLE + b"\xfd\x00" * 9 + tail) == FLIGHT + late


@given(st.binary(max_size=2000))
def test_never_raises_on_any_bytes(raw: bytes) -> None:
    log = scan(raw)
    assert len(log) == 0 or log.size.sum() + 8 * len(log) + log.junk_bytes <= len(raw)


def test_an_unknown_message_is_kept_in_the_chain_and_counted(tmp_path: Path) -> None:
    stranger = bytearray(Sender(1, 1).named("HEARTBEAT"))
    stranger[7] = 250  # no message of the dialect
    path = tmp_path / "a.tlog"
    t = tlog.EPOCH_US.to_bytes(8, "big")
    path.write_bytes(WHOLE + t + bytes(stranger) + WHOLE)
    assert load(path).unknown == 1 and load(path).junk_bytes == 0
    assert [p for _, _, p in tlog.read(path)] == [p for _, p in FLIGHT] + [bytes(stranger)] + [p for _, p in FLIGHT]


def test_mostly_junk_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(b"x" * (len(WHOLE) + 1) + WHOLE)
    with pytest.raises(tlog.TlogError, match=rf"a\.tlog: is no log: {len(WHOLE) + 1} of {2 * len(WHOLE) + 1} bytes"):
        list(tlog.read(path))
    with pytest.raises(LogError, match=r"a\.tlog: is no log"):
        load(path)
    path.write_bytes(b"x" * len(WHOLE) + WHOLE)
    said = rf"a\.tlog: {len(WHOLE)} of {2 * len(WHOLE)} bytes are damaged, in 1 place"
    with pytest.warns(LogDamageWarning, match=said):
        assert load(path).packets == len(FLIGHT)


# --- MAVLink 1 ----------------------------------------------------------------------------------------------------------


def old_log(path: Path, n: int = 50) -> list[bytes]:
    """A log as a MAVLink 1 vehicle leaves it, made by the stock code; its packets."""
    mav, out = v1.MAVLink(None, srcSystem=3, srcComponent=1), []
    with path.open("wb") as f:
        for k in range(n):
            for msg in (
                v1.MAVLink_attitude_message(k * 100, 0.1, 0.02, k * 0.01, 0.0, 0.0, 0.0),
                v1.MAVLink_heartbeat_message(1, 3, 81, 0, 4, 3),
                v1.MAVLink_statustext_message(4, b"x" * (k % 50)),
            ):
                out.append(msg.pack(mav))
                mav.seq = (mav.seq + 1) % 256
                f.write(struct.pack(">Q", 1_600_000_000_000_000 + k * 100_000) + out[-1])
    return out


def test_mavlink_1_is_read(tmp_path: Path) -> None:
    packets = old_log(tmp_path / "old.tlog")
    log = load(tmp_path / "old.tlog")
    assert (log.packets, log.junk_bytes, log.unknown, log.sysids(), log.dropped) == (150, 0, 0, [3], {3: 0})
    attitude, text = log.get(3, "ATTITUDE"), log.get(3, "STATUSTEXT")
    assert attitude is not None and text is not None
    np.testing.assert_array_equal(attitude["yaw"], (np.arange(50) * 0.01).astype(np.float32))
    assert text["text"][49] == b"x" * 49
    assert attitude.t_us[1] - attitude.t_us[0] == 100_000
    # what `read` and `split` give is version 2 of the same: the stock decoder takes it
    decoder = v2.MAVLink(None)
    again = [p for _, _, p in tlog.read(tmp_path / "old.tlog")]
    assert again == [p for p, fault in split_any(b"".join(packets)) if not fault]
    for old, new in zip(packets, again, strict=True):
        (message,) = decoder.parse_buffer(new)
        want = v1.MAVLink(None).decode(bytearray(old))
        assert {k: v for k, v in message.to_dict().items() if k in want.to_dict()} == want.to_dict()
        assert (message.get_srcSystem(), message.get_seq()) == (3, want.get_seq())


@settings(max_examples=50, deadline=None)
@given(st.data())
def test_damaged_mavlink_1_costs_one_packet_a_bit(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("old") / "old.tlog"
    packets = old_log(path, 8)
    raw = bytearray(path.read_bytes())
    bit = data.draw(st.integers(0, 8 * len(raw) - 1))
    raw[bit // 8] ^= 1 << bit % 8
    log = scan(bytes(raw))
    got = [bytes(raw[a : a + n]) for a, n in zip(log.head[log.known], log.size[log.known], strict=True)]
    assert set(got) <= set(packets) and len(got) >= len(packets) - 1


def test_time_fields_agree_with_the_layout() -> None:
    for i, (offset, size, factor) in TIME.items():
        names = [n for n in ("time_usec", "time_boot_ms") if n in (DTYPES[i].names or ())]
        field, at = (DTYPES[i].fields or {})[names[0]][:2]
        assert (offset, size, factor) == (at, field.itemsize, 1 if names[0] == "time_usec" else 1000)
    assert TIME.keys() == {i for i, d in DTYPES.items() if {"time_usec", "time_boot_ms"} & set(d.names or ())}


def test_the_flight_of_these_tests_is_sound() -> None:
    """Every packet parses onboard, so that what is lost above is lost to the damage."""
    for _, packet in FLIGHT:
        count = Counters()
        assert len(split(packet, SPECS, count)) == 1 and count.bad == 0
