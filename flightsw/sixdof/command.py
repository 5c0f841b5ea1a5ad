"""What both control laws share: parameters, command limits, integrators with anti-windup."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.sixdof.actuators import ActuatorModel, surface_limits, thrust_available
from flightsw.strict import Range

Pos = Annotated[float, Range(1e-9)]
Node3 = tuple[float, float, float]


@dataclass(frozen=True)
class ScheduleParams:
    """Nodes and timing of a gain schedule."""

    psi_dot_degps: Node3 = (-1.7, 0.0, 1.7)
    V_mps: tuple[float, float] = (180.0, 200.0)
    h_m: Pos = 7010.0
    mass_kg: Pos = 120000.0
    delay_s: Annotated[float, Range(0.0, 0.25)] = 0.015  # command to actuator, design value


class ControlCore:
    """Command assembly: previous command, integrals, saturation."""

    def __init__(self, ac: Aircraft, n_int: int, int_limit: np.ndarray) -> None:
        """`u_old` [k,4], newest first, is sized by the law once its design tells how many old commands it needs."""
        self.ac = ac
        self.lim = surface_limits(ac)
        self.u_old = np.zeros((1, 4))
        self.e = np.zeros(n_int)
        self.int_limit = int_limit
        self.saturated = False
        self.started = False

    def integrate(self, err: np.ndarray, dt: float) -> None:
        """Advance the integrals by err [n] * dt, clamped, and held while the command sits at a limit and would wind up."""
        for i in range(len(self.e)):
            step = err[i] * dt
            if not math.isfinite(step):  # one bad estimate must not live on in the integral
                continue
            if self.saturated and step * self.e[i] > 0.0:
                continue
            self.e[i] = min(max(self.e[i] + step, -self.int_limit[i]), self.int_limit[i])

    def limit(self, u: np.ndarray, h_m: float, V: float) -> tuple[np.ndarray, float]:
        """Clip u [4] (surfaces [rad], thrust [N]) to the actuators; returns (u, throttle 0..1). Sets `saturated`.

        Throttle is NaN when anything that went in is not finite.
        """
        if not (math.isfinite(h_m) and math.isfinite(V) and np.isfinite(u).all()):
            return u, math.nan  # the guard replaces it; the previous command and its memory stay
        avail = thrust_available(self.ac, h_m, V)
        floor = self.ac.engine.idle_frac * avail
        sat = False
        for i in range(3):
            lo, hi = self.lim[i, 0], self.lim[i, 1]
            if u[i] < lo or u[i] > hi:
                u[i] = min(max(u[i], lo), hi)
                sat = True
        if u[3] < floor or u[3] > avail:
            u[3] = min(max(u[3], floor), avail)
            sat = True
        self.saturated = sat
        self.u_old[1:] = self.u_old[:-1]
        self.u_old[0] = u
        return u, float(u[3] / avail)

    def actuator_states(self, z: np.ndarray, n: int, act: ActuatorModel) -> None:
        """Fill servo position, rate and thrust of the design state z from index n on."""
        z[n : n + 3] = act.pos
        z[n + 3 : n + 6] = act.rate
        z[n + 6] = act.thrust
