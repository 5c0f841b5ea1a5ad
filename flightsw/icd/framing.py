"""MAVLink framing, version 1 and 2, as whoever reads recorded or foreign bytes needs it: is there a sound packet here?

Version 2: 0xFD, length, incompat, compat, seq, sysid, compid, id (3 bytes, little endian), payload with trailing zeros
cut off, CRC, signature (13 bytes) if incompat bit 0. Version 1: 0xFE, length, seq, sysid, compid, id (1 byte), payload, CRC.
The CRC (CRC-16/MCRF4XX) is over everything after the magic byte and the message's CRC_EXTRA, so only packets of the dialect
can be checked. Source: MAVLink serialisation guide (mavlink.io).
"""

from __future__ import annotations

from fastcrc import crc16

from flightsw.icd.dialect import HOUSE
from flightsw.icd.wire import SPECS

V2, V1 = 0xFD, 0xFE
HEAD = {V2: 10, V1: 6}  # [byte] before the payload
CRC = 2  # [byte]
SIGNATURE = 13  # [byte]
SIGNED = 0x01
EXTRA: dict[int, bytes] = {i: s.extra for i, s in SPECS.items()}

crc = crc16.mcrf4xx


def _time_fields() -> dict[int, tuple[int, int, int]]:
    """id -> (offset in the payload, size, factor to microseconds) of the message's time field."""
    out: dict[int, tuple[int, int, int]] = {}
    for i, m in HOUSE.messages.items():
        at = 0
        for f in m.wire:
            if f.name in ("time_usec", "time_boot_ms"):
                out.setdefault(i, (at, f.size, 1 if f.name == "time_usec" else 1000))
            at += f.size * max(f.length, 1)
    return out


TIME: dict[int, tuple[int, int, int]] = _time_fields()


def length(data: bytes, at: int) -> int:
    """Bytes of the packet that starts at `at` by its header alone; 0: no header starts there or it is cut off."""
    if at + 3 > len(data) or (head := HEAD.get(data[at], 0)) == 0:
        return 0
    size = head + data[at + 1] + CRC
    if data[at] == V2:
        if data[at + 2] & ~SIGNED:  # a flag of a later version: its bytes mean something else
            return 0
        size += SIGNATURE * data[at + 2]
    return size


def check(data: bytes, at: int) -> tuple[str, int]:
    """What is wrong with the packet at `at`, and its length in bytes (0: has no header). "" sound, "magic" no header,
    "truncated", "unknown" (id not in the dialect, CRC not checkable), "crc"."""
    size = length(data, at)
    if not size:
        return "truncated" if at + 3 > len(data) and data[at] in HEAD else "magic", 0
    if at + size > len(data):
        return "truncated", size
    if data[at] == V2:
        extra = EXTRA.get(data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16)
        end = at + 10 + data[at + 1]
    else:
        extra = EXTRA.get(data[at + 5])
        end = at + 6 + data[at + 1]
    if extra is None:
        return "unknown", size
    right = crc(data[at + 1 : end] + extra) == data[end] | data[end + 1] << 8
    return "" if right else "crc", size


def next_sound(data: bytes, at: int) -> int:
    """Offset of the first sound packet at or after `at`, len(data) if there is none.

    A packet whose length is right but whose bytes are damaged may hold whole packets in its payload (RAW_BYTES does): call
    with the offset behind it where a packet starts there.
    """
    end = len(data)
    while at < end:
        two, one = data.find(V2, at), data.find(V1, at)
        at = min(two if two >= 0 else end, one if one >= 0 else end)
        if at < end and not check(data, at)[0]:
            return at
        at += 1
    return end


def as_v2(packet: bytes) -> bytes:
    """A sound packet in version 2 framing: itself, or a version 1 packet in the other's header, CRC made anew."""
    if packet[0] == V2:
        return packet
    payload = packet[HEAD[V1] : -CRC]
    body = bytes((len(payload), 0, 0, packet[2], packet[3], packet[4], packet[5], 0, 0)) + payload
    return bytes((V2,)) + body + crc(body + EXTRA[packet[5]]).to_bytes(2, "little")


def modern(datagram: bytes) -> bytes:
    """A datagram of version 1 packets in version 2 framing; from the first that is not sound on as it is, like any other."""
    at, out = 0, []
    while at < len(datagram) and datagram[at] == V1 and not check(datagram, at)[0]:
        stop = at + length(datagram, at)
        out.append(as_v2(datagram[at:stop]))
        at = stop
    return b"".join(out) + datagram[at:] if out else datagram
