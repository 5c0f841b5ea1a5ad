"""What every sensor shares: rate, latency, errors, faults. A sensor samples the true state of its tick and hands the
sample over `latency` later; its time stamp says when it was taken."""

from __future__ import annotations

from collections import deque
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from flightsw.types import SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.sensors.bank_kernel import APART
from sim_plant.sensors.faulty import Delay, Drift, Flicker, Garbage
from sim_plant.sensors.rows import NoiseRows

if TYPE_CHECKING:
    from sim_plant.sensors.bank import Bank
    from sim_plant.sensors.errors import Errors
    from sim_plant.sensors.ports import Before

Arr = NDArray[np.float64]

NEVER_US = 1 << 62


class View:
    """True values of one aircraft at the current tick, as plain floats (layout.py orders)."""

    __slots__ = (
        "_boom", "_o", "_pair", "_rel", "_s", "arrays", "contact", "due", "inside", "lateral_m", "lateral_read", "pair_due",
        "probes", "target", "transfer_kgps",
    )  # fmt: skip

    def __init__(self, probes: int) -> None:
        self._s = [0.0] * n.NS
        self._o = [0.0] * n.NO
        self.arrays: tuple[Arr, Arr] | None = None  # `s` and `o`, where a kind has them as arrays
        self.due = False  # the lists are still to be made of them: true again when they have new values
        self._rel = [0.0] * n.NR
        self._boom = [0.0] * n.NR
        self._pair: tuple[Arr, Arr] | None = None  # `rel` and `boom`, where they are worked out as arrays
        self.pair_due = False  # the same
        self.contact = False
        self.inside = False
        self.transfer_kgps = 0.0
        self.probes = probes
        self.target: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m] NED of the aircraft the TACAN is tuned to
        self.lateral_m = 0.0  # of that aircraft off the refuelling track,
        self.lateral_read = False  # or already what the crew reads, the truth being spread about it

    @property
    def s(self) -> list[float]:
        """State [NS]."""
        if self.due:
            self._copy()
        return self._s

    @s.setter
    def s(self, s: list[float]) -> None:
        if self.due:
            self._copy()
        self._s = s

    @property
    def o(self) -> list[float]:
        """Observation [NO]."""
        if self.due:
            self._copy()
        return self._o

    @o.setter
    def o(self, o: list[float]) -> None:
        if self.due:
            self._copy()
        self._o = o

    @property
    def rel(self) -> list[float]:
        """Motion relative to the leader [NR]; of the leader zero."""
        if self.pair_due:
            self._copy_pair()
        return self._rel

    @rel.setter
    def rel(self, rel: list[float]) -> None:
        if self.pair_due:
            self._copy_pair()
        self._rel = rel

    @property
    def boom(self) -> list[float]:
        """The same of whoever is at the boom [NR]: own, or (leader) its partner's."""
        if self.pair_due:
            self._copy_pair()
        return self._boom

    @boom.setter
    def boom(self, boom: list[float]) -> None:
        if self.pair_due:
            self._copy_pair()
        self._boom = boom

    def see(self, s: Arr, o: Arr) -> None:
        """These from now on; the arrays must stay as they are until the next call. Lists are made when asked for."""
        self.arrays, self.due = (s, o), True

    def see_pair(self, rel: Arr, boom: Arr) -> None:
        """The same of `rel` and `boom`."""
        self._pair, self.pair_due = (rel, boom), True

    def _copy(self) -> None:
        if self.arrays is not None:
            self._s, self._o = self.arrays[0].tolist(), self.arrays[1].tolist()
        self.due = False

    def _copy_pair(self) -> None:
        if self._pair is not None:
            self._rel, self._boom = self._pair[0].tolist(), self._pair[1].tolist()
        self.pair_due = False

    def still(self) -> View:
        """As it is now, for good, and to be changed."""
        s, o = self.s[:], self.o[:]
        out = copy(self)
        out.arrays = None
        out.s, out.o, out.rel, out.boom = s, o, self.rel[:], self.boom[:]
        return out


def divisor(base_hz: int, rate_hz: float, key: str) -> int:
    """Ticks between samples. Raises ConfigError if the rate does not divide the base rate."""
    ticks = round(base_hz / rate_hz)
    if ticks < 1 or abs(ticks * rate_hz - base_hz) > 1e-6 * base_hz:
        raise ConfigError(f"{key}.rate_hz = {rate_hz:g}: allowed: {base_hz} divided by a whole number")
    return ticks


