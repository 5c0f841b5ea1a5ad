"""What a plant and onboard software give each other: datagrams of bytes, or in one process the packets themselves.

Packets handed over have the values that come out of the wire: they pass through the very `struct` that lays out the message, so
that a float is rounded, an integer held in its type and a text cut as there. What is left out is header, CRC, and looking for
them: no log, no socket and nothing that touches bytes can have such a datagram.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any, Protocol

from flightsw.icd.wire import BY_NAME, SPECS, Counters, Packet, Sender, Spec, split

Handed = tuple[Packet, ...]
# a datagram, bytes or Handed: by default the one or the other
if TYPE_CHECKING:
    from typing_extensions import TypeVar

    D = TypeVar("D", default=bytes)
    H = TypeVar("H", default=Handed)
else:
    from typing import TypeVar

    D = TypeVar("D")
    H = TypeVar("H")


class Sends(Protocol[D]):
    """Packs messages of one link, as wire.Sender."""

    def pack(self, spec: Spec, *values: Any) -> D:
        """See wire.Sender."""
        ...

    def again(self, spec: Spec, sent: D, t_us: int) -> D:
        """See wire.Sender."""
        ...

    def named(self, name: str, **fields: Any) -> D:
        """See wire.Sender."""
        ...

    def join(self, parts: Sequence[D]) -> D:
        """Several as one datagram."""
        ...

    def new_ident(self) -> int:
        """See wire.Sender."""
        ...


class Hand:
    """Messages of one link as packets that carry the values of the wire."""

    __slots__ = ("compid", "ident", "sysid")

    def __init__(self, sysid: int, compid: int) -> None:
        self.sysid, self.compid, self.ident = sysid, compid, 0

    new_ident = Sender.new_ident

    def pack(self, spec: Spec, *values: Any) -> Handed:
        """As wire.Sender, with what it raises."""
        return ((spec, spec.unpack(spec.pack(*values)), self.sysid, self.compid, 0, 0),)

    def again(self, spec: Spec, sent: Handed, t_us: int) -> Handed:
        """As wire.Sender."""
        return ((spec, (t_us, *sent[0][1][1:]), self.sysid, self.compid, 0, 0),)

    def named(self, name: str, **fields: Any) -> Handed:
        """As wire.Sender, with what it raises."""
        spec = BY_NAME[name]
        return self.pack(spec, *spec.from_dict(fields))

    def join(self, parts: Sequence[Handed]) -> Handed:
        """Several as one datagram."""
        return parts[0] if len(parts) == 1 else tuple(chain.from_iterable(parts))


class Port(Protocol[D]):
    """One form of datagrams. `nothing`: an empty one; `logged`: logs may have them."""

    nothing: D
    logged: bool

    def sender(self, sysid: int, compid: int) -> Sends[D]:
        """Packs the messages of a system and component."""
        ...

    def packets(self, datagram: D, accept: dict[int, Spec], count: Counters) -> Sequence[Packet]:
        """Sound packets of the messages accepted; what is dropped is counted (wire.split)."""
        ...

    def part(self, datagram: D, p: Packet) -> D:
        """One of its packets, to be sent on as it is."""
        ...

    def as_bytes(self, datagram: D) -> bytes:
        """As it would be on the wire, but for its sequence numbers."""
        ...

    def of_bytes(self, data: bytes) -> D:
        """Sound packets in this form."""
        ...


class Wire:
    """Datagrams of bytes."""

    nothing, logged = b"", True

    def sender(self, sysid: int, compid: int) -> Sends[bytes]:
        """See Port."""
        return Sender(sysid, compid)

    # see Port
    packets = staticmethod(split)
    as_bytes = of_bytes = staticmethod(bytes)  # of bytes: themselves

    def part(self, datagram: bytes, p: Packet) -> bytes:
        """See Port."""
        return datagram[p[4] : p[5]]


class Direct:
    """Packets handed over."""

    nothing: Handed = ()
    logged = False

    def sender(self, sysid: int, compid: int) -> Sends[Handed]:
        """See Port."""
        return Hand(sysid, compid)

    def packets(self, datagram: Handed, accept: dict[int, Spec], count: Counters) -> Sequence[Packet]:
        """See Port."""
        for p in datagram:
            if p[0].id not in accept:
                break
        else:
            return datagram
        out = [p for p in datagram if p[0].id in accept]
        count.unknown += len(datagram) - len(out)
        return out

    def part(self, datagram: Handed, p: Packet) -> Handed:
        """See Port."""
        return (p,)

    def as_bytes(self, datagram: Handed) -> bytes:
        """See Port."""
        return b"".join(Sender(p[2], p[3]).pack(p[0], *p[1]) for p in datagram)

    def of_bytes(self, data: bytes) -> Handed:
        """See Port."""
        return tuple(split(data, SPECS, Counters()))


WIRE, DIRECT = Wire(), Direct()
