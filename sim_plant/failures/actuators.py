"""What a failing surface or throttle makes of the command in force, tick by tick, before the servos see it.

The servo stays: a runaway moves to its stop at the servo's rate. A jam is no matter of the command: the kinds of aircraft hold
the surface where it is.
"""

from __future__ import annotations

import math

from flightsw.aircraft.base import Controls
from sim_plant.actuators import Values
from sim_plant.aircraft.kind import SURFACES
from sim_plant.failures.script import Event
from sim_plant.kernels import layout as n
from sim_plant.sensors.base import View

FLOAT = 0.5  # [-] angle a free surface trails at, over that of the flow: ratio of the hinge-moment slopes, an estimate
SLOW = math.radians(5.0)  # [rad/s]
PLAY = math.radians(1.0)  # [rad] between the stops
THROTTLE = 3  # place in Values
DEFAULT = {"hardover": 1.0, "float": FLOAT, "slow": SLOW, "play": PLAY}


def place(surface: str, controls: Controls) -> tuple[int, tuple[float, float]]:
    """Where a surface stands among Values, and its travel [rad]. Flaps take the place of ailerons that are not there."""
    i, travel = SURFACES.index(surface), getattr(controls, f"{surface}_deg")
    if not i and travel == (0.0, 0.0):
        i, travel = 5, controls.flap_deg
    return i, (math.radians(travel[0]), math.radians(travel[1]))


class Bent:
    """One surface: "hardover" to the stop on the side of the value's sign; "float" in the flow, value: ratio; "slow", value: rate
    [rad/s]; "play", value: gap [rad], of which the surface lies anywhere within."""

    def __init__(self, e: Event, controls: Controls, dt_s: float) -> None:
        self.at, self._travel = place(e.surface, controls)
        self._kind, self._surface = e.kind, e.surface
        self._value = e.value[0] if e.value else DEFAULT[e.kind]
        self._step = self._value * dt_s
        self._last: float | None = None
        self._flow = 0.0

    def _off(self, view: View) -> float:
        """Where a free surface would lie in the flow [rad]: both ailerons rise together."""
        flow = {"elevator": -view.o[n.O_ALPHA], "rudder": view.o[n.O_BETA]}
        return flow.get(self._surface, 0.0)

    def act(self, x: float, view: View) -> float:
        """What the servo is told instead of x [rad]."""
        if self._kind == "hardover":
            return self._travel[self._value > 0.0]
        if self._last is None:
            self._last, self._flow = x, self._off(view)
        if self._kind == "float":  # trimmed: the tab holds it where it was, and the flow moves it from there
            free = self._last + self._value * (self._off(view) - self._flow)
            return min(max(free, self._travel[0]), self._travel[1])
        most = self._step if self._kind == "slow" else math.inf
        least = 0.0 if self._kind == "slow" else 0.5 * self._value
        off = x - self._last
        off = math.copysign(min(max(abs(off) - least, 0.0), most), off)
        self._last += off
        return self._last


class Held:
    """The throttle stays where it was."""

    at = THROTTLE

    def __init__(self) -> None:
        self._last: float | None = None

    def act(self, x: float, view: View) -> float:
        """The first x seen."""
        if self._last is None:
            self._last = x
        return self._last


def bend(values: Values, faults: list[Bent | Held], view: View) -> Values:
    """The command in force as the faults leave it."""
    row = list(values)
    for f in faults:
        row[f.at] = f.act(row[f.at], view)
    a, e, r, t, _, flap = row
    return a, e, r, t, values[4], flap
