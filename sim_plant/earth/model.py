"""Earths by name, as the part of the kernels' parameter vector that describes one.

Constants: WGS-84 (NIMA TR8350.2): GM with the atmosphere, defining ellipsoid, rate of turning; J2 from its normalised second
zonal harmonic, -C20 sqrt 5. They and the equations: docs/sources/earth.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n

GM = 3.986004418e14  # [m^3/s^2]
A, F = 6378137.0, 1.0 / 298.257223563  # [m], [-]
OMEGA = 7.292115e-5  # [rad/s]
J2 = 0.484166774985e-3 * math.sqrt(5.0)  # [-]
R_SPHERE = 6371000.0  # [m] of an earth taken as a sphere


@dataclass(frozen=True)
class Earth:
    """Shape, gravity and rate of turning. `round` False: the flat earth of constant gravity, everything else unused."""

    round: bool = False
    radius_m: float = A  # equatorial
    flattening: float = 0.0
    j2: float = 0.0
    omega_radps: float = 0.0
    gm_m3ps2: float = GM

    def vector(self, lat0_deg: float) -> NDArray[np.float64]:
        """The entries P_ROUND .. P_MAP_E (kernels/layout.py) for a map whose origin is at this latitude [deg].

        The map is linear, as on the wire: metres north and east per radian are the radii of curvature M and N cos(lat) at the
        origin (earth.md 1, 2).
        """
        lat0 = math.radians(lat0_deg)
        e2 = self.flattening * (2.0 - self.flattening)
        w = math.sqrt(1.0 - e2 * math.sin(lat0) ** 2)
        north, east = self.radius_m * (1.0 - e2) / w**3, self.radius_m / w * math.cos(lat0)
        out = np.array(
            [float(self.round), self.gm_m3ps2, self.radius_m, e2, self.j2, self.omega_radps, lat0, north, east]
        )
        assert len(out) == n.P_MAP_E - n.P_ROUND + 1
        return out


EARTHS = {
    "flat": Earth(),
    "sphere": Earth(True, R_SPHERE),  # not turning
    "turning_sphere": Earth(True, R_SPHERE, omega_radps=OMEGA),
    "wgs84": Earth(True, A, F, J2, OMEGA),
}
