"""The single telemetry tap: Snapshot -> datagrams, by the rate table of icd/rates.py.

Building never raises and sending never blocks: a message that cannot be encoded is counted in `failed`, a datagram the
system does not take in `ctx.dropped`. Every datagram begins with a packet that carries the sample time, so the ground
can stamp it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from flightsw.icd.codec_telemetry import ENCODERS, OPTIONAL, TIMED, Context
from flightsw.icd.geo import Origin, WireMap
from flightsw.icd.rates import names_due, rates_for
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.stamps import boot_ms
from flightsw.icd.texts import answer, text
from flightsw.icd.wire import BY_NAME, Counters, Sender
from flightsw.types import Ack, Snapshot, Text, Timing

MAX_DATAGRAM = 1400  # [byte]
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
        answers: Sequence[bytes] = (),
    ) -> list[bytes]:
        """Datagrams of this tick, possibly none: scheduled messages, then texts, acks and ready packets."""
        names = self.names(tick)
        if names and not OPTIONAL.keys().isdisjoint(names):
            names = tuple(n for n in names if n not in OPTIONAL or OPTIONAL[n](snap))
        once = self.once
        if not (names or texts or acks or answers or once):
            return []
        packets: list[bytes] = []
        if not names or names[0] not in TIMED:
            packets.append(self.time(snap.t_us))
        for name in names:
            self._encode(name, snap, packets)
            if not packets:  # the leading message could not be encoded
                packets.append(self.time(snap.t_us))
        if once:
            for name in once:
                self._encode(name, snap, packets)
            once.clear()
        send = self.ctx.send
        packets += [text(send, t.severity, t.text) for t in texts]
        packets += [answer(send, a) for a in acks]
        packets.extend(answers)
        if sum(map(len, packets)) <= MAX_DATAGRAM:
            return [b"".join(packets)]
        return self._cut(packets, snap.t_us)

    def time(self, t_us: int) -> bytes:
        """SYSTEM_TIME packet of sample time `t_us` [us]."""
        return self.ctx.send.pack(_SYSTEM_TIME, 0, boot_ms(t_us))

    def _encode(self, name: str, snap: Snapshot, out: list[bytes]) -> None:
        if name in OPTIONAL and not OPTIONAL[name](snap):  # asked for by command
            return
        try:
            out.append(ENCODERS[name](snap, self.ctx))
        except (ValueError, OverflowError, TypeError, struct.error):  # a non-finite value where the wire has an integer
            self.failed += 1

    def _cut(self, packets: list[bytes], t_us: int) -> list[bytes]:
        """Several datagrams of at most MAX_DATAGRAM bytes, each led by a time."""
        out: list[bytes] = []
        part: list[bytes] = []
        size = 0
        for p in packets:
            if part and size + len(p) > MAX_DATAGRAM:
                out.append(b"".join(part))
                part = [self.time(t_us)]
                size = len(part[0])
            part.append(p)
            size += len(p)
        out.append(b"".join(part))
        return out
