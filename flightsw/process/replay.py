"""Replay: feed the recorded inputs of link_<name>.tlog to a fresh Node and compare every packet it sends with the
recorded one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

from flightsw.icd.signing import REASONS
from flightsw.icd.tlog import GROUND_IN, GROUND_OUT, LINK_IN, LINK_OUT, read
from flightsw.icd.wire import BY_NAME, SPECS, Counters, Packet, split
from flightsw.process.node import Node

_SENSOR, _TICK, _RAW, _UNREAD, _REFUSED = (BY_NAME[n] for n in ("HIL_SENSOR", "TICK", "RAW_BYTES", "UNREAD", "REFUSED"))
_RAW_FIELDS = _RAW.pick("count", "more", "data")
# wall-clock figures of a real-time run cannot repeat
WALL_CLOCK = {
    "RATE_GROUP": frozenset({"last", "mean", "p99", "max"}),
    "LOOP_TIMING": frozenset(
        {"slips", "exec_last", "exec_max", "exec_mean", "late_p50", "late_p99", "late_p999", "late_max"}
    ),
    "SYS_STATUS": frozenset({"load", "drop_rate_comm", "errors_comm", "errors_count3"}),
}


@dataclass
class Tick:
    """Everything recorded under one stamp (real time: under one TICK record)."""

    t_us: int
    dt_s: float | None = None
    slips: int = 0
    unread: tuple[int, int] = (0, 0)
    refused: tuple[int, ...] = (0,) * len(REASONS)
    plant: list[bytes] = field(default_factory=list)
    ground: list[bytes] = field(default_factory=list)
    reply: bytes = b""
    telemetry: bytes = b""


@dataclass
class Report:
    """Result of a replay. `worst` maps MESSAGE.field to the largest difference; `extra` lists packets only one side
    has.
    """

    ticks: int = 0
    packets: int = 0
    differences: int = 0
    first: str = ""
    count: dict[str, int] = field(default_factory=dict)
    worst: dict[str, float] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """True if every output was repeated to the bit."""
        return not self.differences and not self.extra

    def lines(self) -> list[str]:
        """The report for a person."""
        out = [f"{self.ticks} ticks, {self.packets} packets compared, {self.differences} fields differ"]
        if self.first:
            out.append(f"first difference: {self.first}")
        out += [f"  {k}: {n} times, largest {self.worst[k]:.6g}" for k, n in sorted(self.count.items())]
        out += [f"  {e}" for e in self.extra[:20]]
        if len(self.extra) > 20:
            out.append(f"  ... and {len(self.extra) - 20} more")
        return out


class _Inbox:
    """Puts datagrams together again: raw chunks by their flag, plant packets up to each HIL_SENSOR."""

    def __init__(self) -> None:
        self.open = b""
        self.raw = b""

    def add(self, packet: bytes, out: list[bytes], until_sensor: bool) -> None:
        """Take one recorded packet; complete datagrams go to `out`."""
        if packet[7:10] == bytes(_RAW.id_bytes) and packet[6] == 0:
            got = split(packet, {_RAW.id: _RAW}, Counters())
            values = _RAW_FIELDS(got[0][1])
            n, more, data = values[0], values[1], bytes(values[2:])
            self.raw += data[:n]
            if not more:
                self.flush(out)
                out.append(self.raw)
                self.raw = b""
            return
        self.open += packet
        if not until_sensor or packet[7:10] == bytes(_SENSOR.id_bytes):
            self.flush(out)

    def flush(self, out: list[bytes]) -> None:
        """A datagram without HIL_SENSOR ends here."""
        if self.open:
            out.append(self.open)
            self.open = b""


def read_ticks(path: str | Path) -> Iterator[Tick]:
    """Ticks of a link log, in order. Raises TlogError."""
    tick: Tick | None = None
    plant, ground = _Inbox(), _Inbox()
    unread, refused = (0, 0), (0,) * len(REASONS)
    for t_us, link, packet in read(path):
        note = link == LINK_IN and packet[6] == 0  # of the recorder's own
        is_tick = note and packet[7:10] == bytes(_TICK.id_bytes)
        if tick is None or t_us != tick.t_us or is_tick:
            if tick is not None:
                plant.flush(tick.plant)
                yield tick
            tick = Tick(t_us, unread=unread, refused=refused)
        if is_tick:
            _, dt_us, tick.slips = split(packet, {_TICK.id: _TICK}, Counters())[0][1]
            tick.dt_s = dt_us / 1e6
        elif note and packet[7:10] == bytes(_UNREAD.id_bytes):
            tick.unread = unread = split(packet, {_UNREAD.id: _UNREAD}, Counters())[0][1][1:]
        elif note and packet[7:10] == bytes(_REFUSED.id_bytes):
            tick.refused = refused = split(packet, {_REFUSED.id: _REFUSED}, Counters())[0][1][1:]
        elif link == LINK_IN:
            plant.add(packet, tick.plant, until_sensor=True)
        elif link == GROUND_IN:
            ground.add(packet, tick.ground, until_sensor=False)
        elif link == LINK_OUT:
            tick.reply += packet
        elif link == GROUND_OUT:
            tick.telemetry += packet
    if tick is not None:
        plant.flush(tick.plant)
        yield tick


def replay(path: str | Path, node: Node, limit: int | None = None) -> Report:
    """Run `node` (fresh, of the run's configuration; `realtime` as recorded) over the log and compare. Raises
    TlogError.

    A log cut off in its last tick is compared up to the packets it has.
    """
    report = Report()
    pending: Tick | None = None
    for tick in read_ticks(path):
        if pending is not None:
            _one(pending, node, report, last=False)
        pending = tick
        if limit is not None and report.ticks >= limit:
            break
    if pending is not None and (limit is None or report.ticks < limit):
        _one(pending, node, report, last=True)
    return report


def _one(tick: Tick, node: Node, report: Report, last: bool) -> None:
    if tick.dt_s is not None:
        node.exec.slips = tick.slips
    node.unread_plant, node.unread_ground = tick.unread
    node.refused = tick.refused
    before = node.tick
    out = node.handle(tick.plant, tick.dt_s, tick.ground)
    if node.tick == before:
        # inputs after the last tick: answered by nothing, then as now
        if tick.reply or tick.telemetry:
            report.extra.append(f"t = {tick.t_us / 1e6:.2f} s: recorded outputs, but replay ran no tick")
        return
    report.ticks += 1
    _compare(tick.t_us, "reply", tick.reply, out.reply, node.realtime, report, last)
    _compare(tick.t_us, "telemetry", tick.telemetry, b"".join(out.telemetry), node.realtime, report, last)


def _compare(t_us: int, what: str, old: bytes, new: bytes, realtime: bool, report: Report, last: bool) -> None:
    """Compare two runs of packets field by field."""
    a, b = split(old, SPECS, Counters()), split(new, SPECS, Counters())
    report.packets += min(len(a), len(b))
    if old == new:
        return
    # a missing message must not shift the comparison of those after it
    old_ids, new_ids = [p[0].id for p in a], [p[0].id for p in b]
    for op, i0, i1, j0, j1 in SequenceMatcher(None, old_ids, new_ids, autojunk=False).get_opcodes():
        if op == "equal":
            for p, q in zip(a[i0:i1], b[j0:j1], strict=True):
                _packet(t_us, what, p, q, realtime, report)
            continue
        _only(t_us, what, "recorded", a[i0:i1], report)
        if not (last and j1 == len(b)):  # the last tick of a log may have been cut off
            _only(t_us, what, "replayed", b[j0:j1], report)


def _only(t_us: int, what: str, who: str, packets: list[Packet], report: Report) -> None:
    if packets:
        report.extra.append(f"t = {t_us / 1e6:.2f} s, {what}: only {who}: {', '.join(p[0].name for p in packets)}")


def _packet(t_us: int, what: str, p: Packet, q: Packet, realtime: bool, report: Report) -> None:
    skip = WALL_CLOCK.get(p[0].name, frozenset()) if realtime else frozenset()
    old, new = p[0].to_dict(p[1]), q[0].to_dict(q[1])
    old["(sysid, compid)"], new["(sysid, compid)"] = p[2:4], q[2:4]
    for name, x in old.items():
        y = new[name]
        if name not in skip and not _same(x, y):
            text = f"t = {t_us / 1e6:.2f} s, {what}: {p[0].name}.{name} was {x!r}, is {y!r}"
            _note(report, f"{p[0].name}.{name}", _size(x, y), text)


def _same(x: Any, y: Any) -> bool:
    """Equal, NaN counting as equal to NaN."""
    if isinstance(x, tuple):
        return len(x) == len(y) and all(map(_same, x, y))
    return x == y or (x != x and y != y)


def _size(x: Any, y: Any) -> float:
    """Largest difference of two values; infinite if they are not numbers."""
    if isinstance(x, tuple):
        return max(map(_size, x, y), default=0.0)
    if isinstance(x, (int, float)):
        d = abs(x - y)
        return math.inf if d != d else float(d)
    return math.inf


def _note(report: Report, key: str, size: float, text: str) -> None:
    report.differences += 1
    report.first = report.first or text
    report.count[key] = report.count.get(key, 0) + 1
    report.worst[key] = max(report.worst.get(key, 0.0), size)
