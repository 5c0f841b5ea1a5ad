"""What the command of a control law is made of: the record every law fills at every step, and telemetry sends (CONTROL_TERMS).

A law makes its record once and writes into it; who keeps it longer than a step copies it. Names are words of WKF_QUANTITY.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LOW, HIGH, RATE, INTEGRAL, HELD = 1, 2, 4, 8, 16  # WKF_LIMIT


def beyond(v: float, lo: float, hi: float) -> int:
    """LOW or HIGH for a number outside [lo, hi], 0 inside."""
    return LOW if v < lo else HIGH if v > hi else 0


@dataclass(slots=True)
class Output:
    """A quantity the law commands. What it asks for is proportional + integral + feedforward [unit]; `cut` [unit] of that is kept
    back by the limits named, so that asked - cut is sent."""

    name: str
    unit: str
    proportional: float = 0.0  # feedback of everything that is no integral
    integral: float = 0.0
    feedforward: float = 0.0  # trim, reference, wind: what does not wait for an error
    cut: float = 0.0
    limits: int = 0

    @property
    def sent(self) -> float:
        """What leaves the law [unit]."""
        return self.proportional + self.integral + self.feedforward - self.cut

    def give(self, proportional: float, integral: float, feedforward: float, sent: float, rate: int = 0) -> None:
        """The parts, and what was sent of their sum: what is less is cut at LOW or HIGH, or at `rate` (RATE)."""
        self.proportional, self.integral, self.feedforward = proportional, integral, feedforward
        asked = proportional + integral + feedforward
        cut = asked - sent
        if abs(cut) <= 1e-9 * abs(sent) or abs(cut) <= 1e-9 * max(abs(proportional), abs(integral), abs(feedforward)):
            self.cut, self.limits = 0.0, 0  # the sum in another order
        else:
            self.cut, self.limits = cut, rate or (HIGH if asked > sent else LOW)


@dataclass(slots=True)
class Controlled:
    """A quantity the law brings to its reference: error [unit], quantity less reference; its integral [unit s]."""

    name: str
    unit: str
    error: float = 0.0
    integral: float = 0.0
    limits: int = 0


@dataclass(slots=True)
class Scheduled:
    """Where the law stands in a gain schedule: value [unit], and its range of nodes; beyond it the gains are the edge's."""

    name: str
    unit: str
    lo: float = -math.inf
    hi: float = math.inf
    value: float = 0.0

    @property
    def limits(self) -> int:
        """LOW or HIGH outside the nodes."""
        return beyond(self.value, self.lo, self.hi)


@dataclass(slots=True)
class LawTerms:
    """One law's record. closed: the loop was closed in this step; False: a trim, or the last command held."""

    law: str
    outputs: tuple[Output, ...]
    controlled: tuple[Controlled, ...] = ()
    schedule: tuple[Scheduled, ...] = ()
    closed: bool = False

    def stand(self, *values: float) -> None:
        """Where it stands in its schedule, in the order of `schedule`."""
        for s, v in zip(self.schedule, values, strict=True):
            s.value = v

    def open(self) -> None:
        """Nothing is fed back in this step: all parts to zero, the schedule left alone."""
        self.closed = False
        for o in self.outputs:
            o.proportional = o.integral = o.feedforward = o.cut = 0.0
            o.limits = 0
        for c in self.controlled:
            c.error = c.integral = 0.0
            c.limits = 0


Laws = tuple[LawTerms, ...]  # of one aircraft, from the outer to the inner
