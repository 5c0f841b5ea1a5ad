"""Rate groups and loop accounting. Knows no clock: time comes in through a callable, so in lockstep every figure is 0.

A group runs on the ticks where `tick % divisor == offset`; off its turn it holds its last output. The order of
execution is the order in which groups were added.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from flightsw.types import GroupCost, Timing

SUB = 16  # histogram buckets per octave: 6 % resolution
OCTAVES = 40
LIMIT_US = 2.0 ** (OCTAVES - 1)


def no_time() -> int:
    """The clock of lockstep accounting: wall time does not exist."""
    return 0


class Histogram:
    """Counts of durations [us] in logarithmic buckets, fixed memory; quantiles to about 6 %."""

    __slots__ = ("counts", "max", "n", "total")

    def __init__(self) -> None:
        self.counts = [0] * (SUB * OCTAVES)
        self.n = 0
        self.max = 0.0
        self.total = 0.0

    def add(self, us: float) -> None:
        """Count one duration [us]; negative counts as 0."""
        us = min(max(us, 0.0), LIMIT_US)
        m, e = math.frexp(us + 1.0)  # us + 1 = m 2^e, m in [0.5, 1), e >= 1
        self.counts[(e - 1) * SUB + int((m - 0.5) * 2 * SUB)] += 1
        self.n += 1
        self.total += us
        if us > self.max:
            self.max = us

    def quantile(self, q: float) -> float:
        """Upper edge [us] of the bucket holding quantile q of 0..1, at most the largest value; 0 if nothing was
        counted.
        """
        if not self.n:
            return 0.0
        need, seen = math.ceil(q * self.n), 0
        for i, c in enumerate(self.counts):
            seen += c
            if seen >= need and c:
                edge = math.ldexp(0.5 + (i % SUB + 1) / (2 * SUB), i // SUB + 1) - 1.0
                return min(edge, self.max)
        return self.max

    @property
    def mean(self) -> float:
        """Mean duration [us]."""
        return self.total / self.n if self.n else 0.0


@dataclass(slots=True)
class Group:
    """One rate group and what it cost."""

    name: str
    divisor: int
    offset: int
    call: Callable[[], None]
    runs: int = 0
    last_us: float = 0.0
    cost: Histogram = field(default_factory=Histogram)


class Executive:
    """Runs groups by tick number and keeps the accounts of the loop.

    `now_us` gives wall microseconds (real time) or 0 (lockstep).
    """

    def __init__(self, now_us: Callable[[], int] = no_time) -> None:
        self.now_us = now_us
        self.groups: list[Group] = []
        self.ticks = 0
        self.slips = 0
        self.exec_last_us = 0.0
        self.cost = Histogram()
        self.late = Histogram()
        self._slips_told = 0

    def add(self, name: str, divisor: int, offset: int, call: Callable[[], None]) -> None:
        """Append a group. Raises ValueError if divisor or offset make no sense."""
        if divisor < 1 or not 0 <= offset < divisor:
            raise ValueError(
                f"rate group {name}: divisor {divisor}, offset {offset}: divisor >= 1 and 0 <= offset < divisor"
            )
        self.groups.append(Group(name, divisor, offset, call))

    def run(self, tick: int) -> None:
        """Run every group whose turn it is, in order."""
        self.ticks += 1
        timed = self.now_us is not no_time
        for g in self.groups:
            if tick % g.divisor != g.offset:
                continue
            if timed:
                t0 = self.now_us()
                g.call()
                g.last_us = float(self.now_us() - t0)
                g.cost.add(g.last_us)
            else:
                g.call()
            g.runs += 1

    def account(self, exec_us: float, late_us: float, slipped: int) -> None:
        """Close a tick: what it cost, how late it began, how many periods were skipped before it."""
        self.slips += slipped
        if self.now_us is not no_time:
            self.exec_last_us = exec_us
            self.cost.add(exec_us)
            self.late.add(late_us)

    def new_slips(self) -> int:
        """Slips since the last call: asked once a second, so that warnings cannot flood."""
        n, self._slips_told = self.slips - self._slips_told, self.slips
        return n

    def fill(self, t: Timing) -> None:
        """Write the accounts into a Timing record."""
        t.ticks, t.slips = self.ticks, self.slips
        t.exec_us_last, t.exec_us_max, t.exec_us_mean = self.exec_last_us, self.cost.max, self.cost.mean
        t.late_us_p50, t.late_us_p99, t.late_us_max = self.late.quantile(0.5), self.late.quantile(0.99), self.late.max

    def costs(self) -> list[GroupCost]:
        """What each group costs, in the order of execution."""
        return [
            GroupCost(g.name, g.divisor, g.offset, g.runs, g.last_us, g.cost.mean, g.cost.quantile(0.99), g.cost.max)
            for g in self.groups
        ]

    @property
    def late_p999_us(self) -> float:
        """99.9th percentile of lateness [us]."""
        return self.late.quantile(0.999)
