"""`.tlog` files: 8-byte big-endian microseconds and the raw packet, over and over.

By convention of the format the low two bits of the stamp are a link number. In lockstep the stamp is sample time plus
EPOCH_US, so identical runs give identical files. Every sample time must be a multiple of 4 us.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path

from flightsw.icd.damage import LogDamageWarning
from flightsw.icd.framing import as_v2
from flightsw.icd.scan import Records, scan
from flightsw.icd.stamps import EPOCH_US

# link numbers of link_<name>.tlog
LINK_IN = 0  # plant to flightsw
LINK_OUT = 1  # reply to the plant
GROUND_IN = 2  # ground to flightsw
GROUND_OUT = 3  # telemetry and answers

_FLUSH_BYTES = 1 << 15
FLUSH_US = 1_000_000  # [us] of log time: a process killed outright loses no more


class TlogError(OSError):
    """A log cannot be written or is not a log. The text names the file and the reason."""


class TlogWriter:
    """Buffered writer of one `.tlog`, handed to the operating system every 32 kB and every `flush_us` of log time. Raises
    TlogError naming the file when folder or disk refuse, or when the file has been deleted.
    """

    def __init__(self, path: str | Path, epoch_us: int = EPOCH_US, flush_us: int = FLUSH_US) -> None:
        self.path = Path(path)
        self._epoch = epoch_us
        self._within_us = flush_us
        self._buffer = bytearray()
        self._flushed_us = 0
        try:
            self._fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        except OSError as e:
            raise TlogError(f"{self.path}: cannot be created: {e.strerror}") from None

    def write(self, t_us: int, packet: bytes, link: int = 0) -> None:
        """Append one packet. `t_us` is the time before the epoch is added (sample time in lockstep)."""
        buf = self._buffer
        buf += (((self._epoch + t_us) & ~3) | link).to_bytes(8, "big")
        buf += packet
        if len(buf) >= _FLUSH_BYTES or not 0 <= t_us - self._flushed_us < self._within_us:
            self._flushed_us = t_us
            self.flush()

    def write_datagram(self, t_us: int, datagram: bytes, link: int = 0) -> None:
        """Append every packet of a datagram of sound MAVLink 2 packets, all under one stamp."""
        stamp = (((self._epoch + t_us) & ~3) | link).to_bytes(8, "big")
        buf = self._buffer
        at, end = 0, len(datagram)
        while at < end:
            stop = at + 12 + datagram[at + 1] + (13 if datagram[at + 2] & 1 else 0)
            buf += stamp + datagram[at:stop]
            at = stop
        if len(buf) >= _FLUSH_BYTES or not 0 <= t_us - self._flushed_us < self._within_us:
            self._flushed_us = t_us
            self.flush()

    def flush(self) -> None:
        """Hand everything to the operating system. Raises TlogError, for instance when the disk is full."""
        if self._buffer and not os.fstat(self._fd).st_nlink:
            raise TlogError(f"{self.path}: cannot be written: the file has been deleted")
        view = memoryview(self._buffer)
        try:
            while view:
                view = view[os.write(self._fd, view) :]
        except OSError as e:
            raise TlogError(f"{self.path}: cannot be written: {e.strerror}") from None
        finally:
            rest = bytes(view)
            view.release()
            self._buffer = bytearray(rest)

    def close(self) -> None:
        """Flush and close; further calls do nothing."""
        if self._fd >= 0:
            try:
                self.flush()
            finally:
                os.close(self._fd)
                self._fd = -1


def records(path: str | Path) -> Records:
    """Every sound record of a log. What is left out is warned of (LogDamageWarning, naming the file). Raises TlogError naming
    the file if it cannot be read or is mostly junk."""
    try:
        found = scan(Path(path).read_bytes())
    except OSError as e:
        raise TlogError(f"{path}: cannot be read: {e.strerror}") from None
    if found.mostly_junk:
        raise TlogError(f"{path}: is no log: {found.junk_bytes} of {len(found.raw)} bytes belong to no sound packet")
    if found.damage:
        warnings.warn(f"{path}: {found.damage}", LogDamageWarning, stacklevel=2)
    return found


def read(path: str | Path, epoch_us: int = EPOCH_US) -> Iterator[tuple[int, int, bytes]]:
    """Records (time [us, epoch taken off], link number, packet in MAVLink 2 framing) in file order; damage is left out.

    Raises TlogError as `records`.
    """
    log = records(path)
    raw, old = log.raw, log.v1.tolist()
    for k, (stamp, at, size) in enumerate(zip(log.stamp.tolist(), log.head.tolist(), log.size.tolist(), strict=True)):
        packet = raw[at : at + size]
        if old[k]:
            if not log.known[k]:
                continue  # its CRC cannot be made anew
            packet = as_v2(packet)
        yield (stamp & ~3) - epoch_us, stamp & 3, packet
