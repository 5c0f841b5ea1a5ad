"""Errors of an aircraft's wind as an airman reads it, in size and direction, before it has turned and after."""

from __future__ import annotations

import math

import numpy as np

from sim_plant.kernels.rot import euler_from_quat
from sim_plant.truth import Truth

TURNED = math.radians(90.0)


class Winds:
    """One aircraft's."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._heading: float | None = None
        self._turned = 0.0  # [rad]
        self.rows: list[
            tuple[float, float, bool]
        ] = []  # size [%], direction [rad], whether a quarter of a circle is behind it

    def look(self, r: Truth) -> None:
        """Follow the heading."""
        psi = euler_from_quat(*r.q_nb)[0]
        if self._heading is not None:
            self._turned += math.remainder(psi - self._heading, math.tau)
        self._heading = psi

    def note(self, estimate: tuple[float, ...], r: Truth) -> None:
        """An estimate [m/s] of NED beside the truth of its time."""
        (n, e), (tn, te) = estimate[:2], r.wind_n[:2]
        size = 100.0 * (math.hypot(n, e) / math.hypot(tn, te) - 1.0)
        angle = math.remainder(math.atan2(e, n) - math.atan2(te, tn), math.tau)
        self.rows.append((size, angle, abs(self._turned) >= TURNED))

    def figures(self) -> dict[str, float]:
        """RMS of size [%] and direction [deg], straight and once turned; nothing of what was not flown."""
        out = {}
        for key, turned in (("straight", False), ("turned", True)):
            a = np.array([(s, d) for s, d, t in self.rows if t == turned])
            if len(a):
                out[f"wind.{self.name}.{key}.size_rms_pct"] = float(np.sqrt(np.mean(a[:, 0] ** 2)))
                out[f"wind.{self.name}.{key}.direction_rms_deg"] = math.degrees(float(np.sqrt(np.mean(a[:, 1] ** 2))))
        return out
