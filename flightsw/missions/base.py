"""What the application asks of every mission. The answers given here are those of the six-degree-of-freedom aircraft; a
mission that brings its own aircraft or actuators gives others."""

from __future__ import annotations

from typing import Any

from flightsw.aircraft import Airframe, load_aircraft
from flightsw.models.actuators import ActuatorModel
from flightsw.nav.refusal import Refusals


class Mission:
    """Base of all missions. A mission has besides: params_type, watch, step, first_command, command, texts."""

    controls = 4  # length of a command: three surfaces [rad], thrust [N] (and a flap [rad])
    one_rate = False  # whether the mission runs at every base tick, and at no other rate
    air_used = 0  # AIR_* bits of health for the air-data readings it takes one by one; 0: whole probes
    cruise = (195.0, 7010.0)  # [m/s], [m] of the level flight the warm-up feeds it
    ctrl: Any

    @staticmethod
    def load(aircraft: str) -> Airframe:
        """Record of the aircraft. Raises ConfigError."""
        return load_aircraft(aircraft)

    @staticmethod
    def actuators(ac: Any, delay_ticks: int) -> Any:
        """Onboard copy of the actuators; `delay_ticks` base ticks pass between sending a command and its reaching them.

        Has reset(surfaces, thrust) and step(command, dt); what else is between it and the mission's step.
        """
        return ActuatorModel(ac, delay_ticks)

    @staticmethod
    def fuel_capacity(ac: Any) -> float:
        """Of the tanks whose gauge this kind of aircraft has [kg]; 0: none."""
        return float(ac.mass.fuel_capacity_kg)

    @property
    def refusals(self) -> Refusals | None:
        """What the navigation in force refuses of its sensors; None: it keeps no such account."""
        return None

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return bool(self.ctrl.core.saturated)
