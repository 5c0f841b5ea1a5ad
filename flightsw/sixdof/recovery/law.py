"""The recovery law: from any attitude to level flight by attitude, rates, load factor and airspeed (docs/sources/recovery.md).

No filter of wind or position is in it, and no 3-2-1 angle: attitude enters as the direction of the vertical in body axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.sixdof.actuators import surface_limits, thrust_available
from flightsw.sixdof.recovery.answer import AILERON, ELEVATOR, RUDDER, Answer
from flightsw.sixdof.recovery.degraded import Without
from flightsw.sixdof.recovery.readings import Readings
from flightsw.terms import LawTerms, Output
from flightsw.types import Vec3

SAFETY = 1.5  # [-] ultimate over limit load (14 CFR 25.303)
LAST = 0.85  # [-] of the ultimate load, pulled in a steep dive only: the ground and the dive speed are no better
INCIDENCE_MARGIN = math.radians(3.0)  # below the file's largest incidence
UNLOADED = 0.3  # [g] while the lift points the wrong way
STEEP_CLIMB, CLIMBED = math.radians(45.0), math.radians(20.0)  # over the top from the first to the second
STEEP_DIVE, DIVED = math.sin(math.radians(5.0)), math.sin(math.radians(20.0))  # limit load to LAST
NO_SIDE = 0.25  # [-] cosine of the path angle below which the vertical tells no bank
K_RATE, AT_FULL = (5.0, 5.0, 2.5), 0.4  # [1/s] body rates, as far as full surface does it at that error [rad/s]
BANK_SHARE, PATH_SHARE, FLOW_SHARE = 0.45, 0.16, 0.4  # [-] of these for bank, path, incidence
K_TRIM, TRIM_MOST, TRIM_ERROR = 1.0, 0.1, 0.05  # [1/s], [rad/s], [rad/s] integral of the pitch rate's error
AHEAD_S = 0.15  # [s] the load factor is looked ahead by the swing of the incidence
ROLL_AHEAD_S = 0.35  # [s] the lift's direction: the load takes as long to come
LOAD_RATE = 5.0  # [g/s] of what is asked for
K_LEVEL, LEVEL_MOST = 0.15, math.radians(4.0)  # [1/s], [rad] integral of the path angle close to level
K_SPEED = 0.15  # [1/s]
ROLL_MOST, ROLL_SHARE = math.radians(150.0), 0.8  # [rad/s], [-] of what full aileron gives
DESCENT, CLIMB = math.sin(math.radians(15.0)), math.sin(math.radians(20.0))  # idle, full thrust beyond
NEAR = math.radians(10.0)  # [rad] of path and bank: level enough for the integral


@dataclass(slots=True)
class Wanted:
    """Of level flight: airspeed [m/s], bank [rad, + right], path angle [rad]; side to bank to where bank has to make the path."""

    V: float
    bank: float = 0.0
    path: float = 0.0
    side: float = 1.0  # +1 right, -1 left


class RecoveryLaw:
    """Surfaces and thrust towards level flight. `bank`, `path` [rad]: what they are about the velocity, as of the last step."""

    def __init__(self, ac: Aircraft) -> None:
        self.ac = ac
        self.lim = surface_limits(ac)
        low, high = ac.structure.load_g
        self.load_low, self.load_high, self.load_last = low / SAFETY, high / SAFETY, LAST * high
        self.alpha_top = math.radians(ac.limits.alpha_max_deg) - INCIDENCE_MARGIN
        self.terms = LawTerms(
            "recovery", (*(Output(x, "rad") for x in ("aileron", "elevator", "rudder")), Output("thrust", "N"))
        )
        self.bank = self.path = 0.0
        self.without = Without(ac)
        self.reset()

    def reset(self) -> None:
        """Nothing is remembered of an earlier recovery."""
        self._over = False  # over the top
        self._level = 0.0  # [rad]
        self._load = 1.0  # asked for
        self._k = K_RATE
        self._swing = 0.0  # [rad/s] of the incidence
        self._trim = 0.0  # [rad/s^2] pitch acceleration the file's moments do not give

    def step(self, s: Readings, want: Wanted, answer: Answer, dt: float) -> tuple[np.ndarray, float]:
        """Command (surfaces [rad] and thrust [N] [4], throttle 0..1), dt [s] after the last (recovery.md 2 to 6, 11)."""
        flow, lift, right = axes(s.alpha, s.beta)
        up = (-s.down[0], -s.down[1], -s.down[2])
        climb, ahead, aside = _dot(up, flow), _dot(up, lift), _dot(up, right)
        across = math.hypot(ahead, aside)  # cosine of the path angle
        self.path = math.atan2(climb, across)
        self.bank = -math.atan2(aside, ahead)
        self._k = self._gains(s)
        if answer.failed == ELEVATOR:
            want.bank = self.without.bank(s, self.path, want.path, want.side, dt)
            want.V = self.without.speed(s, want.bank)
        roll, load = self._path(s, want, climb, ahead, aside, across, dt)
        p, q, r = self._rates(s, roll, load, ahead, aside)
        u = self._surfaces(s, p, q, r)
        if answer.failed >= 0:
            u = self._degraded(s, want, answer, u, roll, p, -G0 / s.V * aside, dt)
        thrust, avail = self._thrust(s, want, climb)
        sent = [min(max(x, self.lim[i, 0]), self.lim[i, 1]) for i, x in enumerate(u)]
        if sent[1] == u[1]:
            more = K_TRIM * self._k[1] * min(max(q - s.w[1], -TRIM_ERROR), TRIM_ERROR) * dt
            self._trim = min(max(self._trim + more, -TRIM_MOST * self._k[1]), TRIM_MOST * self._k[1])
        for o, asked, given in zip(self.terms.outputs, (*u, thrust), (*sent, thrust), strict=True):
            o.give(asked, 0.0, 0.0, given)
        self.terms.closed = True
        return np.array([*sent, thrust]), thrust / avail

    def _degraded(
        self, s: Readings, want: Wanted, answer: Answer, u: Vec3, roll: float, p: float, r: float, dt: float
    ) -> Vec3:
        """Surfaces u [rad] where one does not answer: roll [rad] to go, roll and yaw rate wanted [rad/s]."""
        lost, at = self.without, answer.at
        if answer.failed == ELEVATOR:
            # adverse yaw left alone: its sideslip takes incidence off as the aircraft rolls, alpha' = q - g/V n - p tan(beta)
            return u[0], lost.creep(s, at[ELEVATOR], self.path, want.path), 0.0 if lost.lifted else u[2]
        if answer.failed == AILERON:
            return 0.0, u[1], lost.rudder(s, at[AILERON], lost.roll(s, roll), r, self._k[2], dt)
        return lost.aileron(s, at[RUDDER], p, self._k[0]), u[1], 0.0

    def _gains(self, s: Readings) -> Vec3:
        """Of the body rates [1/s]: a surface at its limit at an error of AT_FULL (recovery.md 4)."""
        c, g = self.ac.aero, self.ac.geometry
        moments = (c.Cl_da * g.b_m, c.Cm_de * g.c_m, c.Cn_dr * g.b_m)
        k = [
            min(most, abs(m) * s.q * g.S_m2 / i * min(-self.lim[j, 0], self.lim[j, 1]) / AT_FULL)
            for j, (most, m, i) in enumerate(zip(K_RATE, moments, s.inertia, strict=True))
        ]
        return k[0], k[1], k[2]

    def _path(
        self, s: Readings, want: Wanted, climb: float, ahead: float, aside: float, across: float, dt: float
    ) -> tuple[float, float]:
        """Angle to roll through [rad, + right] and load factor along the lift (recovery.md 2, 3)."""
        self._over = self.path > (CLIMBED if self._over else STEEP_CLIMB)
        side = -1.0 if self._over else 1.0
        roll = math.atan2(side * aside, side * ahead)
        closing = max(s.w[0] * math.copysign(1.0, roll), 0.0) * ROLL_AHEAD_S
        towards = math.cos(max(abs(roll) - closing, 0.0))
        if across < NO_SIDE:
            towards = 1.0
        if not self._over:
            roll += want.bank
        near = abs(self.path) < NEAR and abs(self.bank - want.bank) < NEAR
        if near:
            self._level += K_LEVEL * (want.path - self.path) * dt
            self._level = min(max(self._level, -LEVEL_MOST), LEVEL_MOST)
        turn = PATH_SHARE * self._k[1] * (want.path - self.path + self._level)  # [rad/s] of the path, up
        asked = self.load_high if self._over else (across + s.V * turn / G0) / max(math.cos(want.bank), 0.5)
        steep = min(max((-climb - STEEP_DIVE) / (DIVED - STEEP_DIVE), 0.0), 1.0)
        top = self.load_high + steep * (self.load_last - self.load_high)
        share = min(max(2.0 * towards, 0.0), 1.0)  # whole while the lift points within 60 deg of where it is wanted
        load = UNLOADED + share * (min(max(asked, 0.0), top) - UNLOADED)
        self._load = load = min(load, self._load + LOAD_RATE * dt)
        return roll, load

    def _rates(self, s: Readings, roll: float, load: float, ahead: float, aside: float) -> tuple[float, float, float]:
        """Body rates [rad/s] that roll through `roll` [rad] and bring the load factor to `load` (recovery.md 4)."""
        c, geometry = self.ac.aero, self.ac.geometry
        full = c.Cl_da * min(-self.lim[0, 0], self.lim[0, 1]) / -c.Cl_p * 2.0 * s.V / geometry.b_m
        most = min(ROLL_MOST, ROLL_SHARE * full)
        around = min(max(BANK_SHARE * self._k[0] * roll, -most), most)
        g_V = G0 / s.V
        slope = s.q * geometry.S_m2 * c.CL_alpha / (s.mass * G0)  # [1/rad] load factor over incidence
        crossed = s.w[0] * math.tan(s.beta)  # [rad/s] incidence that rolling makes of sideslip
        self._swing = s.w[1] - g_V * (s.load - ahead) - crossed
        more = (load - s.load) / slope - AHEAD_S * self._swing
        more = min(max(more, -self.alpha_top - s.alpha), self.alpha_top - s.alpha)
        pitch = g_V * (s.load + slope * more - ahead) + crossed + FLOW_SHARE * self._k[1] * more
        yaw = -g_V * aside
        ca, sa = math.cos(s.alpha), math.sin(s.alpha)
        return around * ca - yaw * sa, pitch, around * sa + yaw * ca

    def _surfaces(self, s: Readings, p: float, q: float, r: float) -> tuple[float, float, float]:
        """Aileron, elevator, rudder [rad] whose moments bring the rates to p, q, r [rad/s] (recovery.md 5)."""
        c, g, w = self.ac.aero, self.ac.geometry, s.w
        ixx, iyy, izz = s.inertia
        qs = s.q * g.S_m2
        hb, hc = 0.5 * g.b_m / s.V, 0.5 * g.c_m / s.V
        swing = self._swing
        pitch = (iyy * (self._k[1] * (q - w[1]) + self._trim) - (izz - ixx) * w[0] * w[2]) / (qs * g.c_m)
        elevator = (pitch - c.Cm0 - c.Cm_alpha * s.alpha - hc * (c.Cm_q * w[1] + c.Cm_alphadot * swing)) / c.Cm_de
        roll = (ixx * self._k[0] * (p - w[0]) - (iyy - izz) * w[1] * w[2]) / (qs * g.b_m)
        yaw = (izz * self._k[2] * (r - w[2]) - (ixx - iyy) * w[0] * w[1]) / (qs * g.b_m)
        roll -= c.Cl_beta * s.beta + hb * (c.Cl_p * w[0] + c.Cl_r * w[2])
        yaw -= hb * (c.Cn_p * w[0] + c.Cn_r * w[2])
        det = c.Cl_da * c.Cn_dr - c.Cl_dr * c.Cn_da
        return (roll * c.Cn_dr - yaw * c.Cl_dr) / det, elevator, (yaw * c.Cl_da - roll * c.Cn_da) / det

    def _thrust(self, s: Readings, want: Wanted, climb: float) -> tuple[float, float]:
        """Thrust [N] and what is available (recovery.md 6)."""
        c, S = self.ac.aero, self.ac.geometry.S_m2
        avail = thrust_available(self.ac, s.h_m, s.V)
        idle = self.ac.engine.idle_frac * avail
        weight = s.mass * G0
        lift = weight / (s.q * S)
        level = s.q * S * (c.CD0 + c.K * lift * lift)
        if climb < -DESCENT:
            return idle, avail
        if climb > CLIMB:
            return avail, avail
        # without an airspeed that is measured: what holds level flight
        more = s.mass * K_SPEED * (want.V - s.V) + weight * climb if s.V_measured else 0.0
        return min(max(level + more, idle), avail), avail


def axes(alpha: float, beta: float) -> tuple[Vec3, Vec3, Vec3]:
    """Unit vectors in body axes: along the flow, along the lift, to the right of both."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return (ca * cb, sb, sa * cb), (sa, 0.0, -ca), (-ca * sb, cb, -sa * sb)


def _dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
