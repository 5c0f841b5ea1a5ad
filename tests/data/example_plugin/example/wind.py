"""Wind by the triangle: velocity over ground less velocity through the air, averaged over `tau_s`.

w = v_gnss - C_nb u_air,  u_air = V [cos(alpha) cos(beta), sin(beta), sin(alpha) cos(beta)]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.kernels.rotations import dcm_from_quat, to_parent
from flightsw.strict import Range
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, SensorFrame


@dataclass(frozen=True)
class WindParams:
    """[nav] of the flight file."""

    tau_s: Annotated[float, Range(0.1, 300.0)] = 8.0  # of the average
    bias_mps: Annotated[float, Range(0.0, 10.0)] = (
        0.7  # lasting error of airspeed, vanes and attitude, 1-sigma per axis
    )
    settle_s: Annotated[float, Range(0.0, 300.0)] = 5.0  # of readings before the wind may be used
    silent_s: Annotated[float, Range(0.1, 60.0)] = 2.0  # without readings after which it may not


class TriangleWind:
    """Mean `wind` [3] m/s NED, its 1-sigma `sigma` [3], `valid` and the `reason` why it is not."""

    def __init__(self, p: WindParams) -> None:
        self.p = p
        self.wind, self.var = np.zeros(3), np.zeros(3)
        self.seen_s = 0.0  # [s] of readings so far
        self.since_s = math.inf  # [s] since the last one
        self.C = np.eye(3).ravel()  # body to NED
        self._u, self._a = np.zeros(3), np.zeros(3)
        self._now = 0  # readings that are at hand: UPD_*

    @property
    def valid(self) -> bool:
        """Whether the wind may be used."""
        return self.seen_s >= self.p.settle_s and self.since_s < self.p.silent_s

    @property
    def reason(self) -> str:
        """Why not; "" if it may."""
        if self.valid:
            return ""
        return "settling" if self.since_s < self.p.silent_s else "no air data, attitude or GNSS"

    @property
    def sigma(self) -> np.ndarray:
        """1-sigma [3] m/s: scatter of the average, and what lasts in the sensors."""
        return np.sqrt(self.var + self.p.bias_mps**2)

    def step(self, f: SensorFrame, updated: int, dt: float) -> None:
        """Take the readings of frame f of which `updated` are new, dt [s] after the last step."""
        self.since_s += dt
        self._now |= updated
        if updated & UPD_ATT:
            dcm_from_quat(np.array(f.att_q_nb), self.C)
        need = UPD_AIR | UPD_ATT | UPD_GNSS
        if self._now & need != need or not f.air_mask & 1:
            return
        self._now = 0
        V, alpha, beta = f.air_V[0], f.air_alpha[0], f.air_beta[0]
        cb = math.cos(beta)
        self._u[:] = V * math.cos(alpha) * cb, V * math.sin(beta), V * math.sin(alpha) * cb
        to_parent(self.C, self._u, self._a)
        w = np.array(f.gnss_vel_n) - self._a
        since = min(self.since_s, 1.0)
        k = 1.0 if self.seen_s == 0.0 else 1.0 - math.exp(-since / self.p.tau_s)
        e = w - self.wind
        self.wind += k * e
        self.var += k * (e * e * k - self.var)  # of the average, not of one reading
        self.seen_s += since
        self.since_s = 0.0
