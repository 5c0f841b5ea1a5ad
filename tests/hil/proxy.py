"""A small UDP proxy between plant and board: delay, jitter, loss, reordering (of what jitter lets overtake), cut."""

from __future__ import annotations

import heapq
import random
import select
import socket
import threading
import time
from types import TracebackType

from tests.hil.ptys import at_once

Address = tuple[str, int]


class Proxy:
    """Whoever sends to `port` reaches `to`, and is answered from there. Delay uniform in `delay_s` +- `jitter_s` each way."""

    def __init__(
        self,
        to: Address,
        delay_s: float = 0.0,
        jitter_s: float = 0.0,
        loss: float = 0.0,
        listen: Address = ("127.0.0.1", 0),
        seed: int = 1,
        first: bool = False,
    ) -> None:
        self.cut = False
        self.lost = self.passed = 0
        self._to, self._delay_s, self._jitter_s, self._loss = to, delay_s, jitter_s, loss
        self._draw = random.Random(seed)
        self._near = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._near.bind(listen)
        self._far = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._far.bind(("", 0))
        self.port: int = self._near.getsockname()[1]
        self._asker: Address | None = None
        self._ends = False
        self._first = first
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Proxy:
        self._thread.start()
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self._ends = True
        self._thread.join()
        self._near.close()
        self._far.close()

    def _run(self) -> None:
        if self._first:
            at_once()
        waiting: list[tuple[float, int, socket.socket, bytes]] = []
        n = 0
        while not self._ends:
            left = waiting[0][0] - time.monotonic() if waiting else 0.05
            for s in select.select([self._near, self._far], [], [], min(max(left, 0.0), 0.05))[0]:
                try:
                    data, sender = s.recvfrom(65535)
                except OSError:  # the board's port is not open
                    continue
                if s is self._near:
                    self._asker = sender
                if self.cut or self._draw.random() < self._loss:
                    self.lost += 1
                    continue
                n += 1
                due = time.monotonic() + self._delay_s + self._draw.uniform(-self._jitter_s, self._jitter_s)
                heapq.heappush(waiting, (due, n, self._far if s is self._near else self._near, data))
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, out, data = heapq.heappop(waiting)
                to = self._to if out is self._far else self._asker
                if to is not None:
                    self.passed += 1
                    try:
                        out.sendto(data, to)
                    except OSError:
                        continue
