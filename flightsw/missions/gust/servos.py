"""What the gust mission believes its elevator and flap are doing: second-order servos driven by the commands sent."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.model import GustAircraft, published
from flightsw.sixdof.actuators import servo_step

Array = np.ndarray
PARTS = 4  # the mean deflection over a step is taken over this many parts


class Servos(Protocol):
    """Servos as a law looks at them: where they are and what is under way to them."""

    @property
    def now(self) -> Array:
        """Surfaces [3] at this sample: elevator [rad], throttle setting, flap [rad]."""

    @property
    def rate(self) -> Array:
        """Their rates [3]."""

    @property
    def queue(self) -> Array:
        """Commands under way [late,3], row 0 reaches the servos with the next step."""


def surface_limits(ac: GustAircraft) -> Array:
    """Limits [3,3] of elevator, throttle, flap as `servo_step` takes them: lower, upper [rad], rate [rad/s]."""
    e, f = ac.elevator_limit_rad, ac.flap_limit_rad
    return np.array([[-e, e, ac.elevator_rate_radps], [0.0, 0.0, ac.elevator_rate_radps], [-f, f, ac.flap_rate_radps]])


class GustServos:
    """`now`, `mean` [3] (elevator [rad], throttle [-], flap [rad]) and `rate` [3] after `step`; commands act late_steps late."""

    def __init__(self, ac: GustAircraft | None = None, *, late_steps: int = 1) -> None:
        """late_steps: steps between sending a command and its reaching the servos, >= 0. Raises ValueError below 0."""
        if late_steps < 0:
            raise ValueError(f"late_steps = {late_steps}; allowed >= 0")
        self.ac = ac or published()
        self._lim = surface_limits(self.ac)
        self._fifo = np.zeros((late_steps + 1, 3))
        self.now, self.mean, self.rate = np.zeros(3), np.zeros(3), np.zeros(3)

    @property
    def queue(self) -> Array:
        """Commands under way [late_steps,3] before the next `send`: row 0 reaches the servos with the next step."""
        return self._fifo[1:]

    @property
    def sent(self) -> Array:
        """The command [3] sent last."""
        *_, last = self._fifo
        return np.asarray(last)

    def reset(self) -> None:
        """All at trim."""
        for a in (self._fifo, self.now, self.mean, self.rate):
            a[:] = 0.0

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        return {"fifo": self._fifo.copy(), "now": self.now.copy(), "mean": self.mean.copy(), "rate": self.rate.copy()}

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state`."""
        self._fifo[:], self.now[:], self.mean[:], self.rate[:] = s["fifo"], s["now"], s["mean"], s["rate"]

    def send(self, command: Array) -> None:
        """Enter the command [3] computed now; call once per step, before `step`."""
        self._fifo[:-1] = self._fifo[1:]
        self._fifo[-1] = command

    def step(self, dt: float) -> None:
        """Advance to the next sample, dt [s] later; `mean` is the mean deflection on the way."""
        c = self._fifo[0]
        self.mean[:] = 0.0
        self.now[k.THROTTLE] = c[k.THROTTLE]
        for _ in range(PARTS):
            self.mean += self.now * (0.5 / PARTS)
            servo_step(self.now, self.rate, c, self._lim, self.ac.servo_wn_radps, self.ac.servo_zeta, dt / PARTS)
            self.now[k.THROTTLE] = c[k.THROTTLE]  # the throttle has no servo: at once
            self.mean += self.now * (0.5 / PARTS)
