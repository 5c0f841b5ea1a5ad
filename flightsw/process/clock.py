"""The two clocks of the one loop; nothing else on board imports `time`.

Lockstep: time is the stamp in the sensor packet. Real time: absolute monotonic deadlines, so no drift; a loop that is
late by a period or more skips whole periods and says how many.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol


def monotonic_us() -> int:
    """Wall microseconds from an arbitrary start; for time-outs and accounting only."""
    return time.monotonic_ns() // 1000


def unix_s() -> float:
    """Unix time [s], for signatures of packets only: nothing that flies knows the date."""
    return time.time()


class Clock(Protocol):
    """What the loop asks of a clock."""

    def now_us(self) -> int:
        """Time [us]: sample time in lockstep, monotonic in real time."""

    def wait_tick(self) -> int:
        """Wait for the next tick; the number of base periods that passed."""


class LockstepClock:
    """Time is what the plant says: `advance` takes the stamp of each sensor datagram, the socket does the waiting."""

    def __init__(self, period_us: int) -> None:
        self.period_us = period_us
        self._t_us = -1
        self._step_us = period_us

    def advance(self, t_us: int) -> float:
        """A sensor datagram stamped `t_us` [us] was taken. Returns the step since the last [s]; first: one period."""
        if self._t_us >= 0:
            self._step_us = t_us - self._t_us
        self._t_us = t_us
        return self._step_us / 1e6

    def now_us(self) -> int:
        """Stamp of the last sensor datagram [us]; -1 before the first."""
        return self._t_us

    def wait_tick(self) -> int:
        """Periods between the last two stamps."""
        return max(0, round(self._step_us / self.period_us))


class RealtimeClock:
    """Absolute deadlines every `period_us`. `now` and `sleep_s` can be replaced for tests."""

    def __init__(
        self,
        period_us: int,
        now: Callable[[], int] = monotonic_us,
        sleep_s: Callable[[float], None] = time.sleep,
    ) -> None:
        self.period_us = period_us
        self._now = now
        self._sleep_s = sleep_s
        self._next_us = now() + period_us
        self.late_us = 0

    def now_us(self) -> int:
        """Monotonic time [us]."""
        return self._now()

    def start(self) -> None:
        """Set the first deadline one period from now (after warm-up)."""
        self._next_us = self._now() + self.period_us

    def wait_tick(self) -> int:
        """Sleep to the deadline. Returns 1 + periods skipped; `late_us` is how late the loop woke after the deadline
        it met.
        """
        wait = self._next_us - self._now()
        while wait > 0:
            self._sleep_s(wait * 1e-6)
            wait = self._next_us - self._now()
        skipped = -wait // self.period_us
        deadline = self._next_us + skipped * self.period_us
        # lateness counts from the deadline first missed: a slip shows its full size
        self.late_us = -wait
        self._next_us = deadline + self.period_us
        return 1 + skipped
