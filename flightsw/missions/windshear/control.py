"""Control of the jet transport by nonlinear inverse dynamics in two time scales: thrust and elevator from state and demand."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from flightsw.aircraft import TwinJet, twinjet
from flightsw.kernels.linalg import finite
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import inversion as kn
from flightsw.missions.windshear.model import MODES, PathDemand, parameter_vector
from flightsw.plugins import EVERY_KEY, OursOr, made, refuse_ignored
from flightsw.strict import IN_FLIGHT, Range
from flightsw.terms import Controlled, LawTerms, Output

Array = np.ndarray
LIMIT_EDGE = 0.999  # share of the travel from which the elevator counts as limited


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
    law: Annotated[str, OursOr(("inversion",))] = "inversion"  # a PathLaw, made from (this table, aircraft)

    def vector(self) -> Array:
        """Gains [NG] of the kernel."""
        return np.array(
            [self.k_path_1ps, self.k_speed_1ps, self.k_alpha_1ps, self.k_rate_1ps, self.k_thrust_1ps]
            + [self.turn_max_radps, self.q_max_radps, self.elevator_max_rad, self.alpha_min_rad]
        )


@runtime_checkable
class PathLaw(Protocol):
    """What flies the demands of the guidance on path and speed. A pure step, as all algorithms. `u` [2]: commanded thrust [kN]
    and elevator [rad] now in force."""

    u: Array

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""

    def use(self, p: NidParams) -> None:
        """Fly by this table from now on."""

    def reset(self, thrust_kN: float, elevator_rad: float) -> None:
        """Begin with these controls in force."""

    def step(self, x: Array, demand: PathDemand) -> Array:
        """Controls u [2] for the estimated state x [15] (dynamics.py) and the demand."""

    def hold(self) -> Array:
        """Controls u [2] as they are: a step without an estimate."""


class WindshearControl:
    """`step` once per sample. `u` [2]: commanded thrust [kN] and elevator [rad] now in force (start: `reset`)."""

    obeys = EVERY_KEY

    def __init__(self, p: NidParams | None = None, ac: TwinJet | None = None) -> None:
        """ac: record of the aircraft (default: as published), whose elevator bounds elevator_max_rad. Raises nothing; parameters
        check themselves when they are read from a file."""
        p, ac = p or NidParams(), ac or twinjet()
        self._travel = math.radians(min(map(abs, ac.controls.elevator_deg)))
        self._par = parameter_vector(ac)
        self.use(p)
        self._d, self._out = np.zeros(kn.ND), np.zeros(kn.NO)
        self.u = np.zeros(k.NU)
        quantities = (
            ("path_rate", "rad/s"),
            ("incidence", "rad"),
            ("pitch_rate", "rad/s"),
            ("elevator", "rad"),
            ("thrust", "N"),
        )
        errors = (("airspeed", "m/s"), ("path_angle", "rad"), ("incidence", "rad"), ("pitch_rate", "rad/s"))
        self.terms = LawTerms("inversion", tuple(Output(*q) for q in quantities), tuple(Controlled(*q) for q in errors))

    def use(self, p: NidParams) -> None:
        """Fly by these gains from now on."""
        self.p = p = replace(p, elevator_max_rad=min(p.elevator_max_rad, self._travel))
        self._g = p.vector()

    def reset(self, thrust_kN: float, elevator_rad: float) -> None:
        """Begin with these controls in force (bumpless)."""
        self.u[[k.TC, k.DE]] = thrust_kN, elevator_rad

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
        usable = bool(x[k.VA] > 10.0)
        if usable:
            kn.invert(x, d, float(self.u[k.DE]), self._par, self._g, self._out)
            usable = finite(self._out[: kn.NC])
            if usable:
                self.u[[k.TC, k.DE]] = self._out[[kn.O_TC, kn.O_DE]]
        if not usable or demand.mode == "open":
            return self.hold()
        self._tell(x, demand)
        return self.u

    def hold(self) -> Array:
        """Controls u [2] as they are: nothing is fed back."""
        self.terms.open()
        *_, elevator, thrust = self.terms.outputs
        elevator.feedforward, thrust.feedforward = float(self.u[k.DE]), 1e3 * float(self.u[k.TC])
        return self.u

    @property
    def saturated(self) -> bool:
        """Whether the elevator is asked for more than its travel."""
        return bool(abs(self.u[k.DE]) > LIMIT_EDGE * self.p.elevator_max_rad)

    def _tell(self, x: Array, demand: PathDemand) -> None:
        """Into the record what the controls are made of, from the outer to the inner scale."""
        t, o = self.terms, self._out.tolist()
        path, incidence, rate, elevator, thrust = t.outputs
        t.closed = True
        path.give(o[kn.O_TURN], 0.0, 0.0, o[kn.O_TURN_C])
        incidence.give(0.0, 0.0, o[kn.O_ALPHA_D], o[kn.O_ALPHA])
        rate.give(o[kn.O_Q_FB], 0.0, o[kn.O_Q_FF], o[kn.O_Q_C])
        elevator.give(o[kn.O_DE_FB], 0.0, o[kn.O_DE_FF], o[kn.O_DE])
        approach = demand.mode == "approach"
        forward = o[kn.O_T_FF] + o[kn.O_T_LAG] if approach else o[kn.O_TC]
        thrust.give(1e3 * o[kn.O_T_FB], 0.0, 1e3 * forward, 1e3 * o[kn.O_TC])
        errors = (
            float(x[k.VA]) - demand.speed_mps if approach else 0.0, o[kn.O_PATH], float(x[k.AL]) - o[kn.O_ALPHA],
            float(x[k.Q]) - o[kn.O_Q_C],
        )  # fmt: skip
        for c, error in zip(t.controlled, errors, strict=True):
            c.error = error


OURS = {"inversion": WindshearControl}


def make_law(p: NidParams, ac: TwinJet) -> PathLaw:
    """The law p.law names. Raises ConfigError."""
    law = made(OURS, PathLaw, p.law, "ctrl.law", p, ac)  # type: ignore[type-abstract]
    refuse_ignored("ctrl.law", p.law, law.obeys, p)
    return law


def use_law(law: PathLaw, p: NidParams) -> None:
    """Fly by these gains from now on. Raises ConfigError for a key the law does not obey."""
    refuse_ignored("ctrl.law", p.law, law.obeys, p)
    law.use(p)
