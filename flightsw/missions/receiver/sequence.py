"""Refuelling phases one after the other by rule: observation, pre-contact, contact, disconnect, observation.

The rules give the same orders as the ground would. A breakaway or a command from the ground ends the sequence: from then on
the ground decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.missions.receiver.refuel import ACTIONS, BREAKAWAY, CONTACT, OBSERVATION, PRECONTACT
from flightsw.strict import IN_FLIGHT, Range
from flightsw.types import SensorFrame

Wait = Annotated[float, Range(0.0, 86400.0), IN_FLIGHT]
NUMBER = {name: k for k, name in ACTIONS.items()}
NOTHING = 0


@dataclass(frozen=True)
class SequenceParams:
    """How long the receiver rests in each phase before the next one is ordered."""

    auto: bool = False
    observe_s: Wait = 20.0
    precontact_s: Wait = 20.0
    contact_s: Wait = 300.0  # at most
    fuel_kg: Annotated[float, Range(0.0, 1e6), IN_FLIGHT] = (
        0.0  # disconnect once the gauge shows this with the boom in; 0: time decides
    )
    leave_s: Wait = 10.0  # at pre-contact after the disconnect, before the return to observation


class Sequence:
    """The order that is due, from the phase and the time the receiver has rested in it."""

    def __init__(self, p: SequenceParams) -> None:
        self.p = p
        self.on = p.auto
        self.refuelled = False
        self._phase = -1
        self._rest_s = 0.0

    def step(self, f: SensorFrame, phase: int, at_rest: bool, dt: float) -> int:
        """Action (1..6) due in `phase`, or 0; at_rest: no segment of the path is being flown."""
        if phase == BREAKAWAY:
            self.on = False
        if phase != self._phase:
            self._phase, self._rest_s = phase, 0.0
        self._rest_s += dt if at_rest else 0.0
        name = self._due(f) if self.on else ""
        return NUMBER[name] if name else NOTHING

    def _due(self, f: SensorFrame) -> str:
        p, t = self.p, self._rest_s
        if self._phase == OBSERVATION and not self.refuelled and t >= p.observe_s:
            return "precontact"
        if self._phase == PRECONTACT and self.refuelled and t >= p.leave_s:
            return "observation"
        if self._phase == PRECONTACT and not self.refuelled and t >= p.precontact_s:
            return "contact"
        full = f.boom_contact and 0.0 < p.fuel_kg <= f.fuel_kg
        if self._phase == CONTACT and (t >= p.contact_s or full):
            self.refuelled = True
            return "disconnect"
        return ""
