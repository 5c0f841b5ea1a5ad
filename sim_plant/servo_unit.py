"""What the servo unit of an aircraft does by itself when its onboard computer has said nothing for some ticks.

It has a gyro and a vertical reference of its own, as an autopilot's standby has, with constant errors drawn once per run.
"""

from __future__ import annotations

import math

from flightsw.aircraft.base import HOLD, LEVEL, Controls
from sim_plant.actuators import Values
from sim_plant.kernels import layout as n
from sim_plant.rng import generator
from sim_plant.sensors.base import View

GAIN = 0.3  # [rad/rad] and [rad per rad/s] of attitude and rates to surfaces
TILT, RATE = (
    math.radians(1.0),
    math.radians(0.3),
)  # [rad], [rad/s] 1 sigma of its reference and gyro: our choice for a standby
BANK_MOST = math.radians(45.0)  # what is fed back at most: a large upset must not saturate what damps it


class ServoUnit:
    """`controls.silent` of one aircraft file; `trim`: the command that holds the start; `seed`, `name`: of run and aircraft."""

    def __init__(self, controls: Controls, trim: Values, seed: int, name: str) -> None:
        unit = generator(seed, f"{name}.servo_unit").standard_normal(5).tolist()
        self._tilt, self._drift = [TILT * x for x in unit[:2]], [RATE * x for x in unit[2:]]  # pitch, bank; p, q, r
        self.after, self._then = controls.silent_ticks, controls.silent
        self._trim = (*trim[:3], trim[3] * controls.silent_throttle, *trim[4:])
        self._pitch = self._lower = math.radians(controls.silent_pitch_deg)

    def begin(self, view: View) -> None:
        """Take the attitude of the start as that of the trim."""
        self._pitch = view.o[n.O_EULER + 1] + self._tilt[0] + self._lower

    def command(self, last: Values, view: View) -> Values:
        """The command in force during silence; `last` was before. The boom's latch is let go by all but "hold"."""
        if self._then == HOLD:
            return last
        aileron, elevator, rudder, throttle, _, flap = self._trim
        if self._then == LEVEL:
            pitch, bank = (x + e for x, e in zip(view.o[n.O_EULER + 1 : n.O_EULER + 3], self._tilt, strict=True))
            p, q, r = (x + e for x, e in zip(view.s[n.S_W : n.S_W + 3], self._drift, strict=True))
            aileron -= GAIN * (min(max(bank, -BANK_MOST), BANK_MOST) + p)  # positive rolls right
            elevator += GAIN * (pitch - self._pitch + q)  # positive pitches down
            rudder += GAIN * r  # positive yaws left
        return aileron, elevator, rudder, throttle, False, flap
