"""Packets as the ground needs them: split a datagram, check it, find its time, read its fields.

Everything is looked up in tables made once from the generated dialect, so that a new message in the XML needs no edit.
Framing: flightsw.icd.framing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from flightsw.icd.dialect import HOUSE, Message
from flightsw.icd.framing import HEAD, TIME, V2, as_v2, check, next_sound

HEADER = HEAD[V2]  # bytes before the payload
Fields = dict[str, Any]  # of a decoded message, as its definition in the ICD says
PHASES: dict[int, str] = {v: word.upper() for v, word in HOUSE.words("WKF_PHASE").items()}
FLAGS = [(v, word.upper()) for v, word in HOUSE.words("WKF_HEALTH").items()]

_NUMPY = {"c": "S", "b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "Q": "<u8"}
_NUMPY |= {"f": "<f4", "d": "<f8"}


def _dtype(m: Message) -> np.dtype:
    """Structured dtype of a message's untruncated payload, fields in wire order."""
    spec: list[tuple] = []
    for f in m.wire:
        if f.code == "c":
            spec.append((f.name, f"S{max(f.length, 1)}"))
        elif f.length:
            spec.append((f.name, _NUMPY[f.code], (f.length,)))
        else:
            spec.append((f.name, _NUMPY[f.code]))
    return np.dtype(spec)


NAMES: dict[int, str] = {i: m.name for i, m in HOUSE.messages.items()}
IDS: dict[str, int] = {n: i for i, n in NAMES.items()}
DTYPES: dict[int, np.dtype] = {i: _dtype(m) for i, m in HOUSE.messages.items()}


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
    """Packets of a datagram as (bytes, fault). Fault is "" for a sound packet of the dialect (in MAVLink 2 framing, whichever
    it came in), else what is wrong: "magic" or "truncated" (bytes up to the next sound packet), "unknown" (id not in the
    dialect, CRC not checkable), "crc"."""
    pos, end = 0, len(datagram)
    while pos < end:
        what, size = check(datagram, pos)
        stop = pos + size
        if not what:
            yield as_v2(datagram[pos:stop]), ""
        else:
            lost = (
                what == "crc" and stop < end and check(datagram, stop)[0] not in ("", "unknown")
            )  # its length is wrong too
            if lost or what in ("magic", "truncated"):
                stop = next_sound(datagram, pos + 1)
            yield datagram[pos:stop], what
        pos = stop


def decode(packet: bytes) -> Fields:
    """Fields of one framed packet as Python values (arrays as lists, text as str). KeyError for an unknown id."""
    dt = DTYPES[packet_id(packet)]
    payload = packet[HEADER : HEADER + packet[1]].ljust(dt.itemsize, b"\0")[: dt.itemsize]
    row = np.frombuffer(payload, dtype=dt)[0]
    out: Fields = {}
    for name in dt.names or ():
        value = row[name]
        out[name] = value.decode("utf-8", "replace") if isinstance(value, bytes) else value.tolist()
    return out