class Sensor:
    """One sensor group. Subclasses say what they measure (`sample`) and where it goes (`fill`); those with a `form`
    (bank_kernel.py) are read together while nothing is wrong with them (bank.py)."""

    group = ""  # name in the scenario
    bit = 0  # SensorFrame.updated
    form = APART
    exact = 0  # columns of its reading that faults can change, if paper gives it no errors of its own

    def __init__(
        self, key: str, rate_hz: float, latency_ms: float, base_hz: int, noise: NoiseRows | None, columns: int
    ) -> None:
        self.key = key
        self.div = self.every = divisor(base_hz, rate_hz, key)  # ticks between samples; and between calls of `step`
        self.latency_us = round(latency_ms * 1000.0)
        self.noise = noise
        self.columns = columns
        self.waiting: deque[tuple[int, Any]] = deque()  # samples not yet delivered,
        self.ready_us = NEVER_US  # and when the first of them will be
        self.last: Any = None  # sample handed over
        self.graded: Errors | None = None  # what a grade, or single terms, add to the noise
        self.bank: Bank | None = None
        # faults, set by failures.schedule.FaultPlan
        self.faulty = False
        self.dropped = False
        self.stuck = False
        self.offset: list[float] | None = None  # added to the error row
        self.spike: list[float] | None = None  # added to the next error row only
        self.errors: list[Drift | Garbage] = []
        self.delays: list[Delay] = []
        self.flickers: list[Flicker] = []
        self.factors: list[float] | None = None  # of the reading, column by column
        self.frozen = False  # the truth stands still
        self.before: list[Before] = []  # what else stands between the truth and the sensor
        self._still: View | None = None
        self.stamp_us = 0  # the samples' time is off by

    def sample(self, view: View, e: list[float]) -> Any:
        """Measured values from the truth and an error row; None: nothing within reach."""
        raise NotImplementedError

    def fill(self, frame: SensorFrame, t_us: int, value: Any) -> None:
        """Write a sample taken at t_us into the frame."""
        raise NotImplementedError

    def step(self, k: int, t_us: int, view: View, frame: SensorFrame) -> None:
        """Sample if it is this sensor's tick, and deliver what has waited out its latency: bank.Bank.read for one alone."""
        if k % self.div == 0:
            # errors are drawn also while a fault hides them: a fault must not reshuffle the rest of the run
            e = self.noise.next() if self.noise is not None else []
            out = False
            if self.faulty:
                view = self.shown(view, t_us)
            g = self.graded
            if g is not None:
                e, out = g.add(e, t_us, view), g.flicker is not None and g.flicker.lost()
            if not self.faulty:
                self.take(t_us, None if out else self.sample(view, e), frame)
            else:
                self._faulty_sample(t_us, view, e, out)
        self.deliver(t_us, frame)

    def made(self, row: tuple[float, ...], view: View) -> Any:
        """The sample of a compiled reading, errors in it: as `sample`."""
        return row

    def take(self, t_us: int, value: Any, frame: SensorFrame) -> None:
        """A sample of now, None for none: into the frame, or to wait."""
        if value is None:
            return
        if self.latency_us == 0 and not self.waiting:
            self.last = value
            self.fill(frame, t_us, value)
            frame.updated |= self.bit
        else:
            self._queue(t_us, value)

    def deliver(self, t_us: int, frame: SensorFrame) -> None:
        """The first sample that waits into the frame, if its time has come."""
        if self.ready_us <= t_us:
            taken, value = self.waiting.popleft()
            self.ready_us = self.waiting[0][0] + self.latency_us if self.waiting else NEVER_US
            self.last = value
            self.fill(frame, max(taken + self.stamp_us, 0), value)
            frame.updated |= self.bit

    def _queue(self, t_us: int, value: Any) -> None:
        if not self.waiting:
            self.ready_us = t_us + self.latency_us
        self.waiting.append((t_us, value))

    def _faulty_sample(self, t_us: int, view: View, e: list[float], out: bool) -> None:
        e = e or [0.0] * self.columns
        for extra in (self.offset, self.spike):
            if extra is not None:
                e = [a + b for a, b in zip(e, extra, strict=True)]
        for f in self.errors:
            e = f.add(e, t_us)
        if self.factors is not None:
            true = self.row(view)
            e = [f * (t + x) - t for f, t, x in zip(self.factors, true, e, strict=True)]
        if self.spike is not None:
            self.spike = None
            self.refresh()
        if self.dropped or out:
            return
        before = self.newest()
        frozen = self.stuck and before is not None
        value = before if frozen else self.sample(view, e)
        if value is not None and (value := self.alter(value, frozen)) is not None:
            self._queue(t_us, value)

    def shown(self, view: View, t_us: int) -> View:
        """The truth as it reaches the sensor at t_us."""
        if self.frozen:
            view = self._still = self._still or view.still()
        for b in self.before:
            view = b.act(view, t_us)
        return view

    def row(self, view: View) -> list[float]:
        """The reading without error, in the columns of the error row; zeros out of reach."""
        value = self.sample(view, [0.0] * self.columns)
        return list(value[: self.columns]) if value is not None else [0.0] * self.columns

    def newest(self) -> Any:
        """The last sample taken, delivered or still on its way; None before the first."""
        return self.waiting[-1][1] if self.waiting else self.last

    def alter(self, value: Any, frozen: bool) -> Any | None:
        """What faults of the whole group make of a sample; None: it is lost. `frozen`: it is the last one once more."""
        if not frozen:
            for d in self.delays:
                value = d.push(value)
        lost = [f.lost() for f in self.flickers]  # every chain moves on, whatever the others do
        return None if any(lost) else value

    def impaired(self) -> bool:
        """Whether a fault is on it."""
        return (
            self.dropped or self.stuck or self.offset is not None or self.spike is not None
            or bool(self.errors or self.delays or self.flickers)
            or self.factors is not None or self.frozen or self.stamp_us != 0 or bool(self.before)
        )  # fmt: skip

    def refresh(self) -> None:
        """Recompute the summary flag after a fault field changed."""
        self.faulty = self.impaired()
        if not self.frozen:
            self._still = None
        if self.bank is not None:
            self.bank.sort()
