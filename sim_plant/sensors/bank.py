"""All sensors of one aircraft. Those that are due and as they should be are read in one compiled call (bank_kernel.py); a faulty
one, and one whose reading has no form there, goes by itself (base.Sensor.step), to the same bit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flightsw.types import SensorFrame
from sim_plant.sensors.bank_kernel import APART, AT_BOOM, AT_BOOM_EXACT, EXTRA, PAIR, readings
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.errors import NONE, Errors, measured, sign
from sim_plant.sensors.faulty import Flicker
from sim_plant.sensors.rows import Rows, Store
from sim_plant.sensors.shape_kernel import K_AT, K_FORM, K_WIDTH, W_SIGN

if TYPE_CHECKING:
    from sim_plant.sensors.banks import Banks


def entries(s: Sensor, row: NDArray[np.int64]) -> int:
    """Entries of a sensor's compiled reading; row: its whole numbers in the store."""
    return int(row[K_WIDTH]) + EXTRA.get(s.form, 0)


@dataclass(slots=True)
class Plan:
    """What is read together at a tick."""

    which: NDArray[np.int64]  # numbers in the store
    out: NDArray[np.float64]
    # from, to in `out`; outages; whether the row is the sample as it is
    parts: list[tuple[Sensor, int, int, Flicker | None, bool]] = field(default_factory=list)
    rows: list[Rows] = field(default_factory=list)  # their error rows,
    few: list[Errors] = field(default_factory=list)  # and those with errors few have
    pair: bool = False  # whether relative motion is read


class Bank:
    """The sensors of an aircraft with `probes` air-data probes, in the order in which they are read."""

    def __init__(self, sensors: Sequence[Sensor], probes: int) -> None:
        self._sensors = sensors
        self._store = store = Store(len(sensors))
        self.number: dict[Sensor, int] = {}  # in the store, of those that are read together
        self.several: Banks | None = None  # with those of other aircraft
        for j, s in enumerate(sensors):
            if s.form == APART or (s.noise is not None and s.graded is not None):
                continue
            rows = s.graded or s.noise
            if rows is not None:
                rows.move(store, j)
            k, at = store.k[j], measured(s.group, probes)
            k[K_FORM] = AT_BOOM_EXACT if rows is None and s.form == AT_BOOM else s.form
            k[K_WIDTH], k[K_AT : K_AT + len(at)] = len(at), at
            store.f[j, W_SIGN, : len(at)] = sign(s.group)
            self.number[s], s.bank = j, self
        self.cycle = math.lcm(*(s.div for s in self.number))
        self.sort()

    def sort(self) -> None:
        """Who goes by himself, anew: a fault has begun or ended."""
        self.apart = [s for s in self._sensors if s.faulty or s not in self.number]
        self.late = [s for s in self._sensors if s not in self.apart and (s.latency_us > 0 or s.waiting)]
        self._plans: dict[int, Plan] = {}
        if self.several is not None:
            self.several.sort()

    def move(self, store: Store, at: int) -> None:
        """From now on keep what the compiled reading goes by in `store`, from place `at` on without gaps."""
        for i, (s, j) in enumerate(self.number.items(), at):
            store.f[i], store.k[i] = self._store.f[j], self._store.k[j]
            rows = s.graded or s.noise
            if rows is not None:
                rows.move(store, i)
            self.number[s] = i
        self._store = store
        self.sort()

    def empty(self) -> None:
        """From now on there are no sensors."""
        self._sensors, self.number = (), {}
        self.sort()

    def together(self, k: int) -> list[Sensor]:
        """Those that are due at tick k and read together."""
        return [s for s in self.number if not s.faulty and k % s.div == 0]

    def flow(self, k: int) -> bool:
        """Whether air data are due at tick k, faulty or not."""
        return any(s.group == "air" and (k % s.div == 0 or s not in self.number) for s in self._sensors)

    def read(self, k: int, t_us: int, view: View, frame: SensorFrame) -> None:
        """What the sensors hand over at tick k, t_us [us], into the frame."""
        if view.arrays is None:
            self.one_by_one(self._sensors, k, t_us, view, frame)
            return
        plan, late = self._plans.get(k % self.cycle), self.late
        if plan is None:
            plan = self._plan(k)
        if self.apart:  # one with a spike is as it should be after its step, and has had its tick
            self.one_by_one(self.apart, k, t_us, view, frame)
        if plan.parts:
            self._together(plan, t_us, view, frame)
        for s in late:
            if s.ready_us <= t_us:
                s.deliver(t_us, frame)

    @staticmethod
    def one_by_one(sensors: Sequence[Sensor], k: int, t_us: int, view: View, frame: SensorFrame) -> None:
        """The same, sensor by sensor."""
        for s in sensors:
            if k % s.every == 0 or t_us >= s.ready_us:
                s.step(k, t_us, view, frame)

    def _together(self, plan: Plan, t_us: int, view: View, frame: SensorFrame) -> None:
        assert view.arrays is not None
        for g in plan.few:
            g.prepare([], t_us, view)
        s, o = view.arrays
        rel = boom = np.array(view.rel) if plan.pair else NONE
        if plan.pair and view.boom is not view.rel:
            boom = np.array(view.boom)
        store, out = self._store, plan.out
        while not readings(s, o, rel, boom, plan.which, store.f, store.k, t_us, out):
            for r in plan.rows:
                r.row()
        values = tuple(out.tolist())
        for sensor, begin, end, flicker, plain in plan.parts:
            if flicker is None or not flicker.lost():
                row = values[begin:end]
                sensor.take(t_us, row if plain else sensor.made(row, view), frame)

    def _plan(self, k: int) -> Plan:
        due = self.together(k)
        plan, at = Plan(np.array([self.number[s] for s in due], dtype=np.int64), np.zeros(0)), 0
        for s in due:
            row = self._store.k[self.number[s]]
            end = at + entries(s, row)
            flicker = s.graded.flicker if s.graded is not None else None
            plan.parts.append((s, at, end, flicker, type(s).made is Sensor.made))
            plan.rows += [r for r in (s.graded, s.noise) if r is not None]
            if s.graded is not None and s.graded.few:
                plan.few.append(s.graded)
            plan.pair |= bool(row[K_AT] >= PAIR)
            at = end
        plan.out = np.zeros(at)
        return self._plans.setdefault(k % self.cycle, plan)
