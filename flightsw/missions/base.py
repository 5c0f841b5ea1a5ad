"""What the application asks of every mission. The answers given here are those of the six-degree-of-freedom aircraft; a
mission that brings its own aircraft or actuators gives others."""

from __future__ import annotations

from typing import Any

from flightsw.aircraft import Airframe, load_aircraft
from flightsw.refusal import Refusals
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.types import UNSUPPORTED, Command


class Mission:
    """Base of all missions. A mission has besides: params_type, watch, step, first_command, texts."""

    commands: frozenset[int] = frozenset()  # MAV_CMD it takes
    controls = 4  # length of a command: three surfaces [rad], thrust [N] (and a flap [rad])
    one_rate = False  # whether the mission runs at every base tick, and at no other rate
    air_used = 0  # AIR_* bits of health for the air-data readings it takes one by one; 0: whole probes
    cruise = (195.0, 7010.0)  # [m/s], [m] of the level flight the warm-up feeds it
    watch: int  # HF_* flags of what the aircraft depends on now
    ctrl: Any

    @property
    def may_watch(self) -> int:
        """HF_* flags it depends on at one time or another."""
        return self.watch

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

    def command(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT of a ground command, and why it is refused."""
        if c.command not in self.commands:
            return UNSUPPORTED, f"command {c.command} is not one of this mission"
        return self.obey(c)

    def obey(self, c: Command) -> tuple[int, str]:
        """The same for one of `commands`."""
        raise NotImplementedError

    @property
    def refusals(self) -> Refusals | None:
        """What the navigation in force refuses of its sensors; None: it keeps no such account."""
        return None

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return bool(self.ctrl.core.saturated)
