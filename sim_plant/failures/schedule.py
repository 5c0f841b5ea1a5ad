"""Scripted events and injected failures turned into tick-by-tick actions on sensors, surfaces and links."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.aircraft.kind import SURFACES
from sim_plant.failures.actuators import Bent, Held
from sim_plant.failures.parts import CLEARS, check_part, power_of
from sim_plant.failures.script import BENDS, CHANNELS, ENGINE_KINDS, ICE, PORTS, Event
from sim_plant.rng import generator
from sim_plant.scenario import Scenario
from sim_plant.sensors.airdata import ORDER, AirSensor, Cells
from sim_plant.sensors.base import Sensor
from sim_plant.sensors.faulty import Delay, Drift, Flicker, Garbage
from sim_plant.sensors.ports import Pitot, StaticPort, Still, Tubes

HALF = 0.5  # [-] share of samples an intermittent fault loses if nothing is said


@dataclass(slots=True)
class Outage:
    """Faults of one aircraft that are not in a sensor."""

    jam: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # 1 = surface frozen
    link_down: bool = False  # its radio neither transmits nor receives
    bent: list[Bent | Held] = field(default_factory=list)  # what becomes of its commands


@dataclass(slots=True)
class Active:
    """An event under way. `columns` of its sensor it concerns; `process`: what it does, with its state."""

    event: Event
    columns: frozenset[int] = frozenset()
    process: Any = None


def columns_of(e: Event, s: Sensor, at: str) -> list[int]:
    """Columns of the sensor's reading that an event concerns. Raises ConfigError for a probe the aircraft lacks."""
    if not isinstance(s, AirSensor):
        return list(range(s.columns))
    probes = s.columns // len(CHANNELS)
    if e.index >= probes:
        raise ConfigError(f"{at}.index = {e.index}: {s.key} has probes 0 to {probes - 1} ({', '.join(s.names)})")
    channels = [CHANNELS.index(e.channel)] if e.channel else range(1 if e.kind in PORTS else len(CHANNELS))
    return [len(CHANNELS) * p + c for p in ([e.index] if e.index >= 0 else range(probes)) for c in channels]


def _row(e: Event, s: Sensor, columns: list[int], at: str) -> list[float]:
    """The event's values as an error row. Raises ConfigError if their number does not fit."""
    width = len(columns)
    if not width:
        raise ConfigError(f"{at}.kind = {e.kind!r}: {s.key} has no errors of its own, its reading is exact")
    if len(e.value) not in (1, width):
        which = f"index {e.index}" + (f", channel {e.channel}" if e.channel else "")
        raise ConfigError(f"{at}.value: {s.key} takes 1 or {width} values, got {len(e.value)} ({which})")
    row = [0.0] * s.columns
    for c, x in zip(columns, list(e.value) * (width if len(e.value) == 1 else 1), strict=True):
        row[c] = x
    return row


