"""The load factor an elevator command leads to, kept within what the structure bears with a margin (docs/sources/recovery.md 10).

A law of station keeping answers a large error of its estimate with what its gains say, and a receiver bears no more than an upset
of a second of that. Within the limits the command passes unchanged, to the bit.
"""

from __future__ import annotations

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.jit import jit_own
from flightsw.sixdof.forces import force_moment
from flightsw.sixdof.params import IY, parameter_vector, set_mass
from flightsw.types import NavState, SensorFrame

AHEAD_S = 0.25  # [s] from where the surface has moved: of the receiver 0.4 s after the command
LEAST, MOST = 0.35, 0.6  # [-] of the smallest and largest load factor of the structure
STEP = 0.01  # [rad] the load is straight in the elevator


@jit_own
def load_ahead(
    u: np.ndarray, P: np.ndarray, V: float, beta: float, alpha: float, p: float, q: float, r: float, h: float,
    w: float, x: float, y: float, z: float, T: float,
) -> float:  # fmt: skip
    """Load factor [-] T [s] after surfaces have moved as u [4] commands; V [m/s], beta, alpha [rad], p, q, r [rad/s], h [m],
    attitude w, x, y, z of now.

    alpha'' = M/I_yy, alpha' = q + Z/(m V) + g cos/V of now; the lift then: n = -fz/g.
    """
    rho, fm = density(h), np.empty(9)
    down = w * w - x * x - y * y + z * z  # of gravity along body z
    force_moment(V, beta, alpha, p, q, r, u, rho, P, fm)
    q_dot = fm[4] / P[IY]
    then = alpha + T * (q + (fm[2] + G0 * down) / V) + 0.5 * T * T * q_dot
    force_moment(V, beta, then, p, q + T * q_dot, r, u, rho, P, fm)
    return -fm[2] / G0


class LoadLimit:
    """One aircraft's. `bound` after every step of a law."""

    def __init__(self, ac: Aircraft) -> None:
        least, most = ac.structure.load_g
        self.least, self.most = LEAST * least, MOST * most
        self.ac = ac
        self.acting = False  # in the last step,
        self.asked = 1.0  # and the load factor the command would have led to
        self._P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._fuel_us = 0
        lo, hi = ac.controls.elevator_deg
        self._range = float(np.radians(lo)), float(np.radians(hi))

    def bound(self, u: np.ndarray, f: SensorFrame, nav: NavState) -> np.ndarray:
        """Command u [4] (surfaces rad, thrust N), its elevator as near to it as the load allows; nav: the estimate it goes by."""
        if f.fuel_t_us > self._fuel_us:
            self._fuel_us = f.fuel_t_us
            set_mass(self._P, self.ac, self.ac.mass.empty_kg + f.fuel_kg)
        n = self.asked = self.load(u, nav)
        self.acting = not self.least <= n <= self.most
        if not self.acting:
            return u
        out = u.copy()
        out[1] += STEP
        slope = (self.load(out, nav) - n) / STEP
        wanted = min(max(n, self.least), self.most)
        elevator = u[1] + (wanted - n) / slope if slope < -1e-3 else u[1]
        out[1] = min(max(elevator, self._range[0]), self._range[1])
        return out

    def load(self, u: np.ndarray, nav: NavState) -> float:
        """Load factor [-] AHEAD_S after surfaces have moved as u [4] commands."""
        V, h = max(nav.V, 1.0), -nav.pos_n[2]
        return load_ahead(u, self._P, V, nav.beta, nav.alpha, *nav.w_b, h, *nav.q_nb, AHEAD_S)
