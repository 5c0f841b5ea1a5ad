"""Sensors of several aircraft, read in the call that works out what they measure (of a kind of aircraft that has such a one).

Here is what goes into it and what becomes of its readings. Sensors that go by themselves do so here as in bank.py, to the same
bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.types import SensorFrame
from sim_plant.sensors.bank import Bank, entries
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.faulty import Flicker
from sim_plant.sensors.rows import Rows, Store
from sim_plant.sensors.shape_kernel import K_OWNER

Fill = Callable[[SensorFrame, int, Any], None]


@dataclass(frozen=True, slots=True)
class Carrier:
    """One aircraft: its sensors, what they are shown, where they tell it."""

    bank: Bank
    view: View
    frame: SensorFrame


@dataclass(slots=True)
class Readings:
    """What is read together at a tick, one behind the other in `out`."""

    which: NDArray[np.int64]  # numbers in the store
    out: NDArray[np.float64]
    rows: list[Rows] = field(default_factory=list)  # their error rows
    frames: list[tuple[SensorFrame, int]] = field(default_factory=list)  # of all aircraft: what is told each time,
    # by these, from and to
    plain: list[tuple[Sensor, Fill, SensorFrame, int, int]] = field(default_factory=list)
    # by those who make their sample of it, or none
    made: list[tuple[Sensor, Carrier, int, int]] = field(default_factory=list)
    # and those with outages, or whose samples wait
    rest: list[tuple[Sensor, Carrier, int, int, Flicker | None]] = field(default_factory=list)
    flow: bool = True  # whether the air at the probes is looked at, together or by those who go by themselves

    def draw(self) -> None:
        """Draw error rows for those who have none left."""
        for r in self.rows:
            r.row()


class Banks:
    """Sensors of `carriers`, whose banks they are taken over from.

    Aircraft whose sensors have errors that few have (errors.Errors.few) are read by their banks.
    """

    def __init__(self, carriers: Sequence[Carrier]) -> None:
        self._carriers = list(carriers)
        few = [any(s.graded is not None and s.graded.few for s in c.bank.number) for c in carriers]
        self._by_bank = [c for c, f in zip(carriers, few, strict=True) if f]
        self._mine = [(i, c) for i, (c, f) in enumerate(zip(carriers, few, strict=True)) if not f]
        self.store = Store(max(1, sum(len(c.bank.number) for _, c in self._mine)))
        at = 0
        for i, c in self._mine:
            count = len(c.bank.number)
            c.bank.move(self.store, at)
            self.store.k[at : at + count, K_OWNER] = i
            c.bank.several = self
            at += count
        self._cycle = math.lcm(*(c.bank.cycle for _, c in self._mine))
        self.sort()

    def sort(self) -> None:
        """Who goes by himself, anew."""
        self._plans: dict[int, Readings] = {}
        self._alike: dict[tuple[bool, tuple[int, ...]], Readings] = {}
        self._apart = [(c, c.bank.apart) for _, c in self._mine if c.bank.apart]
        self._late = [(s, c.frame) for _, c in self._mine for s in c.bank.late]

    def due(self, k: int) -> Readings:
        """What is to be read at tick k."""
        return self._plans.get(k % self._cycle) or self._plan(k)

    def _plan(self, k: int) -> Readings:
        """One plan for all ticks at which the same is due: what is seldom used has left the processor's caches."""
        due = [(i, c, s) for i, c in self._mine for s in c.bank.together(k)]
        flow = bool(self._by_bank) or any(c.bank.flow(k) for _, c in self._mine)
        key = flow, tuple(c.bank.number[s] for _, c, s in due)
        if key not in self._alike:
            self._alike[key] = self._readings(due, flow)
        return self._plans.setdefault(k % self._cycle, self._alike[key])

    def _readings(self, due: list[tuple[int, Carrier, Sensor]], flow: bool) -> Readings:
        which = np.array([c.bank.number[s] for _, c, s in due], dtype=np.int64)
        plan, at = Readings(which, np.zeros(0), flow=flow), 0
        bits = [0] * len(self._carriers)
        for i, c, s in due:
            end = at + entries(s, self.store.k[c.bank.number[s]])
            flicker = s.graded.flicker if s.graded is not None else None
            if flicker is not None or s.latency_us or s.waiting:
                plan.rest.append((s, c, at, end, flicker))
            elif type(s).made is Sensor.made:
                plan.plain.append((s, s.fill, c.frame, at, end))
                bits[i] |= s.bit
            else:
                plan.made.append((s, c, at, end))
            plan.rows += [r for r in (s.graded, s.noise) if r is not None]
            at = end
        plan.out = np.zeros(at)
        plan.frames = [(c.frame, told) for c, told in zip(self._carriers, bits, strict=True)]
        return plan

    def tell(self, plan: Readings, k: int, t_us: int) -> None:
        """Hand over what has been read and what goes by itself, at tick k, t_us [us]."""
        for f, bits in plan.frames:
            f.t_us, f.updated = t_us, bits
            if f.commands:
                f.commands = []
        late = self._late  # as it was: one with a spike has had its turn when it has stepped
        if self._by_bank or self._apart:
            self._by_themselves(k, t_us)
        values = tuple(plan.out.tolist())
        for s, fill, frame, begin, end in plan.plain:
            s.last = row = values[begin:end]
            fill(frame, t_us, row)
        for s, c, begin, end in plan.made:
            sample = s.made(values[begin:end], c.view)
            if sample is not None:
                s.last = sample
                s.fill(c.frame, t_us, sample)
                c.frame.updated |= s.bit
        for s, c, begin, end, flicker in plan.rest:
            if flicker is None or not flicker.lost():
                s.take(t_us, s.made(values[begin:end], c.view), c.frame)
        for s, frame in late:
            if s.ready_us <= t_us:
                s.deliver(t_us, frame)

    def _by_themselves(self, k: int, t_us: int) -> None:
        for c in self._by_bank:
            c.bank.read(k, t_us, c.view, c.frame)
        for c, sensors in self._apart:
            c.bank.one_by_one(sensors, k, t_us, c.view, c.frame)
