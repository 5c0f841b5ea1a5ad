"""A witness for airspeed and vane: the lift that is felt. It knows the lift curve and neither the filter nor the wind."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.windshear import dynamics as k

Array = np.ndarray
NEEDED = 1 << k.Y_VA | 1 << k.Y_AL | 1 << k.Y_TH | 1 << k.Y_HDD
LEARN_S, SMOOTH_S = 10.0, 2.0  # [s] in which the ratio of both airspeeds is learnt; low-pass of what is compared


class LiftWitness:
    """`step` once per sample. Compared is the airspeed as read with the one whose lift at the incidence as read carries what is
    felt; their ratio at the start (scale of lift, fixed errors) is taken for right."""

    def __init__(self, most: float, held_s: float, par: Array) -> None:
        """most [-]: change of the ratio that is tolerated, for held_s [s]; par [NP] (dynamics.py)."""
        self.most, self.held_s, self._par = most, held_s, par
        self._log = self._first = self._age_s = self._odd_s = 0.0

    @property
    def apart(self) -> float:
        """How far both are, of what is tolerated [-]."""
        return abs(self._log - self._first) / self.most if self._age_s >= LEARN_S else 0.0

    def step(self, z: Array, ok: int, thrust_kN: float, dt: float) -> bool:
        """Whether both have come apart: readings z [>=9] with bits `ok`, thrust [kN]. A sample without one of
        them changes nothing."""
        if ok & NEEDED != NEEDED:
            return self._odd_s > self.held_s
        p = self._par
        carried = p[k.P_M] * (p[k.P_G] + z[k.Y_HDD]) - 1e3 * thrust_kN * math.sin(z[k.Y_TH])
        cl = float(k.lift_curve(z[k.Y_AL], p))
        if not (carried > 0.0 and cl > 0.0 and z[k.Y_VA] > 0.0):
            return self._odd_s > self.held_s
        by_lift = math.sqrt(2.0 * carried / (p[k.P_RHO] * p[k.P_S] * cl))
        now = math.log(z[k.Y_VA] / by_lift)
        self._age_s += dt
        self._log += (now - self._log) * min(dt / min(SMOOTH_S, self._age_s), 1.0)
        if self._age_s < LEARN_S:
            self._first += (now - self._first) * min(dt / self._age_s, 1.0)
            return False
        self._odd_s = self._odd_s + dt if self.apart > 1.0 else 0.0
        return self._odd_s > self.held_s
