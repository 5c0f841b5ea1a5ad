"""Flying on without one of the surfaces (docs/sources/recovery.md 11): the path by bank and thrust without an elevator, bank by
sideslip without ailerons, sideslip borne without a rudder."""

from __future__ import annotations

import math

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.sixdof.recovery.readings import Readings

PATH_RATE, BANK_MOST = 0.6, math.radians(60.0)  # [1/s] of the path, [rad]
# [rad], [s] from the loss, [-] load beyond which: the tanker's height is reached before its wing tip is passed, but for that
BANK_CLOSE, CLOSE_S, LIFTED = math.radians(85.0), 1.4, 1.3
SIDE_S = 0.5  # [s] the other side must have been the better one: a single reading of the place turns nobody over
LOAD_S = 0.3  # [s] over which the load factor is looked at
SIDESLIP_MOST, SIDESLIP_RATE = math.radians(16.0), 2.0  # [rad], [1/s]
ROLL_RATE, ROLL_GAIN, ROLL_MOST = 0.35, 1.0, math.radians(12.0)  # [1/s] of the bank, of the roll rate; [rad/s]
ROLL_TRIM, ROLL_TRIM_MOST = (
    0.3,
    1.0,
)  # [1/s^2], [rad/s^2] integral of the roll rate's error: where ailerons stand is known to a degree or two
BORNE_MOST = math.radians(
    15.0
)  # [rad/s] of roll: the sideslip that a lost rudder makes takes the ailerons before it settles
CREEP, CREEP_RATE = math.radians(2.0), 0.2  # [rad] from where an elevator is, [1/s] of the path by it


class Without:
    """One aircraft's, while a surface does not answer."""

    def __init__(self, ac: Aircraft) -> None:
        self.ac = ac
        self.load: float | None = None  # [-] as it lasts; not known before an elevator is lost
        self._lost_s = 0.0
        self.lifted = False  # towards a tanker
        self._roll = 0.0  # [rad/s^2] roll acceleration the file's moments do not give
        self._side, self._other_s = 0.0, 0.0  # banked to; [s] the other has been wanted

    def bank(self, s: Readings, path: float, wanted: float, side: float, dt: float) -> float:
        """Bank [rad] that makes of the load there is the path wanted [rad] of the path flown; side: +1 right, -1 left."""
        last = s.load if self.load is None else self.load
        self.load = last + dt / (LOAD_S + dt) * (s.load - last)
        need = math.cos(path) + s.V / G0 * PATH_RATE * (wanted - path)
        self._lost_s += dt
        self.lifted = wanted < 0.0 and self.load > LIFTED
        most = BANK_CLOSE if self.lifted and self._lost_s < CLOSE_S else BANK_MOST
        share = min(max(need / max(self.load, 0.1), math.cos(most)), 1.0)
        self._other_s = self._other_s + dt if side != self._side else 0.0
        if self._side == 0.0 or self._other_s > SIDE_S:
            self._side = side
        return math.copysign(math.acos(share), self._side)

    def speed(self, s: Readings, bank: float) -> float:
        """Airspeed [m/s] at which the incidence there is bears the aircraft."""
        load = 1.0 if self.load is None else self.load
        return s.V / math.sqrt(min(max(load * math.cos(bank), 0.6), 1.6))

    def creep(self, s: Readings, at: float, path: float, wanted: float) -> float:
        """Elevator [rad] a little from where it is, at [rad], towards that of the path wanted [rad]: one that only creeps, or has
        play, follows."""
        c, V = self.ac.aero, s.V
        load = math.cos(path) + V / G0 * CREEP_RATE * (wanted - path)
        lift = min(max(load, 0.5), 1.5) * s.mass * G0 / (s.q * self.ac.geometry.S_m2)
        alpha = (lift - c.CL0) / c.CL_alpha
        level = -(c.Cm0 + c.Cm_alpha * alpha + 0.5 * self.ac.geometry.c_m / V * c.Cm_q * s.w[1]) / c.Cm_de
        return at + min(max(level - at, -CREEP), CREEP)

    def roll(self, s: Readings, roll: float) -> float:
        """Roll rate [rad/s] towards a bank that is roll [rad] away, by sideslip."""
        return min(max(ROLL_RATE * roll, -ROLL_MOST), ROLL_MOST)

    def rudder(self, s: Readings, aileron: float, p: float, r: float, k_yaw: float, dt: float) -> float:
        """Rudder [rad] whose sideslip rolls with p [rad/s], yawing with r [rad/s] beside; aileron [rad]: where that is."""
        c, g, w = self.ac.aero, self.ac.geometry, s.w
        ixx, iyy, izz = s.inertia
        qSb, hb = s.q * g.S_m2 * g.b_m, 0.5 * g.b_m / s.V
        missing = p - w[0]
        roll = (ixx * (ROLL_GAIN * missing + self._roll) - (iyy - izz) * w[1] * w[2]) / qSb - hb * (
            c.Cl_p * p + c.Cl_r * w[2]
        )
        beta = (roll - c.Cl_da * aileron) / c.Cl_beta
        if abs(beta) < SIDESLIP_MOST:
            self._roll = min(max(self._roll + ROLL_TRIM * missing * dt, -ROLL_TRIM_MOST), ROLL_TRIM_MOST)
        beta = min(max(beta, -SIDESLIP_MOST), SIDESLIP_MOST)
        r -= SIDESLIP_RATE * (beta - s.beta)
        yaw = (izz * k_yaw * (r - w[2]) - (ixx - iyy) * w[0] * w[1]) / qSb
        return (yaw - c.Cn_beta * s.beta - hb * (c.Cn_p * w[0] + c.Cn_r * w[2]) - c.Cn_da * aileron) / c.Cn_dr

    def aileron(self, s: Readings, rudder: float, p: float, k_roll: float) -> float:
        """Aileron [rad] for a roll rate p [rad/s], BORNE_MOST at most, with the rudder where it is [rad]."""
        p = min(max(p, -BORNE_MOST), BORNE_MOST)
        c, g, w = self.ac.aero, self.ac.geometry, s.w
        ixx, iyy, izz = s.inertia
        roll = (ixx * k_roll * (p - w[0]) - (iyy - izz) * w[1] * w[2]) / (s.q * g.S_m2 * g.b_m)
        roll -= c.Cl_beta * s.beta + 0.5 * g.b_m / s.V * (c.Cl_p * w[0] + c.Cl_r * w[2])
        return (roll - c.Cl_dr * rudder) / c.Cl_da
