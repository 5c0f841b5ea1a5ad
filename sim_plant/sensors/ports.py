"""What stands between the air and a sensor: pitot tubes and static port that are blocked or iced, vanes frozen in their bearing.

Faults of the truth a sensor sees, before its own errors: those (lag, scale, noise, quantum of the converter) go on.
The air data of a probe are made of total pressure pt at its tube, static pressure ps of the aircraft's one port and total
temperature Tt (NACA report 1135, eqs. 43, 44, isentropic up to Mach 1):

    M = sqrt(5 ((pt/ps)^(2/7) - 1)),  T = Tt / (1 + M^2 / 5),  V = M sqrt(gamma R T)

Below Mach 0.2 within 1 % of V^2 = 2 (pt - ps) / rho. The air is the standard atmosphere's, as for the barometer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import GAMMA, R_AIR, isa
from sim_plant.sensors.base import View

EXPONENT = GAMMA / (GAMMA - 1.0)  # 7/2


class Before(Protocol):
    """Something between the truth and a sensor."""

    def act(self, view: View, t_us: int) -> View:
        """What the sensor is shown of `view` at t_us: another View, or the same."""
        ...


def total(V: float, p: float, t: float) -> tuple[float, float]:
    """Total pressure [Pa] and total temperature [K] of air of pressure p [Pa] and temperature t [K] met at V [m/s]."""
    rise = 1.0 + 0.5 * (GAMMA - 1.0) * V * V / (GAMMA * R_AIR * t)
    return p * math.pow(rise, EXPONENT), t * rise


def airspeed(pt: float, p: float, tt: float) -> float:
    """True airspeed [m/s] made of total and static pressure [Pa] and total temperature [K]; 0 where pt is not above p."""
    if pt <= p:
        return 0.0
    rise = math.pow(pt / p, 1.0 / EXPONENT)
    return math.sqrt(2.0 * GAMMA / (GAMMA - 1.0) * R_AIR * tt * (1.0 - 1.0 / rise))


@dataclass(slots=True)
class StaticPort:
    """The static port is closed: its pressure, that of a height [m], stays for every sensor it feeds. Shared by them."""

    height_m: float | None = None

    def act(self, view: View, t_us: int) -> View:
        """The barometer's view: the height of the trapped pressure."""
        out = view.still()
        out.s[n.S_P + 2] = -self.trapped(view)
        return out

    def trapped(self, view: View) -> float:
        """Height [m] of the trapped pressure; the first call closes the port."""
        if self.height_m is None:
            self.height_m = -view.s[n.S_P + 2]
        return self.height_m


@dataclass(slots=True)
class Pitot:
    """One fault of the pitot tubes of `probes`: closed, tube and drain (rate_ps = 0: the total pressure is trapped), or icing
    up at the front with the drain open (rate_ps [1/s]: share of the impact pressure lost per second, from `start_us`)."""

    probes: tuple[int, ...]
    rate_ps: float = 0.0
    start_us: int = 0
    pt: dict[int, float] = field(default_factory=dict)  # [Pa] trapped, by probe

    def felt(self, probe: int, pt: float, p: float, t_us: int) -> float:
        """Pressure [Pa] in the tube, where it would be pt [Pa] without the fault and p [Pa] is that of the air."""
        if probe not in self.probes:
            return pt
        if self.rate_ps > 0.0:
            lost = min(1.0, self.rate_ps * (t_us - self.start_us) * 1e-6)
            return p + (pt - p) * (1.0 - lost)
        return self.pt.setdefault(probe, pt)


@dataclass(slots=True)
class Tubes:
    """Airspeeds of all probes with faults of their tubes and of the static port."""

    pitots: list[Pitot]
    static: StaticPort | None = None

    def act(self, view: View, t_us: int) -> View:
        """The air data's view."""
        out = view.still()
        t, p, _, _ = isa(-view.s[n.S_P + 2])
        known = p if self.static is None else isa(self.static.trapped(view))[1]
        for i in range(view.probes):
            at = n.O_PROBE + 3 * i
            pt, tt = total(view.o[at], p, t)
            for f in sorted(self.pitots, key=lambda f: f.rate_ps == 0.0):  # what ices up is closed with what is left
                pt = f.felt(i, pt, p, t_us)
            out.o[at] = airspeed(pt, known, tt)
        return out


@dataclass(slots=True)
class Still:
    """Some columns of the air data (V, alpha, beta of probe 0, of probe 1, ...) stand still."""

    columns: list[int]
    held: list[float] = field(default_factory=list)

    def act(self, view: View, t_us: int) -> View:
        """The air data's view: the columns as they were at the first call."""
        if not self.held:
            self.held = [view.o[n.O_PROBE + c] for c in self.columns]
        out = view.still()
        for c, x in zip(self.columns, self.held, strict=True):
            out.o[n.O_PROBE + c] = x
        return out
