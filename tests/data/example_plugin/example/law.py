"""Course, altitude and airspeed by cascaded loops around a trim; gains per radian and metre, made for the Navion at its trim."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import wrap_pi
from flightsw.sixdof.actuators import ActuatorModel, surface_limits, thrust_available
from flightsw.sixdof.autopilot import TankerCtrlParams
from flightsw.sixdof.trim import trim_free
from flightsw.strict import Range
from flightsw.terms import HELD, Controlled, LawTerms, Output
from flightsw.types import GuidanceCmd, NavState

Gain = Annotated[float, Range(0.0, 100.0)]
G = 9.80665  # [m/s^2]


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
    """Commands u [4]: three surfaces [rad] and thrust [N]. `terms`: what they are made of."""

    def __init__(self, ac: Aircraft, p: LawParams, V: float, h: float, mass_kg: float | None = None) -> None:
        """Around level flight at airspeed V [m/s], altitude h [m], as heavy as the record says where mass_kg is not given.
        Raises TrimError."""
        self.p, self.ac = p, ac
        mass = mass_kg or ac.mass.empty_kg + ac.mass.default_fuel_kg
        self.trim = trim_free(ac, mass, h, V, 0.0)
        self.weight = mass * G
        self.lim = surface_limits(ac)
        self.most = thrust_available(ac, h, V)
        self.u = self.trim.u.copy()
        self.saturated = False
        self._pitch = self._speed = 0.0
        outputs = (*(Output(n, "rad") for n in ("aileron", "elevator", "rudder")), Output("thrust", "N"))
        errors = (("bank", "rad"), ("pitch", "rad"), ("altitude", "m"), ("airspeed", "m/s"))
        self.terms = LawTerms("cascade", outputs, tuple(Controlled(*e) for e in errors))

    def step(self, nav: NavState, V: float, h: float, course_error: float, dt: float) -> np.ndarray:
        """u for airspeed V [m/s], altitude h [m] and a course flown `course_error` [rad] to the right of the one wanted."""
        return self.hold(nav, V, h, -self.p.course * wrap_pi(course_error), dt)

    def hold(self, nav: NavState, V: float, h: float, bank: float, dt: float) -> np.ndarray:
        """u for airspeed V [m/s], altitude h [m], bank [rad], right wing down, within bank_max_deg."""
        p, u = self.p, self.u
        top, climb = math.radians(p.bank_max_deg), math.radians(p.climb_max_deg)
        _psi, theta, phi = nav.euler
        bank = min(max(bank, -top), top)
        pitch = float(self.trim.x[7]) + min(max(p.altitude * (h + nav.pos_n[2]), -climb), climb)
        off, slow = pitch - theta, V - nav.V
        feedback = (
            p.roll * (bank - phi) - p.roll_rate * nav.w_b[0],
            -p.pitch * off + p.pitch_rate * nav.w_b[1],
            p.yaw_rate * (nav.w_b[2] - G * math.tan(phi) / max(nav.V, 20.0) * math.cos(theta)),
            self.weight * p.speed * slow,
        )
        integral = (0.0, -self._pitch, 0.0, self.weight * self._speed)
        forward = (0.0, float(self.trim.u[1]), 0.0, float(self.trim.u[3]))
        u[:] = np.add(np.add(feedback, integral), forward)
        asked = u.copy()
        np.clip(u[:3], self.lim[:, 0], self.lim[:, 1], out=u[:3])
        u[3] = min(max(u[3], 0.0), self.most)
        self.saturated = bool((asked != u).any())
        for o, parts in zip(self.terms.outputs, zip(feedback, integral, forward, u.tolist(), strict=True), strict=True):
            o.give(*parts)
        errors = ((phi - bank, 0.0), (-off, -self._pitch), (-nav.pos_n[2] - h, 0.0), (-slow, -self._speed))
        for c, (error, grown) in zip(self.terms.controlled, errors, strict=True):
            c.error, c.integral, c.limits = error, grown, HELD if self.saturated and grown else 0
        self.terms.closed = True
        if not self.saturated:  # no wind-up
            self._pitch += p.hold * off * dt
            self._speed += p.speed_hold * slow * dt
        return u


TRANSPORT = LawParams(
    bank_max_deg=30.0, roll=0.6, roll_rate=0.8, altitude=0.0006, pitch=1.0, pitch_rate=1.2, hold=0.1, yaw_rate=0.5,
    speed=0.01, speed_hold=0.0005,
)  # fmt: skip


class MyLaw:
    """The same loops as the autopilot of an aircraft that is not ours: `ctrl.law = "example:MyLaw"` of a tanker. It is all that
    flightsw.sixdof.autopilot.AutopilotLaw asks for, and derives from nothing."""

    obeys = ("schedule.V_mps", "schedule.h_m", "schedule.mass_kg")  # of its [ctrl]; another key that is set is refused

    def __init__(self, ac: Aircraft, p: TankerCtrlParams, dt_s: float) -> None:
        """ac: its record; p: its [ctrl]; dt_s [s]: period. Raises TrimError."""
        s = p.schedule
        self.loops = CruiseLaw(ac, TRANSPORT, float(np.mean(s.V_mps)), s.h_m, s.mass_kg)
        self.most = self.loops.most

    @property
    def terms(self) -> LawTerms:
        """See AutopilotLaw."""
        return self.loops.terms

    @property
    def saturated(self) -> bool:
        """See AutopilotLaw."""
        return self.loops.saturated

    def step(self, nav: NavState, cmd: GuidanceCmd, act: ActuatorModel, dt: float) -> tuple[np.ndarray, float]:
        """A turn rate is the bank of a level turn."""
        u = self.loops.hold(nav, cmd.V, cmd.alt_m, math.atan(cmd.psi_dot * nav.V / G), dt)
        return u, float(u[3]) / self.most

    def trim_command(self, V: float, h_m: float) -> tuple[np.ndarray, float]:
        """Its one trim."""
        self.terms.open()
        u = self.loops.trim.u
        for o, v in zip(self.terms.outputs, u.tolist(), strict=True):
            o.feedforward = v
        return u.copy(), float(u[3]) / self.most
