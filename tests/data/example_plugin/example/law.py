"""Course, altitude and airspeed by cascaded loops around a trim; gains per radian and metre, made for the Navion at its trim."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import wrap_pi
from flightsw.sixdof.actuators import surface_limits, thrust_available
from flightsw.sixdof.trim import trim_free
from flightsw.strict import Range
from flightsw.types import NavState

Gain = Annotated[float, Range(0.0, 100.0)]


@dataclass(frozen=True)
class LawParams:
    """[ctrl] of the flight file."""

    bank_max_deg: Annotated[float, Range(1.0, 60.0)] = 25.0
    climb_max_deg: Annotated[float, Range(0.5, 15.0)] = 5.0
    course: Gain = 0.6  # [rad bank per rad course]
    roll: Gain = 0.8  # [rad aileron per rad bank]
    roll_rate: Gain = 0.15  # [s]
    altitude: Gain = 0.004  # [rad pitch per m]
    pitch: Gain = 0.9  # [rad elevator per rad pitch]
    pitch_rate: Gain = 0.35  # [s]
    hold: Gain = 0.15  # [1/s] of the pitch error's integral
    yaw_rate: Gain = 0.3  # [s]
    speed: Gain = 0.06  # [thrust share of weight per m/s]
    speed_hold: Gain = 0.008  # [the same per s]


class CruiseLaw:
    """Commands u [4]: three surfaces [rad] and thrust [N]."""

    def __init__(self, ac: Aircraft, p: LawParams, V: float, h: float) -> None:
        """Around level flight at airspeed V [m/s], altitude h [m]. Raises TrimError."""
        self.p, self.ac = p, ac
        mass = ac.mass.empty_kg + ac.mass.default_fuel_kg
        self.trim = trim_free(ac, mass, h, V, 0.0)
        self.weight = mass * 9.80665
        self.lim = surface_limits(ac)
        self.most = thrust_available(ac, h, V)
        self.u = self.trim.u.copy()
        self.saturated = False
        self._pitch = self._speed = 0.0

    def step(self, nav: NavState, V: float, h: float, course_error: float, dt: float) -> np.ndarray:
        """u for airspeed V [m/s], altitude h [m] and a course flown `course_error` [rad] to the right of the one wanted."""
        p, u = self.p, self.u
        top, climb = math.radians(p.bank_max_deg), math.radians(p.climb_max_deg)
        _psi, theta, phi = nav.euler
        bank = min(max(-p.course * wrap_pi(course_error), -top), top)
        pitch = float(self.trim.x[7]) + min(max(p.altitude * (h + nav.pos_n[2]), -climb), climb)
        off, slow = pitch - theta, V - nav.V
        u[0] = p.roll * (bank - phi) - p.roll_rate * nav.w_b[0]
        u[1] = self.trim.u[1] - p.pitch * off + p.pitch_rate * nav.w_b[1] - self._pitch
        u[2] = p.yaw_rate * (nav.w_b[2] - 9.80665 * math.tan(phi) / max(nav.V, 20.0) * math.cos(theta))
        u[3] = self.trim.u[3] + self.weight * (p.speed * slow + self._speed)
        asked = u.copy()
        np.clip(u[:3], self.lim[:, 0], self.lim[:, 1], out=u[:3])
        u[3] = min(max(u[3], 0.0), self.most)
        self.saturated = bool((asked != u).any())
        if not self.saturated:  # no wind-up
            self._pitch += p.hold * off * dt
            self._speed += p.speed_hold * slow * dt
        return u
