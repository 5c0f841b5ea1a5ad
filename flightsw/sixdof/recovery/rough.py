"""Attitude hold for rough air: the aircraft rides the gusts and is kept level over many of them (docs/sources/rough-air.md 2)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import wrap_pi
from flightsw.sixdof.actuators import surface_limits, thrust_available
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.turbulence import RoughAirParams
from flightsw.terms import LawTerms

V_TAU_S, PATH_TAU_S = 5.0, 2.0  # [s] airspeed, path: gusts are shorter
K_RATE, K_PITCH, PITCH_RATE = 1.0, 1.0, math.radians(3.0)  # [1/s], [1/s], [rad/s] most
K_TRIM, TRIM_MOST = 0.3, 0.4  # [1/s] of K_RATE, [rad/s^2] moments that the file does not tell
K_ROLL, K_BANK, ROLL_RATE = 4.0, 1.2, math.radians(20.0)  # [1/s], [1/s], [rad/s]: bank costs no load
K_HEADING, BANK_MOST = 0.5, math.radians(10.0)  # [-] of bank over heading
K_PATH, K_LEVEL, LEVEL_MOST = 0.4, 0.08, math.radians(6.0)  # [-], [1/s], [rad] of pitch over the path's error
PATH_RATE = math.radians(1.5)  # [rad/s] of the path asked for: half a g at most
K_SPEED = 0.1  # [1/s]


class RoughAirLaw:
    """Surfaces and thrust that hold attitude, slowly brought to a path and an airspeed."""

    def __init__(self, ac: Aircraft, p: RoughAirParams, terms: LawTerms) -> None:
        """terms: the record it fills, with an output for each surface and the thrust."""
        self.ac, self.p, self.terms = ac, p, terms
        self.lim = surface_limits(ac)
        self.path = 0.0  # [rad] flown, over PATH_TAU_S
        self.begin(Readings(ac, 0.0), 0.0)

    def begin(self, s: Readings, path: float) -> None:
        """From here on, at a path [rad] over the ground."""
        self._V = self._V_asked = s.V
        self.path = self._path_asked = path
        self._level = 0.0  # [rad]
        self._trim = 0.0  # [rad/s^2]
        self._heading = math.atan2(float(s.R[1]), float(s.R[0]))

    def step(self, s: Readings, climb_mps: float | None, path: float, dt: float) -> tuple[np.ndarray, float]:
        """Command (surfaces [rad] and thrust [N] [4], throttle 0..1) towards a path [rad], dt [s] after the last. climb_mps: rate
        of climb, None: as the air data have it (rough-air.md 2)."""
        c, g = self.ac.aero, self.ac.geometry
        pitch = -math.asin(min(max(s.down[0], -1.0), 1.0))
        bank = math.atan2(s.down[1], s.down[2])
        V = self._V = self._V + min(dt / V_TAU_S, 1.0) * (s.V - self._V)
        flown = pitch - s.alpha if climb_mps is None else math.asin(min(max(climb_mps / s.V, -1.0), 1.0))
        self.path += min(dt / PATH_TAU_S, 1.0) * (flown - self.path)
        self._path_asked += min(max(path - self._path_asked, -PATH_RATE * dt), PATH_RATE * dt)
        off = self._path_asked - self.path
        self._level = min(max(self._level + K_LEVEL * off * dt, -LEVEL_MOST), LEVEL_MOST)
        q = 0.5 * density(s.h_m) * V * V
        weight = s.mass * G0
        lift = weight / (q * g.S_m2)
        alpha = (lift - c.CL0) / c.CL_alpha
        wanted = alpha + self._path_asked + K_PATH * off + self._level
        turn = min(max(K_PITCH * (wanted - pitch), -PITCH_RATE), PITCH_RATE)
        ixx, iyy, _ = s.inertia
        self._trim += K_TRIM * K_RATE * (turn - s.w[1]) * dt
        self._trim = min(max(self._trim, -TRIM_MOST), TRIM_MOST)
        moment = (K_RATE * (turn - s.w[1]) + self._trim) * iyy / (q * g.S_m2 * g.c_m)
        elevator = (moment - c.Cm0 - c.Cm_alpha * alpha) / c.Cm_de
        heading = math.atan2(float(s.R[1]), float(s.R[0]))
        lean = min(max(K_HEADING * wrap_pi(self._heading - heading), -BANK_MOST), BANK_MOST)
        roll = min(max(K_BANK * (lean - bank), -ROLL_RATE), ROLL_RATE)
        aileron = K_ROLL * (roll - s.w[0]) * ixx / (q * g.S_m2 * g.b_m * c.Cl_da)
        thrust, avail = self._thrust(s, q, lift, weight, dt)
        asked = (aileron, elevator, 0.0)
        sent = [min(max(x, self.lim[i, 0]), self.lim[i, 1]) for i, x in enumerate(asked)]
        for o, a, b in zip(self.terms.outputs, (*asked, thrust), (*sent, thrust), strict=True):
            o.give(a, 0.0, 0.0, b)
        self.terms.closed = True
        return np.array([*sent, thrust]), thrust / avail

    def _thrust(self, s: Readings, q: float, lift: float, weight: float, dt: float) -> tuple[float, float]:
        """Thrust [N] and what is available; q [Pa] and lift [-] of the airspeed without gusts."""
        c, p = self.ac.aero, self.p
        change = min(max((p.V_mps - self._V_asked) / dt, -p.speed_mps2), p.speed_mps2)
        self._V_asked += change * dt
        avail = thrust_available(self.ac, s.h_m, self._V)
        drag = q * self.ac.geometry.S_m2 * (c.CD0 + c.K * lift * lift)
        more = s.mass * (K_SPEED * (self._V_asked - self._V) + change) if s.V_measured else 0.0
        thrust = drag + more + weight * self._path_asked
        return min(max(thrust, self.ac.engine.idle_frac * avail), avail), avail
