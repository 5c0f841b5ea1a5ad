"""The single telemetry tap: Snapshot -> datagrams, by the rate table of icd/rates.py.

Building never raises and sending never blocks: a message that cannot be encoded is counted in `failed`, a datagram the
system does not take in `ctx.dropped`. Every datagram begins with a packet that carries the sample time, so the ground
can stamp it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import partial

from flightsw.icd.codec_telemetry import ENCODERS, OPTIONAL, TIMED, Context
from flightsw.icd.geo import Origin, WireMap
from flightsw.icd.rates import names_due, rates_for
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.stamps import boot_ms
from flightsw.icd.texts import answer, text
from flightsw.icd.wire import BY_NAME, Counters, Sender
from flightsw.types import Ack, Snapshot, Text, Timing

MAX_DATAGRAM = 1400  # [byte]
TIME_SIZE = 24  # [byte] of a SYSTEM_TIME packet, at most
Maker = Callable[[], bytes]  # packs a packet when its turn comes
_SYSTEM_TIME = BY_NAME["SYSTEM_TIME"]


class Telemetry:
    """Telemetry of one aircraft. `rates` may be changed at run time through `set_rate`."""

    def __init__(
        self,
        sysid: int,
        mission: str,
        origin: Origin,
        base_hz: int,
        count: Counters,
        overrides: dict[str, float] | None = None,
    ) -> None:
        self.base_hz = base_hz
        self.ctx = Context(
            Sender(sysid, COMP_AUTOPILOT), WireMap(origin), count, Timing(), period_us=1_000_000 // base_hz
        )
        self.defaults = rates_for(mission, overrides)
        self.rates = dict(self.defaults)
        self._cycle = 10 * base_hz  # [tick] after which the table repeats
        self._schedule: list[tuple[str, ...] | None] = [None] * self._cycle  # worked out when a tick first comes
        self.failed = 0
        self.once: dict[str, None] = {}  # messages asked for by command, each once

    def set_rate(self, name: str, rate_hz: float | None) -> None:
        """Change the rate [Hz] of one message; 0 = off, None = default."""
        self.rates[name] = self.defaults[name] if rate_hz is None else rate_hz
        self._schedule = [None] * self._cycle

    def names(self, tick: int) -> tuple[str, ...]:
        """Scheduled messages of `tick`."""
        k = tick % self._cycle
        names = self._schedule[k]
        if names is None:
            names = self._schedule[k] = names_due(self.rates, k, self.base_hz)
        return names

    def datagrams(
        self,
        snap: Snapshot,
        tick: int,
        texts: Sequence[Text] = (),
        acks: Sequence[Ack] = (),
        answers: Sequence[Maker] = (),
    ) -> list[bytes]:
        """Datagrams of this tick, possibly none: scheduled messages, then texts, acks and answers, in order of their sequence
        numbers.
        """
        names = self.names(tick)
        if names and not OPTIONAL.keys().isdisjoint(names):
            names = tuple(n for n in names if n not in OPTIONAL or OPTIONAL[n](snap))
        if not (names or texts or acks or answers or self.once):
            return []
        send = self.ctx.send
        makers: list[Maker] = [partial(self._encode, n, snap) for n in (*names, *self.once)]
        self.once.clear()
        makers += [partial(text, send, t.severity, t.text) for t in texts]
        makers += [partial(answer, send, a) for a in acks]
        makers += answers
        timed = not names or names[0] not in TIMED
        before = (send.seq, send.ident, self.failed)
        whole = self._pack(makers, snap.t_us, timed)
        if len(whole) <= MAX_DATAGRAM:
            return [whole]
        send.seq, send.ident, self.failed = before
        sizes = [len(make()) for make in makers]
        send.seq, send.ident, self.failed = before
        out, at = [], 0
        while at < len(makers):  # the same again in parts, each with a time in front
            end, size = at + 1, TIME_SIZE + sizes[at]
            while end < len(makers) and size + sizes[end] <= MAX_DATAGRAM:
                size += sizes[end]
                end += 1
            out.append(self._pack(makers[at:end], snap.t_us, timed or at > 0))
            at = end
        return out

    def _pack(self, makers: Sequence[Maker], t_us: int, timed: bool) -> bytes:
        """One datagram; `timed`: a time goes first, as also where what should lead could not be encoded."""
        packets = [self.time(t_us)] if timed else []
        for make in makers:
            packet = make()
            if not packet and not packets:
                packet = self.time(t_us)
            packets.append(packet)
        return b"".join(packets)

    def time(self, t_us: int) -> bytes:
        """SYSTEM_TIME packet of sample time `t_us` [us]."""
        return self.ctx.send.pack(_SYSTEM_TIME, 0, boot_ms(t_us))

    def _encode(self, name: str, snap: Snapshot) -> bytes:
        """A message, empty if there is none or it cannot be encoded."""
        if name in OPTIONAL and not OPTIONAL[name](snap):  # asked for by command
            return b""
        try:
            return ENCODERS[name](snap, self.ctx)
        except (ValueError, OverflowError, TypeError, struct.error):  # a non-finite value where the wire has an integer
            self.failed += 1
            return b""
