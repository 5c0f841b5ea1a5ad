"""The border between navigation axes (north-east) and the rendezvous frame R. Nothing else onboard converts.

R: origin at the control point, +x along heading `heading_rad` to the initial point the receiver comes from, +y 90 deg
counter-clockwise from it seen from above. Heading psi is counter-clockwise from +x and never wrapped; bank is positive LEFT.
(Aircraft: heading clockwise from north, bank positive right.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

# estimate of the receiver [4]: x [m], v_x [m/s], y [m], v_y [m/s] over ground
(E_X, E_VX, E_Y, E_VY, E_SIZE) = range(5)


@dataclass(slots=True)
class OwnState:
    """The tanker in R: position [m], heading psi [rad] unwrapped, bank left [rad], true airspeed, wind [m/s]."""

    x: float = 0.0
    y: float = 0.0
    psi: float = 0.0
    bank: float = 0.0
    speed: float = 200.0
    wind_x: float = 0.0
    wind_y: float = 0.0


@dataclass(frozen=True)
class RendezvousFrame:
    """Place and direction of R in the navigation frame."""

    north_m: float
    east_m: float
    heading_rad: float  # of +x, clockwise from north

    def to_r(self, north: float, east: float) -> tuple[float, float]:
        """(x, y) [m] of a position."""
        return self.vector_to_r(north - self.north_m, east - self.east_m)

    def to_n(self, x: float, y: float) -> tuple[float, float]:
        """(north, east) [m] of a position."""
        n, e = self.vector_to_n(x, y)
        return self.north_m + n, self.east_m + e

    def vector_to_r(self, north: float, east: float) -> tuple[float, float]:
        """(x, y) components of a horizontal vector (velocity, wind)."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * north + s * east, s * north - c * east

    def vector_to_n(self, x: float, y: float) -> tuple[float, float]:
        """(north, east) components of a horizontal vector."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * x + s * y, s * x - c * y

    def psi(self, heading_rad: float, near: float) -> float:
        """Heading in R [rad] of an aircraft heading (clockwise from north), the turn nearest to `near` [rad].

        Give the last psi as `near`, or 0 at the start: the result then runs on through pi.
        """
        a = self.heading_rad - heading_rad
        return a - 2.0 * math.pi * round((a - near) / (2.0 * math.pi))

    def heading(self, psi: float) -> float:
        """Aircraft heading [rad], clockwise from north in [0, 2 pi), of psi [rad]."""
        return (self.heading_rad - psi) % (2.0 * math.pi)

    @staticmethod
    def bank(roll_rad: float) -> float:
        """Bank in R (left positive) of an aircraft roll angle (right positive), and the other way round."""
        return -roll_rad

    def line_of_sight(self, bearing_rad: float, own_heading_rad: float) -> float:
        """Angle in R [rad] of a bearing measured clockwise from the own nose, in (-pi, pi]."""
        a = self.heading_rad - own_heading_rad - bearing_rad
        return a - 2.0 * math.pi * math.ceil((a - math.pi) / (2.0 * math.pi))
