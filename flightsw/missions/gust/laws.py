"""The gust mission's choice of law: hold, alleviation with flap and elevator, alleviation with the elevator alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.law import AlleviationParams, GustAlleviation, GustHold, HoldParams
from flightsw.missions.gust.model import GustAircraft, Turbulence
from flightsw.missions.gust.servos import Servos
from flightsw.plugins import OursOr, made
from flightsw.strict import ConfigError, Range
from flightsw.terms import Laws, LawTerms

Array = np.ndarray
LAWS = ("hold", "alleviation", "elevator")  # index: WKF_GUST_LAW, and param1 of MAV_CMD_USER_2
OTHER = len(LAWS)  # that of a law of somebody else, where ctrl.law names one
LIMIT_EDGE = 0.999  # share of the travel from which a command counts as limited


@dataclass(frozen=True)
class ElevatorParams(AlleviationParams):
    """Weights of the law with the elevator alone; what a file leaves out is its own default, not the other law's."""

    H: Annotated[float, Range(1e-3, 1e4)] = 50.0  # [m]
    V_K: Annotated[float, Range(1e-3, 1e4)] = 50.0  # [m/s]
    use_flap: bool = False


@dataclass(frozen=True)
class GustCtrlTable:
    """[ctrl] of a gust flight file."""

    law: Annotated[str, OursOr(LAWS)] = (
        "alleviation"  # else a FeedbackLaw, made from (this table, aircraft, turbulence, sample period, samples of delay)
    )
    alleviation: AlleviationParams = field(default_factory=AlleviationParams)
    elevator: ElevatorParams = field(default_factory=ElevatorParams)
    hold: HoldParams = field(default_factory=HoldParams)

    def __post_init__(self) -> None:
        """Raises ConfigError for what is given from elsewhere or has no place in a law."""
        for name, q in (("alleviation", self.alleviation), ("elevator", self.elevator)):
            if q.late_steps != AlleviationParams.late_steps:
                raise ConfigError(
                    f"ctrl.{name}.late_steps = {q.late_steps}: given by link.delay_ticks; allowed: left out"
                )
        if self.elevator.use_flap or self.elevator.flap != AlleviationParams.flap:
            raise ConfigError(
                "ctrl.elevator.use_flap, flap: this law has no flap; allowed: left out, or use_flap = false"
            )


@runtime_checkable
class FeedbackLaw(Protocol):
    """What makes commands of the estimate. A pure step, as all algorithms. `a_z` [m/s^2]: what the law takes a_z to be."""

    a_z: float

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of; one object, which is opened while another law flies."""

    def reset(self) -> None:
        """Another law has flown since the last step."""

    def step(self, x: Array, servos: Servos) -> Array:
        """Command [3] (elevator [rad], throttle setting, flap [rad]) for the estimate x [9] and the servos as they now are,
        limited to the travel."""


NOT_OURS: dict[str, Callable[[GustCtrlTable, GustAircraft, Turbulence, float, int], FeedbackLaw]] = {}


class GustLaws:
    """All laws, one of them flying. `law` is its index in LAWS, or OTHER; `a_z` [m/s^2] what the flying law takes a_z to be."""

    def __init__(
        self, p: GustCtrlTable, ac: GustAircraft, t: Turbulence, dt: float, late_steps: int,
        servos: Sequence[tuple[float, int]] = (), lifts: Sequence[float] = (0.0,),
    ) -> None:  # fmt: skip
        """dt [s]: sample period; late_steps: samples from command to servo; servos, lifts: what `fit` may ask for besides, as
        GustAlleviation. Raises DesignError."""
        self.ac = ac
        self.hold = GustHold(p.hold, ac)
        self._ours = {
            LAWS.index(name): GustAlleviation(replace(q, late_steps=late_steps), ac, t, dt, name, servos, lifts)
            for name, q in (("alleviation", p.alleviation), ("elevator", replace(p.elevator, use_flap=False)))
        }
        self._feedback: dict[int, FeedbackLaw] = {**self._ours}
        self.words: tuple[str, ...] = LAWS
        if p.law not in LAWS:
            other = made(NOT_OURS, FeedbackLaw, p.law, "ctrl.law", p, ac, t, dt, late_steps)  # type: ignore[type-abstract]
            self._feedback[OTHER] = other
            self.words = (*LAWS, other.terms.law)
        self.law = LAWS.index(p.law) if p.law in LAWS else OTHER
        self.flying = 0  # what gave the last command: the hold without an estimate
        self.a_z = 0.0
        self.saturated = False

    @property
    def terms(self) -> Laws:
        """Records of all laws; those that do not fly are open."""
        return self.hold.terms, *(core.terms for core in self._feedback.values())

    def select(self, law: int) -> None:
        """Fly another law from the next step on. Raises ValueError for a number that is none."""
        if not 0 <= law < len(self.words):
            raise ValueError(f"law {law}: allowed 0 to {len(self.words) - 1} ({', '.join(self.words)})")
        self.law = law

    def fit(self, wn_radps: float, late: int, lift: float) -> None:
        """The alleviating laws of this project fly the gain of these servos and this lift scale, less one, from the next step on.
        Raises KeyError for servos not named to the constructor."""
        for law in self._ours.values():
            law.fit(wn_radps, late, lift)

    def step(self, x: Array | None, y: Array, servos: Servos) -> Array:
        """Command [3] (elevator [rad], throttle setting, flap [rad]; reused) for the estimate x [9] or None, readings y [7]."""
        flying = self.law if x is not None else 0
        core = self._feedback.get(flying)
        if core is not None and flying != self.flying:
            core.reset()
        self.flying = flying
        if core is None or x is None:
            command = self.hold.step(y[k.Y_Q], y[k.Y_TH], y[k.Y_H] - self.ac.H0_m, y[k.Y_VA] - self.ac.V0_mps)
            self.a_z = 0.0
        else:
            command = core.step(x, servos)
            self.a_z = core.a_z
        e, f = self.ac.elevator_limit_rad, self.ac.flap_limit_rad
        for law, terms in enumerate(self.terms):
            if law != flying:
                terms.open()
        self.saturated = abs(command[k.ELEVATOR]) > LIMIT_EDGE * e or abs(command[k.FLAP]) > LIMIT_EDGE * f
        return command
