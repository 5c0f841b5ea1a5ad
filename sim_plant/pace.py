"""How fast simulated time goes in lockstep: flat out, at a multiple of the wall clock, not at all, or some ticks at a time.

Nothing that flies notices: in lockstep time is the stamp of a tick.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from flightsw.icd.dialect import VALUES
from flightsw.types import ACCEPTED, DENIED

CMD_PACE: int = VALUES["MAV_CMD_USER_4"]
PAUSE, RESUME, STEP, SPEED = range(4)  # WKF_PACE
SPEED_MAX, STEPS_MAX = 1000.0, 1_000_000
BEHIND_S = 0.5  # [s] what cannot be kept up is forgotten beyond this: no rush afterwards
REST_S = 0.05  # [s] between two looks while time stands still


class Pace:
    """`speed`: times real time, 0 flat out. `now` and `sleep` can be replaced for tests."""

    def __init__(
        self, rate_hz: int, now: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self.fixed = ""  # why it cannot be changed, "" if it can
        self.speed = 0.0
        self.paused = False
        self._steps = 0
        self._dt_s = 1.0 / rate_hz
        self._now, self._sleep = now, sleep
        self._due_s = 0.0

    def order(self, params: tuple[float, ...]) -> tuple[int, str]:
        """MAV_RESULT and reason of a MAV_CMD_USER_4: WKF_PACE, and its number (ticks to step, times real time)."""
        what, number = params[0], params[1]
        if self.fixed:
            return DENIED, self.fixed
        if what not in (PAUSE, RESUME, STEP, SPEED):
            return DENIED, f"pace {what:g}: allowed: 0 pause, 1 resume, 2 step, 3 speed"
        if what == STEP:
            ticks = number or 1.0
            if not (math.isfinite(ticks) and 1.0 <= ticks <= STEPS_MAX and ticks == int(ticks)):
                return DENIED, f"step {ticks:g}: allowed: 1 to {STEPS_MAX} ticks"
            self.paused, self._steps = True, self._steps + int(ticks)
        elif what == SPEED:
            if not (math.isfinite(number) and 0.0 <= number <= SPEED_MAX):
                return DENIED, f"speed {number:g}: allowed: 0 (flat out) to {SPEED_MAX:g} times real time"
            self.speed = number
        else:
            self.paused, self._steps = what == PAUSE, 0
        return ACCEPTED, ""

    def hold(self) -> bool:
        """True while the next tick may not be flown yet, after a rest; then wait for its turn and let it go."""
        if self.paused and not self._steps:
            self._sleep(REST_S)
            self._due_s = 0.0
            return True
        self._steps -= self._steps > 0
        if self.speed:
            now = self._now()
            if now - self._due_s > BEHIND_S:
                self._due_s = now
            self._due_s += self._dt_s / self.speed
            if (left := self._due_s - now) > 0.0:
                self._sleep(left)
        return False

    @property
    def stepping(self) -> bool:
        """Whether some ticks are to be flown yet before time stands still."""
        return self._steps > 0

    @property
    def words(self) -> str:
        """For a person; "" when flat out."""
        return "paused" if self.paused else f"held to {self.speed:g} x" if self.speed else ""
