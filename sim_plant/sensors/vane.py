"""Vanes whose bearings rub: a vane stays in its bearing until the air's torque on it overcomes the friction.

The torque of the air about the pivot is q S l C' (a - z), a the direction of the air, z the vane's; Coulomb friction M holds it
while |a - z| < M / (q S l C'). The term `friction` is M / (S l C') [rad Pa], so that the angle is friction / q: what does not
show at 195 m/s does at 20. Vanes settle within a sample (their own lag follows), and so z is a kept within the angle to both
sides: play.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.sensors.base import View

Arr = NDArray[np.float64]


class Bearings:
    """Vanes of an aircraft's probes. friction [m, rad Pa]: by column of the air data (V, alpha, beta of probe 0, of probe 1,
    ...); 0: none, or an airspeed."""

    def __init__(self, friction: Arr) -> None:
        self.rubs = [(c, f) for c, f in enumerate(friction.tolist()) if f > 0.0]
        self.at: dict[int, float] = {}  # [rad] bearing by column; empty: nothing has been read

    def felt(self, true: list[float], view: View) -> list[float]:
        """The columns `true` [m] with the vanes' bearings in place of the directions of the air. The first finds them settled."""
        out, rho = true[:], isa(-view.s[n.S_P + 2])[2]
        for c, friction in self.rubs:
            q, a = 0.5 * rho * true[c - c % 3] ** 2, true[c]
            z = self.at.get(c, a)
            if q * abs(a - z) > friction:
                z = a + (friction / q if z > a else -friction / q)
            out[c] = self.at[c] = z
        return out
