"""Simulated radio between aircraft: what one transmits the others hear later, or not at all."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Generic, TypeVar

from sim_plant.rng import generator

P = TypeVar("P")
STATES, FIXES = range(2)  # kinds of transmission: each has losses of its own, and none reshuffles those of another
NAMES = ("radio", "radio.fix")


class Radio(Generic[P]):
    """Broadcast channel for packets, whatever they are. Latency in whole ticks (rounded up), loss independent per transmission
    and listener.

    A transmission = all packets of one kind in one reply. Loss is drawn for each one also while a fault silences the sender, so
    that a fault does not reshuffle the rest of the run.
    """

    def __init__(self, names: list[str], seed: int, latency_ms: float, loss: float, rate_hz: int) -> None:
        self._n = len(names)
        # never sooner than the next tick: the reply to tick k leaves after that tick's datagrams were sent
        self._ticks = max(1, -(-round(latency_ms * 1000.0) * rate_hz // 1_000_000))
        self._loss = loss
        self._rng = [[generator(seed, f"{name}.{kind}") for kind in NAMES] for name in names]
        self._queue: list[deque[tuple[int, Sequence[P]]]] = [deque() for _ in names]
        self.sent = 0
        self.lost = 0

    def send(self, i: int, k: int, packets: Sequence[P], up: bool = True, kind: int = STATES) -> None:
        """Aircraft i transmits packets of a kind at tick k; `up` False: its transmitter is silent."""
        if not packets:
            return
        for j in range(self._n):
            if j == i:
                continue
            self.sent += 1
            lost = self._loss > 0.0 and self._rng[i][kind].random() < self._loss
            if lost or not up:
                self.lost += 1
            else:
                self._queue[j].append((k + self._ticks, packets))

    def receive(self, j: int, k: int, up: bool = True) -> list[P]:
        """Packets that reach aircraft j at tick k, in order of transmission; `up` False: its receiver is deaf to them."""
        q = self._queue[j]
        out: list[P] = []
        while q and q[0][0] <= k:
            packets = q.popleft()[1]
            if up:
                out += packets
            else:
                self.lost += 1
        return out
