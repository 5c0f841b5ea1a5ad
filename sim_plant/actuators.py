"""From flightsw's reply to the command the servos see: transport delay, jitter, and refusal of rubbish."""

from __future__ import annotations

import math
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
        if self._jitter and not self._draws:
            self._draws = np.asarray(self._rng.integers(0, self._jitter + 1, 1000)).tolist()
        self.silent = self.silent + 1 if cmd is None else 0
        extra = self._draws.pop() if self._jitter else 0
        if cmd is not None and cmd.armed:
            v = (cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle, cmd.latch, cmd.flap)
            if math.isfinite(v[0] + v[1] + v[2] + v[3] + v[5]):
                self._last_due = max(self._last_due, k + self._delay + extra)
                self._queue.append((self._last_due, v))
            else:
                self.refused += 1
        while self._queue and self._queue[0][0] <= k:
            self._asked = self._queue.popleft()[1]
        self.current = self._asked
