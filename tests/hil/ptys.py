"""A serial line on one machine: two pseudo-terminals and a pump between them that can be slow, noisy and cut."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
import tty
from collections.abc import Callable
from types import TracebackType

BITS = 10  # a byte on the line: start, eight, stop
Bend = Callable[[int, bytes], bytes]  # direction 0 (a to b) or 1, what was sent -> what arrives


def straight(_: int, data: bytes) -> bytes:
    """A clean line."""
    return data


def at_once() -> None:
    """This thread before all others where the system allows it: a wire waits for no processor."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(30))


class PtyLine:
    """Devices `a` and `b`. `bend` sees every piece that passes; `baud` [bit/s] 0: at once. `cut` True: nothing passes. `first`:
    the pump runs as `at_once`."""

    def __init__(self, bend: Bend = straight, baud: int = 0, first: bool = False) -> None:
        self._masters, self._slaves = [], []
        for _ in range(2):
            master, slave = os.openpty()
            tty.setraw(slave)
            os.set_blocking(master, False)
            self._masters.append(master)
            self._slaves.append(slave)  # kept open: a master whose slave nobody has open gives errors
        self.a, self.b = (os.ttyname(s) for s in self._slaves)
        self.cut = False
        self.passed = [0, 0]  # [byte]
        self._bend, self._baud = bend, baud
        self._ends = False
        self._first = first
        self._thread = threading.Thread(target=self._pump, daemon=True)

    def __enter__(self) -> PtyLine:
        self._thread.start()
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self._ends = True
        self._thread.join()
        for fd in (*self._masters, *self._slaves):
            os.close(fd)

    def _pump(self) -> None:
        if self._first:
            at_once()
        free = [0.0, 0.0]  # when each direction has sent what it was given
        waiting: list[list[tuple[float, bytes]]] = [[], []]
        while not self._ends:
            now = time.monotonic()
            next_s = min((w[0][0] - now for w in waiting if w), default=0.05)
            # full: read no more until what waits has gone, as a device would
            watched = [m for m, w in zip(self._masters, waiting, strict=True) if sum(len(x) for _, x in w) < 4096]
            for master in select.select(watched, [], [], min(max(next_s, 0.0), 0.05))[0]:
                way = self._masters.index(master)
                try:
                    data = os.read(master, 256 if self._baud else 4096)
                except OSError:
                    continue
                data = b"" if self.cut else self._bend(way, data)
                if data:
                    due = max(free[way], time.monotonic()) + (len(data) * BITS / self._baud if self._baud else 0.0)
                    free[way] = due
                    waiting[way].append((due, data))
            now = time.monotonic()
            for way, queue in enumerate(waiting):
                while queue and queue[0][0] <= now:
                    due, data = queue.pop(0)
                    n = 0
                    with contextlib.suppress(BlockingIOError):
                        n = os.write(self._masters[1 - way], data)
                    self.passed[way] += n
                    if n < len(data):  # nobody reads there
                        queue.insert(0, (due, data[n:]))
                        time.sleep(1e-3)
                        break
