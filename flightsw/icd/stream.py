"""Datagrams over a line that only knows bytes (serial, TCP): the same MAVLink packets, and LINE_FRAME behind each datagram.

LINE_FRAME carries the length of the datagram before it, so the receiver knows where one ends and whether all of it came. What is
no sound packet is skipped to the next that is, and counted in bytes.
"""

from __future__ import annotations

from flightsw.icd.framing import HEAD, V2, check, next_sound
from flightsw.icd.wire import BY_NAME, Sender, message_id

FRAME = BY_NAME["LINE_FRAME"]
LONGEST = 65535  # [byte] of a datagram


class Seal:
    """Puts LINE_FRAME behind each datagram of one sender."""

    def __init__(self) -> None:
        self._sender: Sender | None = None

    def close(self, datagram: bytes) -> bytes:
        """The datagram, of sound packets, and its LINE_FRAME, which is of the same system and component."""
        if self._sender is None:
            self._sender = Sender(datagram[5], datagram[6])
        return datagram + self._sender.pack(FRAME, len(datagram))


class Assembler:
    """Bytes in, datagrams out. `whole`: only those of which nothing is missing (in lockstep the tick is repeated); else what
    came of a torn one too. `noise` counts bytes that belong to no sound packet, `torn` the datagrams something was missing of.
    """

    def __init__(self, whole: bool) -> None:
        self._whole = whole
        self._rest = b""
        self._packets: list[bytes] = []
        self._size = 0
        self.noise = self.torn = 0

    def reset(self) -> None:
        """Forget what has begun: the line is another one now."""
        self.noise += len(self._rest)
        self._rest = b""
        self._clear()

    def feed(self, data: bytes) -> list[bytes]:
        """Datagrams that `data` completes, in order. Never raises."""
        buf, at, out = self._rest + data, 0, []
        while True:
            start = buf.find(V2, at)
            if start < 0:
                self.noise += len(buf) - at
                at = len(buf)
                break
            self.noise += start - at
            at = start
            wrong, size = check(buf, at)
            if wrong == "truncated":
                # a magic byte of noise may promise more bytes than will ever come: look for a sound packet behind it
                inner = next_sound(buf, at + 1)
                if inner == len(buf):
                    break
                self.noise += inner - at
                at = inner
                continue
            if wrong:
                self.noise += 1
                at += 1
                continue
            packet = buf[at : at + size]
            at += size
            if message_id(packet) == FRAME.id:
                if datagram := self._close(int.from_bytes(packet[HEAD[V2] : HEAD[V2] + packet[1]], "little")):
                    out.append(datagram)
                continue
            self._packets.append(packet)
            self._size += len(packet)
            if self._size > LONGEST:
                self.torn += 1
                self._clear()
        self._rest = buf[at:]
        return out

    def _clear(self) -> None:
        self._packets, self._size = [], 0

    def _close(self, size: int) -> bytes:
        """What a LINE_FRAME for `size` bytes closes; b"": nothing that may be used."""
        packets, have = self._packets, self._size
        self._clear()
        if have != size:
            self.torn += 1
            if not self._whole:
                return b"".join(packets)
        while have > size:  # the frame of the datagram before was lost: this one is behind it
            have -= len(packets.pop(0))
        return b"".join(packets) if have == size else b""
