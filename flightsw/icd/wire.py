"""Fast table-driven MAVLink 2 packer and parser, byte for byte the generator's own codec (tests/icd proves it).

A message is one `struct` call and one CRC. Values travel as one flat tuple in *wire order* (largest type first, as
MAVLink sorts them): arrays are spread out, a char array is one bytes object. `Spec.pick` finds fields by name.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from fastcrc import crc16

from flightsw.icd.dialect import HOUSE, Message

MAGIC = 0xFD
TRIES = 32  # magic bytes looked at within the damage of one datagram
HEADER = 10  # [byte]
OVERHEAD = 12  # [byte] header and CRC
SIGNATURE = 13  # [byte] follows the CRC when the incompatibility flag says so
SIGNED = 0x01
_crc: Callable[[bytes], int] = crc16.mcrf4xx
_HEAD = struct.Struct(
    "<BxxBBB3s"
).pack  # header after the magic byte: length, sequence number, system, component, message id
_HEAD_IN = struct.Struct(
    "<BBxxBBHB"
).unpack_from  # of it length, flag, system, component, low and high part of the message id
_ZEROS = bytes(256)
_CRC_OUT = struct.Struct("<H").pack

Packet = tuple["Spec", tuple[Any, ...], int, int, int, int]  # spec, values, sysid, compid, start, stop


class Spec:
    """Layout of one message. `slots[name] = (first flat index, array length or 0)`."""

    __slots__ = (
        "blank",
        "crc_extra",
        "extra",
        "fields",
        "id",
        "id_bytes",
        "is_text",
        "name",
        "pack",
        "packer",
        "size",
        "slots",
        "unpack",
        "unpack_from",
    )

    def __init__(self, m: Message) -> None:
        self.id: int = m.id
        self.name: str = m.name
        self.packer: struct.Struct = m.packer
        self.pack, self.unpack, self.unpack_from = m.packer.pack, m.packer.unpack, m.packer.unpack_from
        self.size: int = m.packer.size
        self.crc_extra: int = m.crc_extra
        self.extra = bytes([m.crc_extra])
        self.id_bytes = m.id.to_bytes(3, "little")
        self.fields: tuple[str, ...] = tuple(f.name for f in m.fields)
        self.slots: dict[str, tuple[int, int]] = {}
        self.is_text: set[str] = set()
        self.blank: list[Any] = []  # values of a message of which nothing is said
        for f in m.wire:
            text = f.type == "char"
            self.slots[f.name] = (len(self.blank), f.length)
            if text:
                self.is_text.add(f.name)
            self.blank += [b""] if text else [0] * (f.length or 1)
        if self.name == "HEARTBEAT":
            self.blank[self.slots["mavlink_version"][0]] = 3

    def __reduce__(self) -> tuple[Callable[[int], Spec], tuple[int]]:
        return _spec, (self.id,)  # a copy of what holds packets holds the same messages

    def pick(self, *names: str) -> Callable[[tuple[Any, ...]], Any]:
        """Getter of the named fields from a flat tuple; an array gives its values in a row. Raises KeyError."""
        index: list[int] = []
        for name in names:
            at, n = self.slots[name]
            index += [at] if name in self.is_text or n == 0 else range(at, at + n)
        return itemgetter(*index)

    def to_dict(self, values: tuple[Any, ...]) -> dict[str, Any]:
        """Field name -> value in declaration order; arrays as tuples, char arrays as str up to the first zero."""
        out: dict[str, Any] = {}
        for name in self.fields:
            at, n = self.slots[name]
            if name in self.is_text:
                out[name] = values[at].split(b"\0", 1)[0].decode("ascii", "replace")
            else:
                out[name] = values[at : at + n] if n else values[at]
        return out

    def from_dict(self, fields: dict[str, Any]) -> tuple[Any, ...]:
        """Flat tuple in wire order from named values; a missing field is 0. Raises KeyError for an unknown name."""
        out = self.blank.copy()
        for name, v in fields.items():
            if name not in self.slots:
                raise KeyError(f"{self.name} has no field {name!r}; it has {', '.join(self.fields)}")
            at, n = self.slots[name]
            if v is None:
                continue
            if name in self.is_text:
                out[at] = v.encode("ascii", "replace") if isinstance(v, str) else v
            elif n:
                row = list(v)
                if len(row) != n:
                    raise ValueError(f"{self.name}.{name}: {len(row)} values; expected {n}")
                out[at : at + n] = row
            else:
                out[at] = v
        return tuple(out)


SPECS: dict[int, Spec] = {i: Spec(m) for i, m in HOUSE.messages.items()}
BY_NAME: dict[str, Spec] = {s.name: s for s in SPECS.values()}


def _spec(ident: int) -> Spec:
    return SPECS[ident]


def table(names: Iterable[str]) -> dict[int, Spec]:
    """The messages a receiver accepts: id -> Spec. Anything else counts as unknown there."""
    return {BY_NAME[n].id: BY_NAME[n] for n in names}


class Sender:
    """Packs messages of one link: fixed system and component id, own running sequence number."""

    __slots__ = ("compid", "ident", "seq", "sysid")

    def __init__(self, sysid: int, compid: int) -> None:
        self.sysid, self.compid, self.seq, self.ident = sysid, compid, 0, 0

    def new_ident(self) -> int:
        """A number for a STATUSTEXT in chunks: 1 to 65535, round and round."""
        self.ident = self.ident % 0xFFFF + 1
        return self.ident

    def pack(self, spec: Spec, *values: Any) -> bytes:
        """One MAVLink 2 packet; `values` flat in wire order. Trailing zero bytes of the payload are left off.

        Raises struct.error if a value does not fit its wire type.
        """
        payload = spec.pack(*values)
        if not payload[-1]:
            payload = payload.rstrip(b"\0") or b"\0"
        seq = self.seq
        self.seq = (seq + 1) & 0xFF
        body = _HEAD(len(payload), seq, self.sysid, self.compid, spec.id_bytes) + payload
        return b"\xfd" + body + _CRC_OUT(_crc(body + spec.extra))

    def again(self, spec: Spec, sent: bytes, t_us: int) -> bytes:
        """A packet of `spec` anew, with another value of its first field, a uint64_t; a later field of it is not 0."""
        seq = self.seq
        self.seq = (seq + 1) & 0xFF
        head = _HEAD(len(sent) - OVERHEAD, seq, self.sysid, self.compid, spec.id_bytes)
        body = head + t_us.to_bytes(8, "little") + sent[HEADER + 8 : -2]
        return b"\xfd" + body + _CRC_OUT(_crc(body + spec.extra))

    def named(self, name: str, **fields: Any) -> bytes:
        """As `pack`, by message and field name (slower; missing fields are 0). Raises KeyError, ValueError,
        struct.error.
        """
        spec = BY_NAME[name]
        return self.pack(spec, *spec.from_dict(fields))

    def join(self, parts: Iterable[bytes]) -> bytes:
        """Packets as one datagram."""
        return b"".join(parts)


@dataclass(slots=True)
class Counters:
    """What a receiver dropped. A run of rubbish counts once, whatever its length."""

    bad_crc: int = 0
    bad_length: int = 0  # bytes that are no packet, or a packet cut short
    unknown: int = 0  # message id not accepted on this link
    non_finite: int = 0  # a field is NaN or infinite where a number is required
    out_of_order: int = 0  # time stamp not newer than the last one of its kind
    ahead: int = 0  # time stamp later than it can be
    stale: int = 0  # time stamp too long past
    excess: int = 0  # more in one tick than is dealt with

    @property
    def bad(self) -> int:
        """Packets dropped for their bytes or values (not for their time)."""
        return self.bad_crc + self.bad_length + self.unknown + self.non_finite

    @property
    def untimely(self) -> int:
        """Packets dropped for their time stamp."""
        return self.out_of_order + self.ahead + self.stale


def split(data: bytes, accept: dict[int, Spec], count: Counters, limit: int = 1 << 30) -> list[Packet]:
    """Sound packets of a datagram, in order, `limit` at most. Never raises: what is not sound is counted and skipped.

    After damage the search goes on at the next magic byte; everything up to the next sound packet is one count. It ends
    after TRIES magic bytes that began nothing: what a datagram costs is bounded, whatever is in it.
    """
    out: list[Packet] = []
    at, end = 0, len(data)
    lost = False  # in a run of rubbish already counted
    tries = 0
    while at < end and limit > 0:
        if lost:
            tries += 1
            if tries > TRIES:
                break
        if data[at] != MAGIC:
            if not lost:
                count.bad_length += 1
                lost = True
            at = data.find(b"\xfd", at)
            if at < 0:
                break
        if end - at < OVERHEAD or data[at + 2] & ~SIGNED:
            count.bad_length += not lost
            lost = True
            at += 1
            continue
        n, signed, sysid, compid, low, high = _HEAD_IN(data, at + 1)
        stop = at + OVERHEAD + n
        after = stop + SIGNATURE if signed else stop
        if after > end:
            count.bad_length += not lost
            lost = True
            at += 1
            continue
        spec = accept.get(low | high << 16)
        if spec is None:
            if lost:  # inside damage an unknown id is more likely payload than packet
                at += 1
                continue
            count.unknown += 1
            at = after
            continue
        if _crc(data[at + 1 : stop - 2] + spec.extra) != data[stop - 2] | data[stop - 1] << 8:
            count.bad_crc += not lost
            lost = True
            at += 1
            continue
        if n < spec.size:
            values = spec.unpack(data[at + HEADER : stop - 2] + _ZEROS[: spec.size - n])
        else:  # longer: a newer dialect with more extension fields
            values = spec.unpack_from(data, at + HEADER)
        out.append((spec, values, sysid, compid, at, after))
        limit -= 1
        lost = False
        at = after
    return out


def frames(data: bytes) -> list[bytes]:
    """Cut a datagram of sound packets into packets by their lengths alone (no CRC). Raises ValueError on anything
    else.
    """
    out = []
    at, end = 0, len(data)
    while at < end:
        if data[at] != MAGIC or end - at < OVERHEAD:
            raise ValueError(f"byte {at} of {end}: no MAVLink 2 packet")
        stop = at + OVERHEAD + data[at + 1] + (SIGNATURE if data[at + 2] & SIGNED else 0)
        if stop > end:
            raise ValueError(f"byte {at} of {end}: packet cut short")
        out.append(data[at:stop])
        at = stop
    return out


def message_id(packet: bytes) -> int:
    """Message id of a MAVLink 2 packet (at least 10 bytes)."""
    return packet[7] | packet[8] << 8 | packet[9] << 16
