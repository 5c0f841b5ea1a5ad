"""From flightsw's reply to the command the servos see: transport delay, jitter, and refusal of rubbish."""

from __future__ import annotations

from collections import deque

import numpy as np

from flightsw.types import ActuatorCmd
from sim_plant.rng import generator

Values = tuple[float, float, float, float, bool, float]  # aileron, elevator, rudder [rad], throttle, latch, flap [rad]


class CommandPath:
    """Commands of tick k take effect at tick k + delay + jitter, jitter uniform in 0..j per tick, order preserved.

    A reply that is not armed or holds a non-finite number changes nothing: the last command stays (at the start the
    trim).
    """

    def __init__(self, seed: int, name: str, delay: int, jitter: int, trim: Values) -> None:
        self._delay, self._jitter = delay, jitter
        self._rng = generator(seed, f"{name}.actuator_jitter")
        self._draws: list[int] = []
        self._queue: deque[tuple[int, Values]] = deque()
        self._last_due = 0
        self._asked = trim
        self.current = trim  # what was asked for; whoever bends it does so after each push
        self.refused = 0  # non-finite replies
        self.silent = 0  # ticks since a reply came, armed or not

    @property
    def latch(self) -> bool:
        """Whether the command in force asks for the latch."""
        return self.current[4]

    def push(self, k: int, cmd: ActuatorCmd | None) -> None:
        """Take the reply to tick k (None: no reply) and make `current` the command in force during tick k."""
        extra = 0
        if self._jitter:
            if not self._draws:
                self._draws = np.asarray(self._rng.integers(0, self._jitter + 1, 1000)).tolist()
            extra = self._draws.pop()
        queue = self._queue
        if cmd is None:
            self.silent += 1
        else:
            self.silent = 0
            if cmd.armed:
                a, e, r, t, flap = cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle, cmd.flap
                some = a + e + r + t + flap
                if some - some == 0.0:  # finite
                    due = k + self._delay + extra
                    if due > self._last_due:
                        self._last_due = due
                    queue.append((self._last_due, (a, e, r, t, cmd.latch, flap)))
                else:
                    self.refused += 1
        while queue and queue[0][0] <= k:
            self._asked = queue.popleft()[1]
        self.current = self._asked
