"""Fifth-order reference segments: position, velocity and acceleration continuous, at rest at the end."""

from __future__ import annotations

import math

from flightsw.types import Vec3


class Quintic:
    """Segment from (p0, v0, zero acceleration) to (p1, at rest) in T seconds, per axis."""

    def __init__(self, p0: Vec3, v0: Vec3, p1: Vec3, T: float) -> None:
        self.p0, self.v0, self.p1, self.T = p0, v0, p1, T
        self._c = []
        for a, v, b in zip(p0, v0, p1, strict=True):
            d = b - a - v * T
            e = -v * T
            # boundary values at s = 1: position b, velocity 0, acceleration 0
            self._c.append((10.0 * d - 4.0 * e, -15.0 * d + 7.0 * e, 6.0 * d - 3.0 * e))

    def at(self, t: float) -> tuple[Vec3, Vec3]:
        """Position [m] and velocity [m/s] at time t [s], held at the end point afterwards."""
        if t >= self.T:
            return self.p1, (0.0, 0.0, 0.0)
        s = max(t, 0.0) / self.T
        s2 = s * s
        s3 = s2 * s
        pos, vel = [], []
        for p, v, (c3, c4, c5) in zip(self.p0, self.v0, self._c, strict=True):
            pos.append(p + v * self.T * s + s3 * (c3 + s * (c4 + s * c5)))
            vel.append(v + s2 * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)) / self.T)
        return (pos[0], pos[1], pos[2]), (vel[0], vel[1], vel[2])


def duration(p0: Vec3, p1: Vec3, v_peak: float, t_min: float) -> float:
    """Time [s] of a rest-to-rest quintic over |p1 - p0| whose peak speed (15/8 of the mean) is v_peak [m/s]."""
    return max(t_min, 1.875 * math.dist(p0, p1) / v_peak)
