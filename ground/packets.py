"""MAVLink 2 framing as the ground needs it: split a datagram, check it, find its time; no field decoding here.

Everything is looked up in tables made once from the generated dialect, so that a new message in the XML needs no edit.
Framing: magic 0xFD, length, incompat, compat, seq, sysid, compid, id (3 bytes, little endian), payload with trailing
zeros cut off, CRC-16/MCRF4XX over everything after the magic plus CRC_EXTRA, signature (13 bytes) if incompat bit 0.
Source: MAVLink 2 serialisation guide (mavlink.io).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from fastcrc import crc16

from flightsw.icd import mav

MAGIC = 0xFD
HEADER = 10  # bytes before the payload
CRC = 2
SIGNATURE = 13
PHASES: dict[int, str] = {
    value: entry.name.removeprefix("WKF_PHASE_")
    for value, entry in mav.enums.get("WKF_PHASE", {}).items()
    if not entry.name.endswith("ENUM_END")
}
FLAGS = [
    (v, e.name.removeprefix("WKF_HEALTH_")) for v, e in mav.enums["WKF_HEALTH"].items() if "ENUM_END" not in e.name
]
AIRCRAFT: dict[int, str] = {1: "tanker", 2: "receiver"}  # sysid -> name of the entity path
TANKER, RECEIVER = 1, 2

_crc = crc16.mcrf4xx
_NUMPY = {"c": "S", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "Q": "<u8"}
_NUMPY |= {"f": "<f4", "d": "<f8"}


def _dtype(cls: Any) -> np.dtype:
    """Structured dtype of a message's untruncated payload, fields in wire order."""
    spec: list[tuple] = []
    for name, code, count in zip(
        cls.ordered_fieldnames, bytes(cls.native_format).decode().lstrip("<"), cls.array_lengths, strict=True
    ):
        if code == "c":
            spec.append((name, f"S{max(count, 1)}"))
        elif count:
            spec.append((name, _NUMPY[code], (count,)))
        else:
            spec.append((name, _NUMPY[code]))
    return np.dtype(spec)


NAMES: dict[int, str] = {i: c.msgname for i, c in mav.mavlink_map.items() if i >= 0}
IDS: dict[str, int] = {n: i for i, n in NAMES.items()}
DTYPES: dict[int, np.dtype] = {i: _dtype(c) for i, c in mav.mavlink_map.items() if i >= 0}
CRC_EXTRA: dict[int, bytes] = {i: bytes([c.crc_extra]) for i, c in mav.mavlink_map.items() if i >= 0}


def _time_fields() -> dict[int, tuple[int, int, int]]:
    """id -> (offset in the payload, size, factor to microseconds) of the message's time field."""
    out: dict[int, tuple[int, int, int]] = {}
    for i, dt in DTYPES.items():
        for name, factor in (("time_usec", 1), ("time_boot_ms", 1000)):
            if dt.fields is not None and name in dt.fields:
                sub, offset = dt.fields[name][:2]
                out[i] = (offset, sub.itemsize, factor)
                break
    return out


TIME: dict[int, tuple[int, int, int]] = _time_fields()
MISSION_STATUS = IDS.get("MISSION_STATUS", -1)
_PHASE_AT = DTYPES[MISSION_STATUS].fields["phase"][1] if MISSION_STATUS >= 0 else 0  # type: ignore[index]


def packet_id(packet: bytes) -> int:
    """Message id of a framed packet."""
    return packet[7] | packet[8] << 8 | packet[9] << 16


def packet_time_us(packet: bytes) -> int | None:
    """Sample time [us] carried in the payload, None if the message has no time field."""
    where = TIME.get(packet_id(packet))
    if where is None:
        return None
    offset, size, factor = where
    length = packet[1]
    start = HEADER + offset
    raw = packet[start : HEADER + min(length, offset + size)]  # trailing zero bytes are not sent
    return int.from_bytes(raw, "little") * factor


def phase_of(packet: bytes) -> int:
    """Phase number in a MISSION_STATUS packet (0 if the byte was cut off as a trailing zero)."""
    return packet[HEADER + _PHASE_AT] if packet[1] > _PHASE_AT else 0


def phase_name(phase: int) -> str:
    """Name of a WKF_PHASE value."""
    return PHASES.get(phase, f"PHASE_{phase}")


def health_words(failed: int) -> str:
    """Failed inputs by name, "ok" if none."""
    return " ".join(n for v, n in FLAGS if failed & v) or "ok"


def split(datagram: bytes) -> Iterator[tuple[bytes, str]]:
    """Packets of a datagram as (bytes, fault). Fault is "" for a sound packet of the dialect, else what is wrong:
    "magic" (rest of the datagram skipped), "truncated", "unknown" (id not in the dialect, CRC not checkable), "crc"."""
    pos, end = 0, len(datagram)
    while pos < end:
        if datagram[pos] != MAGIC:
            yield datagram[pos:], "magic"
            return
        if end - pos < HEADER + CRC:
            yield datagram[pos:], "truncated"
            return
        body = pos + HEADER + datagram[pos + 1]
        stop = body + CRC + (SIGNATURE if datagram[pos + 2] & 1 else 0)
        if stop > end:
            yield datagram[pos:], "truncated"
            return
        packet = datagram[pos:stop]
        extra = CRC_EXTRA.get(packet[7] | packet[8] << 8 | packet[9] << 16)
        if extra is None:
            yield packet, "unknown"
        elif _crc(datagram[pos + 1 : body] + extra) != datagram[body] | datagram[body + 1] << 8:
            yield packet, "crc"
        else:
            yield packet, ""
        pos = stop


def decode(packet: bytes) -> dict[str, Any]:
    """Fields of one framed packet as Python values (arrays as lists, text as str). KeyError for an unknown id."""
    dt = DTYPES[packet_id(packet)]
    payload = packet[HEADER : HEADER + packet[1]].ljust(dt.itemsize, b"\0")[: dt.itemsize]
    row = np.frombuffer(payload, dtype=dt)[0]
    out: dict[str, Any] = {}
    for name in dt.names or ():
        value = row[name]
        out[name] = value.decode("utf-8", "replace") if isinstance(value, bytes) else value.tolist()
    return out
