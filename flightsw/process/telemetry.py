"""The single telemetry tap: Snapshot -> datagrams, by the rate table of icd/rates.py and the reports of the mission.

Building never raises and sending never blocks: a message that cannot be encoded is counted in `failed`, a datagram the
system does not take in `ctx.dropped`. Every datagram begins with a packet that carries the sample time, so the ground
can stamp it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from flightsw.icd.codec_telemetry import ENCODERS, TIMED
from flightsw.icd.context import MODE_BASE, Context
from flightsw.icd.dialect import HOUSE, VALUES
from flightsw.icd.geo import Origin, WireMap
from flightsw.icd.rates import names_due, table
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.stamps import EPOCH_US, boot_ms
from flightsw.icd.texts import answer, text
from flightsw.icd.wire import BY_NAME, Counters, Sender, Spec
from flightsw.strict import ConfigError, near
from flightsw.types import Ack, Snapshot, Text, Timing

if TYPE_CHECKING:
    from flightsw.missions.base import Report

MAX_DATAGRAM = 1400  # [byte]
TIME_SIZE = 24  # [byte] of a SYSTEM_TIME packet, at most
OVERHEAD = 12  # [byte] of a packet around its payload
# figures of the wall clock, whose trailing zeros are not sent: what fits into a datagram must not depend on them, or a replay,
# which has other ones, would part the same packets otherwise
CLOCKED = frozenset(("LOOP_TIMING", "RATE_GROUP", "SYS_STATUS"))
_CLOCKED = {BY_NAME[n].id_bytes: OVERHEAD + BY_NAME[n].size for n in CLOCKED}
Maker = Callable[[], bytes]  # packs a packet when its turn comes
_SYSTEM_TIME = BY_NAME["SYSTEM_TIME"]
_NOT_SELECTABLE = VALUES["MAV_MODE_PROPERTY_NOT_USER_SELECTABLE"]
PHASES = HOUSE.words("WKF_PHASE")


def _size(packet: bytes) -> int:
    """Bytes of a packet, zeros not sent of the wall clock's counted."""
    return _CLOCKED.get(packet[7:10], len(packet))


class Telemetry:
    """Telemetry of one aircraft. `rates` may be changed at run time through `set_rate`."""

    def __init__(
        self,
        sysid: int,
        reports: Sequence[Report],
        relative: bool,
        origin: Origin,
        base_hz: int,
        count: Counters,
        overrides: dict[str, float] | None = None,
        *,
        phases: Sequence[int] = (),
        capacity_kg: float = 0.0,
        simulated: bool = True,
    ) -> None:
        """reports: messages only this mission sends; relative: whether it follows another aircraft; phases: of the mission
        (WKF_PHASE), none: all there are; capacity_kg: of the tanks; simulated: a plant makes the readings. Raises ConfigError for
        an override of a message it does not send."""
        self.base_hz = base_hz
        self.ctx = Context(
            Sender(sysid, COMP_AUTOPILOT), WireMap(origin), count, Timing(), period_us=1_000_000 // base_hz,
            modes=tuple((p, PHASES[p].upper()) for p in phases or PHASES), capacity_kg=capacity_kg, relative=relative,
            simulated=simulated,
        )  # fmt: skip
        self.own = {r.message: r for r in reports}
        entries = table([(r.message, r.rate_hz, r.offset) for r in reports], relative)
        self.offsets = {name: offset for name, (_, offset) in entries.items()}
        self.defaults = {name: rate for name, (rate, _) in entries.items()}
        for name in overrides or {}:
            if name not in self.defaults:
                known = ", ".join(self.defaults)
                raise ConfigError(
                    f"telemetry.rates_hz.{name}: unknown message; allowed: {known}{near(name, self.defaults)}"
                )
        self.defaults |= overrides or {}
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
            names = self._schedule[k] = names_due(self.rates, self.offsets, k, self.base_hz)
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
        send = self.ctx.send
        makers: list[Maker] = []
        lead = ""
        due = (*names, *self.once)
        for n in due:
            maker = self._reporter(n, snap) if n in self.own else partial(self._encode, n, snap)
            if maker is not None:
                makers.append(maker)
                lead = lead or (n if n in names else "")
        self.once.clear()
        if not (makers or texts or acks or answers):
            return []
        makers += [partial(text, send, t.severity, t.text) for t in texts]
        makers += [partial(answer, send, a) for a in acks]
        makers += answers
        timed = lead not in TIMED
        before = (send.seq, send.ident, self.failed)
        packets = self._pack(makers, snap.t_us, timed)
        whole = b"".join(packets)
        size = sum(map(_size, packets)) if answers or not CLOCKED.isdisjoint(due) else len(whole)
        if size <= MAX_DATAGRAM:
            return [whole]
        send.seq, send.ident, self.failed = before
        sizes = [_size(make()) for make in makers]
        send.seq, send.ident, self.failed = before
        out, at = [], 0
        while at < len(makers):  # the same again in parts, each with a time in front
            end, size = at + 1, TIME_SIZE + sizes[at]
            while end < len(makers) and size + sizes[end] <= MAX_DATAGRAM:
                size += sizes[end]
                end += 1
            out.append(b"".join(self._pack(makers[at:end], snap.t_us, timed or at > 0)))
            at = end
        return out

    def _pack(self, makers: Sequence[Maker], t_us: int, timed: bool) -> list[bytes]:
        """Packets of one datagram; `timed`: a time goes first, as also where what should lead could not be encoded."""
        packets = [self.time(t_us)] if timed else []
        for make in makers:
            packet = make()
            if not packet and not packets:
                packet = self.time(t_us)
            packets.append(packet)
        return packets

    def time(self, t_us: int) -> bytes:
        """SYSTEM_TIME packet of sample time `t_us` [us]."""
        return self.ctx.send.pack(_SYSTEM_TIME, EPOCH_US + t_us, boot_ms(t_us))

    def mode(self, k: int) -> bytes:
        """AVAILABLE_MODES packet of the mode at place k, from 1."""
        phase, name = self.ctx.modes[k - 1]
        return self.ctx.send.named(
            "AVAILABLE_MODES", number_modes=len(self.ctx.modes), mode_index=k, custom_mode=MODE_BASE + phase,
            properties=_NOT_SELECTABLE, mode_name=name,
        )  # fmt: skip

    def _reporter(self, name: str, snap: Snapshot) -> Maker | None:
        """What packs a message of the mission; None: the mission has none now."""
        own = self.own[name]
        try:
            rows = list(own.packets(snap.reports.get(own.kind)))
        except (ValueError, OverflowError, TypeError):
            self.failed += 1
            return None
        return partial(self._pack_rows, BY_NAME[name], rows) if rows else None

    def _pack_rows(self, spec: Spec, rows: Sequence[tuple[float | int | bytes, ...]]) -> bytes:
        try:
            return b"".join([self.ctx.send.pack(spec, *row) for row in rows])
        except (ValueError, OverflowError, TypeError, struct.error):
            self.failed += 1
            return b""

    def _encode(self, name: str, snap: Snapshot) -> bytes:
        """A message, empty if there is none or it cannot be encoded."""
        try:
            return ENCODERS[name](snap, self.ctx)
        except (ValueError, OverflowError, TypeError, struct.error):  # a non-finite value where the wire has an integer
            self.failed += 1
            return b""
