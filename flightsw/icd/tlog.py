"""`.tlog` files: 8-byte big-endian microseconds and the raw packet, over and over.

By convention of the format the low two bits of the stamp are a link number. In lockstep the stamp is sample time plus
EPOCH_US, so identical runs give identical files. Every sample time must be a multiple of 4 us.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

EPOCH_US = 1_700_000_000_000_000  # [us] stamp of sample time 0; a multiple of 4

# link numbers of link_<name>.tlog
LINK_IN = 0  # plant to flightsw
LINK_OUT = 1  # reply to the plant
GROUND_IN = 2  # ground to flightsw
GROUND_OUT = 3  # telemetry and answers

_OVERHEAD = {0xFD: 12, 0xFE: 8}  # MAVLink 2 and 1: header and CRC [byte]
_FLUSH_BYTES = 1 << 15
_FLUSH_US = 1_000_000  # [us] of log time: a process killed outright loses no more


class TlogError(OSError):
    """A log cannot be written or is not a log. The text names the file and the reason."""


class TlogWriter:
    """Buffered writer of one `.tlog`, handed to the operating system every 32 kB and every second of log time. Raises TlogError
    naming the file when folder or disk refuse, or when the file has been deleted.
    """

    def __init__(self, path: str | Path, epoch_us: int = EPOCH_US) -> None:
        self.path = Path(path)
        self._epoch = epoch_us
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
        if len(buf) >= _FLUSH_BYTES or not 0 <= t_us - self._flushed_us < _FLUSH_US:
            self._flushed_us = t_us
            self.flush()

    def write_datagram(self, t_us: int, datagram: bytes, link: int = 0) -> None:
        """Append every packet of a datagram of sound MAVLink 2 packets, all under one stamp."""
        stamp = (((self._epoch + t_us) & ~3) | link).to_bytes(8, "big")
        buf = self._buffer
        at, end = 0, len(datagram)
        while at < end:
            stop = at + 12 + datagram[at + 1] + (13 if datagram[at + 2] & 1 else 0)
            buf += stamp
            buf += datagram[at:stop]
            at = stop
        if len(buf) >= _FLUSH_BYTES or not 0 <= t_us - self._flushed_us < _FLUSH_US:
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


def read(path: str | Path, epoch_us: int = EPOCH_US) -> Iterator[tuple[int, int, bytes]]:
    """Records (time [us, epoch taken off], link number, packet) in file order; a cut-off last record is left out.

    Raises TlogError naming file and offset if the file cannot be read or holds something else than packets.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as e:
        raise TlogError(f"{path}: cannot be read: {e.strerror}") from None
    at, end = 0, len(data)
    while at + 10 <= end:
        magic = data[at + 8]
        if magic not in _OVERHEAD:
            raise TlogError(f"{path}: byte {at + 8} is 0x{magic:02x}, no MAVLink packet starts here")
        stop = at + 8 + _OVERHEAD[magic] + data[at + 9]
        if magic == 0xFD and at + 10 < end and data[at + 10] & 1:
            stop += 13
        if stop > end:
            return
        stamp = int.from_bytes(data[at : at + 8], "big")
        yield (stamp & ~3) - epoch_us, stamp & 3, data[at + 8 : stop]
        at = stop
