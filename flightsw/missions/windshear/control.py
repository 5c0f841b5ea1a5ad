"""Control of the jet transport by nonlinear inverse dynamics in two time scales: thrust and elevator from state and demand."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from flightsw.aircraft import TwinJet, twinjet
from flightsw.missions.windshear import inversion as kn
from flightsw.missions.windshear.model import MODES, PathDemand, parameter_vector
from flightsw.strict import IN_FLIGHT, Range

Array = np.ndarray


@dataclass(frozen=True)
class NidParams:
    """Gains and limits; jing.md 3.4 and section 4."""

    k_path_1ps: Annotated[float, Range(0.01, 10.0), IN_FLIGHT] = 0.8
    k_speed_1ps: Annotated[float, Range(0.01, 10.0), IN_FLIGHT] = 0.2
    k_alpha_1ps: Annotated[float, Range(0.1, 20.0), IN_FLIGHT] = 2.5
    k_rate_1ps: Annotated[float, Range(0.1, 40.0), IN_FLIGHT] = 6.0
    k_thrust_1ps: Annotated[float, Range(0.1, 20.0), IN_FLIGHT] = 1.5
    turn_max_radps: Annotated[float, Range(0.001, 1.0)] = 0.05
    q_max_radps: Annotated[float, Range(0.01, 1.0)] = 0.12
    elevator_max_rad: Annotated[float, Range(0.05, 1.0)] = 0.35
    alpha_min_rad: Annotated[float, Range(-0.3, 0.1)] = -0.08

    def vector(self) -> Array:
        """Gains [NG] of the kernel."""
        return np.array(
            [self.k_path_1ps, self.k_speed_1ps, self.k_alpha_1ps, self.k_rate_1ps, self.k_thrust_1ps]
            + [self.turn_max_radps, self.q_max_radps, self.elevator_max_rad, self.alpha_min_rad]
        )


class WindshearControl:
    """`step` once per sample. `u` [2]: commanded thrust [kN] and elevator [rad] now in force (start: `reset`)."""

    def __init__(self, p: NidParams | None = None, ac: TwinJet | None = None) -> None:
        """ac: record of the aircraft (default: as published), whose elevator bounds elevator_max_rad. Raises nothing; parameters
        check themselves when they are read from a file."""
        p, ac = p or NidParams(), ac or twinjet()
        self._travel = math.radians(min(map(abs, ac.controls.elevator_deg)))
        self._par = parameter_vector(ac)
        self.use(p)
        self._d, self._out = np.zeros(kn.ND), np.zeros(kn.NO)
        self.u = np.zeros(2)

    def use(self, p: NidParams) -> None:
        """Fly by these gains from now on."""
        self.p = p = replace(p, elevator_max_rad=min(p.elevator_max_rad, self._travel))
        self._g = p.vector()

    def reset(self, thrust_kN: float, elevator_rad: float) -> None:
        """Begin with these controls in force (bumpless)."""
        self.u[:] = thrust_kN, elevator_rad

    @property
    def alpha_c(self) -> float:
        """Incidence commanded last [rad]."""
        return float(self._out[kn.O_ALPHA])

    def step(self, x: Array, demand: PathDemand) -> Array:
        """Controls u [2] for the estimated state x [15] (dynamics.py) and the demand. Holds u when x is not usable."""
        d = self._d
        d[kn.D_MODE] = MODES.index(demand.mode)
        d[kn.D_CLIMB], d[kn.D_SPEED] = demand.climb_mps, demand.speed_mps
        d[kn.D_PITCH], d[kn.D_AMAX] = demand.pitch_rad, demand.alpha_max_rad
        if x[2] > 10.0:
            kn.invert(x, d, float(self.u[1]), self._par, self._g, self._out)
            if np.isfinite(self._out).all():
                self.u[:] = self._out[kn.O_TC], self._out[kn.O_DE]
        return self.u