class FaultPlan:
    """Starts and ends faults at their ticks. Faults with randomness draw from generators "<aircraft>.<sensor>.fault<i>" (scripted
    event i) or ".inject<n>" (n-th injection). Raises ConfigError for an event that does not fit its aircraft."""

    def __init__(self, sc: Scenario, members: Sequence[Member], seed: int) -> None:
        self.outage = {m.cfg.name: Outage() for m in members}
        sensors = {m.cfg.name: {s.group: s for s in m.sensors} for m in members}
        self._members = {m.cfg.name: m for m in members}
        self._sensors, self._rate, self._seed = sensors, sc.clock.base_rate_hz, seed
        self._active: list[Active] = []
        self._plan: dict[int, list[tuple[bool, Event, str]]] = {}  # tick -> begins or ends, what, name of its generator
        self._injected = 0
        for i, e in enumerate(sc.event):
            if e.kind == "command":
                continue
            name = f"{e.target}.{e.sensor}.fault{i}"
            if e.sensor:
                if e.sensor not in sensors[e.target]:
                    raise ConfigError(
                        f"event[{i}].sensor = {e.sensor!r}: {e.target} carries {', '.join(sensors[e.target])}"
                    )
                self._start(e, 0, f"event[{i}]", name)  # tried out, for its errors
            self._schedule(e, round(e.t_s * self._rate), name)
        for i, e in enumerate(sc.event):
            for m in members:
                if e.target == m.cfg.name:
                    check_part(f"event[{i}]", e, m)

    def _schedule(self, e: Event, start: int, name: str) -> None:
        self._plan.setdefault(start, []).append((True, e, name))
        if e.for_s > 0.0 and e.kind != "spike":
            end = start + max(1, round(e.for_s * self._rate))
            self._plan.setdefault(end, []).append((False, e, name))

    def inject(self, e: Event, k: int) -> None:
        """Start a fault of a sensor at tick k (not yet stepped). One of the same kind and place is replaced."""
        name = f"{e.target}.{e.sensor}.inject{self._injected}"
        self._injected += 1
        self._schedule(e, k, name)

    def clear(self, e: Event, k: int) -> None:
        """End at tick k every fault of the sensor, probe and channel that `e` names (kind "clear" of no scenario)."""
        self._plan.setdefault(k, []).append((False, e, ""))

    def wider(self, e: Event) -> bool:
        """Whether a fault under way reaches beyond the columns `e` names, so that clearing those would not end it."""
        if not e.sensor:
            return False
        mine = frozenset(columns_of(e, self._sensors[e.target][e.sensor], e.target))
        here = [a for a in self._active if a.event.target == e.target and a.event.sensor == e.sensor]
        return any(a.columns & mine and not a.columns <= mine for a in here)

    def step(self, k: int) -> None:
        """Apply what starts or ends at tick k."""
        for begin, e, name in self._plan.pop(k, ()):
            if begin and e.kind == "spike":
                s = self._sensors[e.target][e.sensor]
                s.spike = _row(e, s, columns_of(e, s, e.target), e.target)
                s.refresh()
            elif begin:
                new = self._start(e, round(k * 1e6 / self._rate), e.target, name)
                if ".inject" in name:
                    self._active = [a for a in self._active if not _same(a.event, e)]
                self._active.append(new)
            else:
                self._active = [a for a in self._active if a.event is not e and not self._cleared(a, e)]
            self._apply(e)
        for a in self._active:
            if a.event.kind == "link_poor":
                out = self.outage[a.event.target]
                here = [b.event.kind for b in self._active if b.event.target == a.event.target]
                out.link_down = a.process.lost() or "link_loss" in here

    def _cleared(self, a: Active, e: Event) -> bool:
        if not e.kind.startswith(CLEAR) or a.event.target != e.target or a.event.sensor != e.sensor:
            return False
        if not e.sensor:
            return a.event.surface == e.surface if e.surface else a.event.kind in CLEARS.get(e.kind, ())
        return a.columns <= frozenset(columns_of(e, self._sensors[e.target][e.sensor], e.target))

    def _start(self, e: Event, t_us: int, at: str, name: str) -> Active:
        """An event as it begins at t_us, its draws of the generator `name`. Raises ConfigError if it does not fit its sensor."""
        rng = generator(self._seed, name)
        if not e.sensor:
            m = self._members[e.target]
            made: Any = None
            if e.kind in BENDS:
                made = Bent(e, m.ac.controls, m.dt_s)
            elif e.kind == "throttle_stuck":
                made = Held()
            elif e.kind == "link_poor":
                share = e.value[0]
                made = Flicker(share, e.value[1] * self._rate if len(e.value) > 1 else 1.0 / (1.0 - share), rng)
            return Active(e, process=made)
        s = self._sensors[e.target][e.sensor]
        columns = columns_of(e, s, at)
        if e.kind in ("drift", "garbage", "scale", "bias", "spike"):
            row = _row(e, s, columns, at)
        process: Any = None
        if e.kind == "bias" or (e.kind == "scale" and not isinstance(s, AirSensor)):
            process = row
        elif e.kind == "drift":
            process = Drift(row, t_us)
        elif e.kind == "garbage":
            process = Garbage(row, rng)
        elif e.kind in PORTS:
            tubes = tuple(c // len(CHANNELS) for c in columns)
            rate = (e.value[0] if e.value else ICE) if e.kind == "iced" else 0.0
            process = Pitot(tubes, rate, t_us) if isinstance(s, AirSensor) else StaticPort()
        elif e.kind == "frozen" and (e.index >= 0 or e.channel):
            process = Still(columns)
        elif e.kind == "delayed":
            process = Delay(e.samples)
        elif e.kind == "intermittent":
            share = e.value[0] if e.value else HALF
            mean = e.value[1] * self._rate / s.div if len(e.value) > 1 else 1.0 / (1.0 - share)
            process = Flicker(share, mean, rng)
        if isinstance(s, AirSensor) and e.kind in CELL_KINDS and (e.index >= 0 or e.channel or e.kind == "scale"):
            kind = "off" if e.kind == "dropout" else e.kind
            whole = 1 << e.index if not e.channel and e.index >= 0 else 0
            cells = Cells(kind, columns, whole)
            if kind == "scale":
                cells.factors = [row[c] for c in columns]
            elif kind == "delayed":
                cells.delay = process
            elif kind == "intermittent":
                cells.flicker = process
            process = cells
        return Active(e, frozenset(columns), process)

    def _apply(self, e: Event) -> None:
        """Recompute the fault fields that event `e` touches from all active events."""
        mine = [a for a in self._active if a.event.target == e.target]
        out = self.outage[e.target]
        kinds = {a.event.kind for a in mine}
        out.link_down = "link_loss" in kinds
        out.bent = [a.process for a in mine if isinstance(a.process, (Bent, Held))]
        m = self._members[e.target]
        if e.kind in ENGINE_KINDS or e.kind == "clear_engine":
            m.set_power(power_of(m.engines, (a.event for a in mine)))
        m.leak_kgps = sum(a.event.value[0] for a in mine if a.event.kind == "leak")
        out.jam = [1.0 if any(a.event.kind == "jam" and a.event.surface == s for a in mine) else 0.0 for s in SURFACES]
        if not e.sensor:
            return
        s = self._sensors[e.target][e.sensor]
        here = [a for a in mine if a.event.sensor == e.sensor]
        processes = [a.process for a in here]
        group = {a.event.kind for a in here if a.process is None}
        s.dropped = bool(group & {"dropout", "off"})
        s.stuck = "stuck" in group
        rows = [a.process for a in here if a.event.kind == "bias"]
        s.offset = [sum(c) for c in zip(*rows, strict=True)] if rows else None
        s.frozen = "frozen" in group
        s.stamp_us = round(1e6 * sum(a.event.value[0] for a in here if a.event.kind == "stamp"))
        rows = [a.process for a in here if a.event.kind == "scale" and not isinstance(a.process, Cells)]
        s.factors = [math.prod(c) for c in zip(*rows, strict=True)] if rows else None
        s.errors = [p for p in processes if isinstance(p, (Drift, Garbage))]
        s.delays = [p for p in processes if isinstance(p, Delay)]
        s.flickers = [p for p in processes if isinstance(p, Flicker)]
        if isinstance(s, AirSensor):
            s.cells = sorted((p for p in processes if isinstance(p, Cells)), key=lambda c: ORDER.index(c.kind))
        s.refresh()
        self._ports(e.target, [a.process for a in mine])

    def _ports(self, target: str, faults: list[Any]) -> None:
        """What stands between the air and the air data and the barometer: they share a static port."""
        closed = [p for p in faults if isinstance(p, StaticPort)]
        pitots = [p for p in faults if isinstance(p, Pitot)]
        for s in self._sensors[target].values():
            if isinstance(s, AirSensor):
                tubes = [Tubes(pitots, closed[0] if closed else None)] if pitots or closed else []
                s.before = [*tubes, *(p for p in faults if isinstance(p, Still))]
            elif s.group == "baro":
                s.before = [*closed]  # one that closes a closed port traps what is in it
            else:
                continue
            s.refresh()


CLEAR = "clear"
CELL_KINDS = (*ORDER, "dropout")


def _same(a: Event, b: Event) -> bool:
    mine, other = ((e.target, e.sensor, e.surface, e.kind, e.index, e.channel) for e in (a, b))
    return mine == other
