"""TIMESYNC on the plant link: one end asks with its own time, the other puts its own beside it.

With round trip r the answerer's clock is ahead by tc1 - (ts1 + now) / 2, give or take r / 2 (the way there and back need not be
equal). What was measured over a short round trip counts most: an exchange of more than twice the shortest is left out, and the
shortest grows by DRIFT so that a clock that drifts is followed.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from flightsw.icd.wire import BY_NAME, Counters, Sender, split

SPEC, STATUS = BY_NAME["TIMESYNC"], BY_NAME["LINE_STATUS"]
IDENT = SPEC.id.to_bytes(3, "little")
ACCEPT = {s.id: s for s in (SPEC, STATUS)}
ASK_S = 0.5  # [s] between two questions
GAIN = 0.1  # of a new measurement, once there are as many as 1 / GAIN
DRIFT = 1e-4  # [s/s] two quartz clocks part at most so fast
U32 = 0xFFFFFFFF


@dataclass(frozen=True)
class LineStatus:
    """LINE_STATUS: what the answerer has had of its line."""

    taken: int = 0
    passed_over: int = 0
    noise: int = 0
    torn: int = 0
    unsent: int = 0


def is_timesync(datagram: bytes) -> bool:
    """Whether a datagram is a question or answer about the time."""
    return datagram[7:10] == IDENT


def _read(datagram: bytes) -> dict[str, dict[str, Any]]:
    return {p[0].name: p[0].to_dict(p[1]) for p in split(datagram, ACCEPT, Counters())}


def answer(datagram: bytes, sender: Sender, now_ns: int, status: LineStatus) -> bytes:
    """The answer to a question, and how the line is; b"" if it is none."""
    asked = _read(datagram).get(SPEC.name)
    if asked is None or asked["tc1"]:
        return b""
    counts = {k: v & U32 for k, v in asdict(status).items()}
    return sender.named("TIMESYNC", tc1=now_ns, ts1=asked["ts1"]) + sender.named("LINE_STATUS", **counts)


class Offset:
    """The asker's end: how far the other clock is ahead of ours [s], and how well that is known [s]."""

    def __init__(self, sender: Sender) -> None:
        self._sender = sender
        self._next_s = 0.0
        self._shortest_s = float("inf")
        self._at_s = 0.0
        self.offset_s = 0.0
        self.uncertainty_s = float("inf")
        self.taken = 0
        self.status = LineStatus()  # as last told

    def ask(self, now_s: float) -> bytes:
        """A question if it is time for one, else b""."""
        if now_s < self._next_s:
            return b""
        self._next_s = now_s + ASK_S
        return self._sender.named("TIMESYNC", tc1=0, ts1=round(now_s * 1e9))

    def take(self, datagram: bytes, now_s: float) -> None:
        """An answer that has come at `now_s`."""
        read = _read(datagram)
        told = read.get(SPEC.name)
        if told is None or not told["tc1"]:
            return
        if STATUS.name in read:
            self.status = LineStatus(**read[STATUS.name])
        there_s, asked_s = told["tc1"] * 1e-9, told["ts1"] * 1e-9
        trip_s = now_s - asked_s
        if not 0.0 <= trip_s < 10.0:
            return
        self._shortest_s = min(trip_s, self._shortest_s + DRIFT * max(now_s - self._at_s, 0.0))
        self._at_s = now_s
        if trip_s > 2.0 * self._shortest_s:
            return
        self.taken += 1
        gain = max(1.0 / self.taken, GAIN)
        self.offset_s += gain * (there_s - 0.5 * (asked_s + now_s) - self.offset_s)
        self.uncertainty_s = 0.5 * self._shortest_s
