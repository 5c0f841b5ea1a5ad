"""Thrust command and elevator between leaving the mission and taking effect."""

from __future__ import annotations

from collections import deque

import numpy as np

from flightsw.missions.windshear import dynamics as k

ELEVATOR, THRUST = 1, 3  # in a command: [rad], [N]


class WindshearActuators:
    """Commands on their way: `now` [2] is thrust [kN] and elevator [rad] in force up to this tick."""

    def __init__(self, delay_ticks: int) -> None:
        self.now = np.zeros(k.NU)
        self._way: deque[tuple[float, float]] = deque([(0.0, 0.0)] * delay_ticks)

    def reset(self, surfaces: np.ndarray, thrust: float) -> None:
        """The aircraft comes with elevator surfaces[1] [rad] and thrust [N]."""
        came = (thrust * 1e-3, float(surfaces[ELEVATOR]))
        self.now[[k.TC, k.DE]] = came
        self._way = deque([came] * len(self._way))

    def step(self, u: np.ndarray, dt: float) -> None:
        """From the tick at which u [4] was sent to this one, dt [s] later."""
        self._way.append((float(u[THRUST]) * 1e-3, float(u[ELEVATOR])))
        self.now[[k.TC, k.DE]] = self._way.popleft()
