"""A run that goes on: the last stretch of every log, as the tables a whole log gives.

Packets come in any order and number; what is older than `KEEP_US` is forgotten, so the memory held does not grow with the run.
"""

from __future__ import annotations

import os
from collections import defaultdict
from pathlib import Path

import numpy as np

from flightsw.icd.scan import scan
from flightsw.icd.signing import Signing
from ground.columns import Columns, Table
from ground.columns import of as columns_of
from ground.link.merge import SequenceGaps
from ground.link.packets import DTYPES, HEADER, NAMES, packet_id, packet_time_us, split

KEEP_US = 90_000_000  # [us] of a run's time
ROWS = 20_000  # of one message: a sender gone mad is forgotten sooner
READ_BYTES = 4 << 20  # of a log taken at a time
BACK_US = 5_000_000  # [us] a time that far behind is of another run
Key = tuple[int, str]


class Stretch:
    """The last part of one log: tables that rows are added to."""

    def __init__(self) -> None:
        self.tables: dict[Key, Table] = {}
        self.dropped: dict[int, int] = {}

    def add(self, new: Columns) -> None:
        """Rows of tables, in time order behind those there are."""
        for sysid, n in new.dropped.items():
            self.dropped[sysid] = self.dropped.get(sysid, 0) + n
        for key, table in new.tables.items():
            old = self.tables.get(key)
            if old is not None and len(old):
                table = Table(*(np.concatenate([getattr(old, k), getattr(table, k)]) for k in ("t_us", "link", "rows")))
                if (np.diff(table.t_us) < 0).any():  # packets that overtook each other
                    table = table.pick(np.argsort(table.t_us, kind="stable"))
            self.tables[key] = table

    def forget(self, before_us: int) -> None:
        """Leave out rows before a time [us], and beyond `ROWS`; the last of a table stays."""
        for key, table in self.tables.items():
            first = max(min(int(np.searchsorted(table.t_us, before_us)), len(table) - 1), len(table) - ROWS, 0)
            if first:
                self.tables[key] = table.pick(np.arange(first, len(table)))

    def since(self, from_us: int, to_us: int | None = None) -> Columns:
        """Tables of the rows from a time on [us], up to another."""
        out = {}
        for key, t in self.tables.items():
            a = int(np.searchsorted(t.t_us, from_us))
            b = len(t) if to_us is None else int(np.searchsorted(t.t_us, to_us, side="right"))
            if b > a:
                out[key] = Table(t.t_us[a:b], t.link[a:b], t.rows[a:b])
        return Columns(out, dropped=dict(self.dropped))

    def newest(self, message: str | None = None) -> dict[int, int]:
        """System id -> newest time [us] of its rows, of one message or of all."""
        out: dict[int, int] = {}
        for (sysid, name), t in self.tables.items():
            if len(t) and message in (None, name):
                out[sysid] = max(out.get(sysid, 0), int(t.t_us[-1]))
        return out


class Telemetry:
    """Datagrams of all aircraft as a stretch. What has no time of its own gets that of its datagram or its sender's last."""

    def __init__(self, signing: Signing | None = None) -> None:
        self.signing = signing
        self.stretch = Stretch()
        self.gaps = SequenceGaps()
        self.junk = self.packets = self.skipped = 0
        self.last: dict[int, int] = {}  # sysid -> newest time [us]
        self._waiting: dict[tuple[int, int], list[tuple[int, bytes]]] = defaultdict(list)
        self._back: dict[int, int] = {}

    def take(self, datagram: bytes) -> None:
        """Account for one datagram; rubbish is counted, and with a key what is not signed by it is refused."""
        if self.signing is not None:
            datagram = self.signing.check(datagram)
        sound, when = [], None
        for packet, fault in split(datagram):
            if fault:
                self.junk += 1
                continue
            sound.append(packet)
            when = packet_time_us(packet) if when is None else when
        for packet in sound:
            sysid, mid = packet[5], packet_id(packet)
            self.gaps.see(sysid, packet[6], packet[4])
            stamp = self.last.get(sysid, 0) if when is None else when
            if len(self._waiting[sysid, mid]) >= ROWS:
                self.skipped += 1
                continue
            self._waiting[sysid, mid].append((stamp, packet))
            self.packets += 1
            if NAMES[mid] != "SYSTEM_TIME":
                self._back[sysid] = self._back.get(sysid, 0) + 1 if stamp < self.last.get(sysid, 0) - BACK_US else 0
            self.last[sysid] = max(self.last.get(sysid, 0), stamp)

    @property
    def restarted(self) -> bool:
        """Whether an aircraft's time has jumped back and stays there: it flies another run."""
        return any(n > 3 for n in self._back.values())

    def settle(self) -> None:
        """Decode what has come in."""
        new = {}
        for (sysid, mid), packets in self._waiting.items():
            dtype = DTYPES[mid]
            size = dtype.itemsize
            raw = b"".join(p[HEADER : HEADER + p[1]][:size].ljust(size, b"\0") for _, p in packets)
            stamps = np.array([t for t, _ in packets], dtype=np.int64)
            order = np.argsort(stamps, kind="stable")
            rows = np.frombuffer(raw, dtype=dtype)
            new[sysid, NAMES[mid]] = Table(stamps[order], np.zeros(len(rows), dtype=np.int64), rows[order])
        self._waiting.clear()
        self.stretch.add(Columns(new))
        self.stretch.dropped = self.gaps.dropped


class Tail:
    """A log that is being written, read as it grows. `skipped` [byte]: left out because reading fell behind."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.stretch = Stretch()
        self.skipped = self.read = 0
        self._at = 0
        self._rest = b""

    def begin_late(self) -> None:
        """Take what there is already as seen, but for the last of it."""
        try:
            self._at = max(0, self.path.stat().st_size - READ_BYTES // 4)
        except OSError:
            self._at = 0

    def take(self) -> int:
        """Decode what has been written since; how many bytes that were. A log that is not there yet is none."""
        try:
            with self.path.open("rb") as f:
                size = os.fstat(f.fileno()).st_size
                if size < self._at:  # another log of that name
                    self._at, self._rest = 0, b""
                if size - self._at > READ_BYTES:
                    self.skipped += size - self._at - READ_BYTES
                    self._at, self._rest = size - READ_BYTES, b""
                f.seek(self._at)
                new = f.read(READ_BYTES)
        except OSError:
            return 0
        if not new:
            return 0
        self._at += len(new)
        self.read += len(new)
        log = scan(self._rest + new)
        self._rest = log.raw[len(log.raw) - log.cut_bytes :] if log.cut_bytes else b""
        self.stretch.add(columns_of(log))
        return len(new)
