"""MAVLink 2 message signing (mavlink.io, message signing): who has the key may speak, and nothing is heard twice.

A signed packet has flag 1 of incompat_flags and behind its CRC 13 bytes: link id, 48-bit time in 10 us since 2015, and the first
six bytes of SHA-256 over key, packet, link id and time. A stream is one (link id, system, component); its times only rise. The
first packet of a stream may be a minute behind the receiver's time, which is the later of its clock and of the latest it heard.

Signing is done at the sockets: what lies behind them, and every log, has the same packets as without a key.
"""

from __future__ import annotations

import ipaddress
import os
import stat
from collections.abc import Callable
from dataclasses import dataclass, fields
from hashlib import sha256
from hmac import compare_digest
from pathlib import Path

from flightsw.icd.framing import CRC, EXTRA, HEAD, SIGNATURE, SIGNED, V2, crc, modern, next_sound
from flightsw.icd.framing import check as sound

KEY = 32  # [byte]
SINCE_S = 1_420_070_400  # [s] unix time of 2015-01-01 00:00 UTC
PER_S = 100_000  # units of 10 us
WINDOW = 60 * PER_S  # a new stream may be so far behind
STREAMS_MAX = 256  # that are remembered; only who has the key makes one
PLANT, TELEMETRY, ORDERS, STATION = range(4)  # link ids
_AT = HEAD[V2]


class SigningError(ValueError):
    """A key cannot be used, or an address needs one. The text names the file or the address and says what is allowed."""


def read_key(path: str | Path) -> bytes:
    """The key of a file: 64 hexadecimal digits, and nobody but its owner may read it. Raises SigningError naming the file."""
    path = Path(path)
    try:
        mode, text = path.stat().st_mode, path.read_bytes().decode("ascii", "replace").strip()
    except OSError as e:
        raise SigningError(f"signing key {path}: cannot be read: {e.strerror}") from None
    if stat.S_IMODE(mode) & 0o077:
        raise SigningError(f"signing key {path}: mode {stat.S_IMODE(mode):o}: others may read it; allowed: 600")
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != KEY:
        raise SigningError(f"signing key {path}: expected {2 * KEY} hexadecimal digits")
    return key


def write_key(path: str | Path) -> None:
    """A new key in a file of its own, for its owner only. Raises OSError; an existing file is left alone."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as f:
        f.write(os.urandom(KEY).hex() + "\n")


def units(unix_s: float) -> int:
    """Unix time [s] in the units of a signature."""
    return int((unix_s - SINCE_S) * PER_S)


@dataclass(slots=True)
class Refused:
    """Packets that were not let in, by reason."""

    unsigned: int = 0
    wrong: int = 0  # not by this key, or changed on the way
    replayed: int = 0  # not newer than the last of its stream
    stale: int = 0  # a new stream more than a minute behind

    @property
    def total(self) -> int:
        """All of them."""
        return self.unsigned + self.wrong + self.replayed + self.stale

    def counts(self) -> tuple[int, ...]:
        """In the order of the fields."""
        return tuple(getattr(self, f.name) for f in fields(self))


REASONS = tuple(f.name for f in fields(Refused))


class Signing:
    """Signs what goes out of one socket and judges what comes in. `clock` gives unix time [s]."""

    def __init__(self, key: bytes, link: int, clock: Callable[[], float]) -> None:
        self._key, self._link, self._clock = key, bytes((link,)), clock
        self.time = units(clock())  # the latest sent or heard
        self.refused = Refused()
        self._streams: dict[tuple[int, int, int], int] = {}

    def sign(self, datagram: bytes) -> bytes:
        """The same packets, sound and of the dialect, signed. One that is signed already stays as it is."""
        out, at = [], 0
        self.time = max(self.time, units(self._clock()))
        while at < len(datagram):
            stop = at + _AT + datagram[at + 1] + CRC
            if datagram[at + 2] & SIGNED:
                stop += SIGNATURE
                out.append(datagram[at:stop])
            else:
                self.time += 1
                packet = _flagged(datagram[at:stop], SIGNED)
                tail = self._link + self.time.to_bytes(6, "little")
                out.append(packet + tail + self._signature(packet + tail))
            at = stop
        return b"".join(out)

    def check(self, datagram: bytes) -> bytes:
        """Those packets of a datagram that may be believed, as unsigned ones; the others are counted, bytes that are no packet
        too (as unsigned, a run of them once)."""
        out, at, end = [], 0, len(datagram)
        self.time = max(self.time, units(self._clock()))
        while at < end:
            wrong, size = sound(datagram, at)
            if wrong:
                self.refused.unsigned += 1
                at = next_sound(datagram, at + 1)
                continue
            packet = datagram[at : at + size]
            at += size
            if packet[0] != V2 or not packet[2] & SIGNED:
                self.refused.unsigned += 1
            elif self._believe(packet):
                out.append(_flagged(packet[:-SIGNATURE], 0))
        return b"".join(out)

    def _signature(self, text: bytes) -> bytes:
        return sha256(self._key + text).digest()[:6]

    def _believe(self, packet: bytes) -> bool:
        if not compare_digest(self._signature(packet[:-6]), packet[-6:]):
            self.refused.wrong += 1
            return False
        stream, sent = (packet[-SIGNATURE], packet[5], packet[6]), int.from_bytes(packet[-12:-6], "little")
        last = self._streams.get(stream)
        if last is not None and sent <= last:
            self.refused.replayed += 1
            return False
        if last is None and sent + WINDOW < self.time:
            self.refused.stale += 1
            return False
        if last is None and len(self._streams) >= STREAMS_MAX:
            del self._streams[min(self._streams, key=self._streams.__getitem__)]
        self._streams[stream] = sent
        self.time = max(self.time, sent)
        return True


def _flagged(packet: bytes, flag: int) -> bytes:
    """An unsigned-length packet with its signing flag set or cleared, its CRC made anew."""
    ident = packet[7] | packet[8] << 8 | packet[9] << 16
    body = bytes((packet[1], packet[2] & ~SIGNED | flag)) + packet[3:-CRC]
    return bytes((V2,)) + body + crc(body + EXTRA[ident]).to_bytes(2, "little")


@dataclass(frozen=True)
class Security:
    """What a program was told about its links: the key and whose clock [s, unix], or that they may be open to everybody."""

    key: bytes | None = None
    clock: Callable[[], float] = float
    unsigned: bool = False

    def link(self, ident: int) -> Signing | None:
        """The signing of one socket; None without a key."""
        return None if self.key is None else Signing(self.key, ident, self.clock)

    def admit(self, host: str) -> None:
        """Raise SigningError for an address that others can reach, without a key and without `unsigned`."""
        try:
            local = ipaddress.ip_address(host).is_loopback
        except ValueError:
            local = host == "localhost"
        if not local and self.key is None and not self.unsigned:
            raise SigningError(
                f"address {host}: others can reach it; allowed: 127.0.0.1, or a key (--signing-key), or --unsigned"
            )


OPEN = Security()


def security(key_file: str | Path | None, unsigned: bool, clock: Callable[[], float]) -> Security:
    """Of the options --signing-key and --unsigned; clock: unix time [s]. Raises SigningError."""
    if key_file is not None and unsigned:
        raise SigningError("--signing-key and --unsigned exclude each other")
    return Security(None if key_file is None else read_key(key_file), clock, unsigned)


def heard(datagram: bytes, signing: Signing | None) -> bytes:
    """What may be believed of a datagram, in MAVLink 2 framing; without a key all of it."""
    return modern(datagram) if signing is None else signing.check(datagram)
