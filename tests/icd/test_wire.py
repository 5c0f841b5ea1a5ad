"""The fast codec against the generated one, byte for byte, and against damage."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.icd import framing, wire

from .conftest import RANGES, extreme, generated, kinds
from .generated import mav

NAMES = sorted(wire.BY_NAME)


def same(a: Any, b: Any) -> bool:
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b or (a != a and b != b)


@st.composite
def messages(draw: st.DrawFn) -> tuple[str, dict[str, Any]]:
    name = draw(st.sampled_from(NAMES))
    fields: dict[str, Any] = {}
    for field, (kind, n) in kinds(name).items():
        if kind == "char":
            fields[field] = draw(st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=n))
            continue
        lo, hi = RANGES[kind]
        width = {"float": 32, "double": 64}.get(kind)
        one = st.floats(width=width) if width else st.integers(lo, hi)
        fields[field] = tuple(draw(st.lists(one, min_size=n, max_size=n))) if n else draw(one)
    return name, fields


@given(messages(), st.integers(0, 255), st.integers(1, 255), st.integers(0, 255))
@settings(max_examples=300, deadline=None)
def test_equals_generated_codec_and_round_trips(
    message: tuple[str, dict[str, Any]], seq: int, sysid: int, compid: int
) -> None:
    name, fields = message
    send = wire.Sender(sysid, compid)
    send.seq = seq
    packet = send.named(name, **fields)
    assert packet == generated(name, fields, sysid, compid, seq)
    count = wire.Counters()
    [(spec, values, got_sys, got_comp, start, stop)] = wire.split(packet, wire.SPECS, count)
    assert (spec.name, got_sys, got_comp, start, stop) == (name, sysid, compid, 0, len(packet))
    assert same(tuple(spec.to_dict(values).values()), tuple(fields.values()))
    assert count == wire.Counters()


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("name", NAMES)
def test_limits_of_every_field(name: str, which: int) -> None:
    fields = extreme(name, which)
    packet = wire.Sender(1, 1).named(name, **fields)
    assert packet == generated(name, fields, 1, 1, 0)
    [(spec, values, *_)] = wire.split(packet, wire.SPECS, wire.Counters())
    assert same(tuple(spec.to_dict(values).values()), tuple(fields.values()))
    [decoded] = mav.MAVLink(None, 1, 1).parse_buffer(packet)
    assert decoded.get_type() == name


def test_sequence_number_runs_per_sender_and_wraps() -> None:
    a, b = wire.Sender(1, 1), wire.Sender(2, 1)
    seqs = [a.named("HEARTBEAT")[4] for _ in range(258)]
    assert seqs == [*range(256), 0, 1]
    assert b.named("HEARTBEAT")[4] == 0


def test_named_refuses_what_does_not_fit() -> None:
    send = wire.Sender(1, 1)
    with pytest.raises(KeyError, match="no field 'speed'"):
        send.named("VFR_HUD", speed=1.0)
    with pytest.raises(ValueError, match="controls: 3 values; expected 16"):
        send.named("HIL_ACTUATOR_CONTROLS", controls=(1.0, 2.0, 3.0))


def stream() -> tuple[list[bytes], bytes]:
    send = wire.Sender(1, 1)
    packets = [
        send.named("HEARTBEAT", type=1),
        send.named("HIL_SENSOR", time_usec=10_000, xacc=1.0, fields_updated=63),
        send.named("STATUSTEXT", severity=6, text="hello"),
    ]
    return packets, b"".join(packets)


def test_several_packets_in_one_datagram() -> None:
    packets, data = stream()
    got = wire.split(data, wire.SPECS, wire.Counters())
    assert [data[p[4] : p[5]] for p in got] == packets == wire.frames(data)
    assert [wire.message_id(p) for p in packets] == [0, 107, 253]


@pytest.mark.parametrize("at", [0, 1, 2, 4, 7, 11, 20, 30])
def test_damage_costs_one_packet_and_is_counted_once(at: int) -> None:
    packets, data = stream()
    n = len(packets[0])
    bad = bytearray(data)
    bad[n + at] ^= 0x55
    count = wire.Counters()
    names = [p[0].name for p in wire.split(bytes(bad), wire.SPECS, count)]
    if at == 1:  # the length byte: the damaged packet may swallow the next
        assert names[0] == "HEARTBEAT"
    elif at == 7:  # the id: skipped by its length as unknown
        assert names == ["HEARTBEAT", "STATUSTEXT"]
    else:
        assert names == ["HEARTBEAT", "STATUSTEXT"]
    assert count.bad == 1


def test_rubbish_before_between_and_after() -> None:
    packets, _ = stream()
    data = b"\x00\xfd\x01junk" + packets[0] + b"\xfe\xfd\xfd\xfd" + packets[1] + b"tail\xfd"
    count = wire.Counters()
    assert [p[0].name for p in wire.split(data, wire.SPECS, count)] == ["HEARTBEAT", "HIL_SENSOR"]
    assert count.bad_length == 3


@pytest.mark.parametrize("cut", range(1, 40, 3))
def test_truncated_datagram(cut: int) -> None:
    packets, data = stream()
    count = wire.Counters()
    got = wire.split(data[:-cut], wire.SPECS, count)
    assert [p[0].name for p in got] == ["HEARTBEAT", "HIL_SENSOR", "STATUSTEXT"][: len(got)]
    assert len(got) >= 1 and count.bad_length == (
        0 if cut in (len(packets[2]), len(packets[2]) + len(packets[1])) else 1
    )


@given(st.binary(max_size=400))
@settings(max_examples=300, deadline=None)
def test_any_bytes_never_raise(data: bytes) -> None:
    wire.split(data, wire.SPECS, wire.Counters())
    wire.split(b"\xfd" + data, wire.SPECS, wire.Counters())


def test_unknown_message_is_skipped_whole_and_counted() -> None:
    _, data = stream()
    count = wire.Counters()
    got = wire.split(data, wire.table(["HEARTBEAT", "STATUSTEXT"]), count)
    assert [p[0].name for p in got] == ["HEARTBEAT", "STATUSTEXT"]
    assert count.unknown == 1 and count.bad == 1


def test_mavlink1_and_unknown_incompatibility_flags_are_refused() -> None:
    count = wire.Counters()
    link = mav.MAVLink(None, 1, 1)
    old = mav.MAVLink_heartbeat_message(1, 0, 0, 0, 0, 3).pack(link, force_mavlink1=True)
    assert wire.split(old, wire.SPECS, count) == [] and count.bad_length == 1
    flagged = bytearray(wire.Sender(1, 1).named("HEARTBEAT"))
    flagged[2] = 0x02
    assert wire.split(bytes(flagged), wire.SPECS, count) == [] and count.bad_length == 2


def test_signed_packet_is_read_past_its_signature() -> None:
    link = mav.MAVLink(None, 1, 1)
    link.signing.secret_key = b"k" * 32
    link.signing.sign_outgoing = True
    packet = mav.MAVLink_heartbeat_message(1, 0, 0, 7, 0, 3).pack(link)
    assert len(packet) == len(wire.Sender(1, 1).named("HEARTBEAT", type=1, custom_mode=7)) + 13
    got = wire.split(packet + packet, wire.SPECS, wire.Counters())
    assert [p[0].to_dict(p[1])["custom_mode"] for p in got] == [7, 7]


def test_longer_payload_of_a_newer_dialect_is_cut() -> None:
    from fastcrc import crc16

    spec = wire.BY_NAME["BOOM_STATE"]
    payload = spec.packer.pack(10, -0.5, 0.1, 4.0, 1, 1) + b"\x09\x09"
    body = bytes([len(payload), 0, 0, 0, 1, 1, *spec.id_bytes]) + payload
    packet = b"\xfd" + body + crc16.mcrf4xx(body + spec.extra).to_bytes(2, "little")
    [(_, values, *_)] = wire.split(packet, wire.SPECS, wire.Counters())
    assert values[0] == 10 and values[-1] == 1 and math.isclose(values[1], -0.5)


def test_version_1_packets_are_taken_in_version_2_framing() -> None:
    """The stock library's version 1 packer; whatever is not sound stays as it came."""
    from pymavlink.dialects.v10 import common as old

    mav = old.MAVLink(None, 254, 7)
    first = old.MAVLink_ping_message(5, 77, 0, 0).pack(mav)
    second = old.MAVLink_command_long_message(2, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0).pack(mav)
    got = wire.split(framing.modern(first + second), wire.SPECS, wire.Counters())
    assert [(p[0].name, p[2], p[3]) for p in got] == [("PING", 254, 7), ("COMMAND_LONG", 254, 7)]
    assert got[0][0].to_dict(got[0][1]) == {"time_usec": 5, "seq": 77, "target_system": 0, "target_component": 0}
    assert framing.modern(first + b"\xfe\x05") == framing.modern(first) + b"\xfe\x05"
    for junk in (b"", b"\xfe", first[:-1], first[:-1] + b"\x00", wire.Sender(1, 1).named("PING")):
        assert framing.modern(junk) == junk
