"""When an aircraft is lost, by the truth alone: on the ground, broken, out of control, or against another.

A load factor or a speed beyond what the structure bears ends it at once (the numbers are in the aircraft's file). Attitude, rates
and incidence no crew recovers from end it when they last: a passing excursion is flown out, and over when it has not come back
for as long (an aircraft that rolls on and on is upright half of the time). One that starts upset is judged by them once it has
been within them for as long. Two bodies touch when two of their
bars do; only the boom may, and it is no bar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft.structure import Bar
from sim_plant.aircraft.base import Member
from sim_plant.couplings.relative import pairs
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import RHO0
from sim_plant.kernels.rot import quat_dcm
from sim_plant.kernels.segments import gap

HOLD_S = 3.0  # [s] from surprise to the recovery's effect
BANK, PITCH = (
    math.radians(90.0),
    math.radians(60.0),
)  # [rad] on its side; beyond any attitude flown here (upsets: from 45, 25 deg)
RATE = math.radians(180.0)  # [rad/s] half a turn a second: tumbling, not flying
LEAST_SOUND = 260.0  # [m/s] no air is as cold (168 K), and
THIN_M = 3000.0  # [m] none above here as dense as that of the sea level: below both, an airspeed within the limits is within them
Arr = NDArray[np.float64]
STALLED = 2.0  # [-] times the file's largest incidence: deep in the stall, where the equations know nothing


class AircraftLostError(RuntimeError):
    """An aircraft is lost. The text names it, what happened and the time."""


class Watch:
    """One aircraft, tick by tick of dt_s [s]."""

    def __init__(self, m: Member, dt_s: float) -> None:
        self.m = m
        self._dt = dt_s
        self._upset: dict[str, list[float]] = {}  # what it is beyond -> for how long, and since when not any more [s]
        self._within_s = 0.0 if m.cfg.start.upset is not None else math.inf  # since it started upset
        self._alpha = STALLED * math.radians(m.ac.limits.alpha_max_deg)
        limit = m.ac.structure
        self._load, self._eas, self._mach = limit.load_g, limit.dive_eas_mps, limit.dive_mach
        self._safe = min(self._eas, self._mach * LEAST_SOUND)
        m.bounds[:] = *self._load, self._safe, THIN_M, PITCH, BANK, self._alpha, RATE

    @property
    def calm(self) -> bool:
        """Whether it has nothing to remember: as long as it is within its bounds there is nothing to look at."""
        return not self._upset and self._within_s > HOLD_S

    def step(self) -> str:
        """What has happened to it, as of the present view; "" while it flies."""
        if self.m.well and not self._upset and self._within_s > HOLD_S:
            return ""
        view = self.m.view
        s, o = view.s, view.o
        if not math.isfinite(sum(s)):
            return "has left the model: its state is not finite"
        height = -s[n.S_P + 2]
        if height <= 0.0:
            return "hit the ground"
        load, (least, most) = -o[2] / n.G0, self._load
        if not least <= load <= most:
            return f"broke up: load factor {load:.2f}, its structure bears {least:g} to {most:g}"
        if o[n.O_V] > self._safe or height < THIN_M:
            _, _, rho, sound = self.m.air(height)
            eas, mach = o[n.O_V] * math.sqrt(rho / RHO0), o[n.O_V] / sound
            if eas > self._eas:
                return f"broke up: {eas:.0f} m/s equivalent airspeed, its structure bears {self._eas:g}"
            if mach > self._mach:
                return f"broke up: Mach {mach:.2f}, its structure bears {self._mach:g}"
        pitch, bank, alpha = o[n.O_EULER + 1], o[n.O_EULER + 2], o[n.O_ALPHA]
        rate = max(abs(s[n.S_W]), abs(s[n.S_W + 1]), abs(s[n.S_W + 2]))
        well = abs(bank) <= BANK and abs(pitch) <= PITCH and abs(alpha) <= self._alpha and rate <= RATE
        if well and not self._upset and self._within_s > HOLD_S:
            return ""
        seen = (
            ("bank", bank, BANK), ("pitch", pitch, PITCH), ("incidence", alpha, self._alpha), ("rate", rate, RATE),
        )  # fmt: skip
        if self._within_s <= HOLD_S:
            inside = all(abs(value) <= bound for _, value, bound in seen)
            self._within_s = self._within_s + self._dt if inside else 0.0
            return ""
        for what, value, bound in seen:
            beyond = abs(value) > bound
            if not beyond and what not in self._upset:
                continue
            times = self._upset.setdefault(what, [0.0, 0.0])
            times[0], times[1] = times[0] + self._dt * beyond, 0.0 if beyond else times[1] + self._dt
            if times[1] > HOLD_S:
                del self._upset[what]
            elif times[0] > HOLD_S:
                now, most = math.degrees(value), math.degrees(bound)
                return f"is out of control: {what} {now:.0f}, for {HOLD_S:g} s beyond {most:.0f} deg{'/s' * (what == 'rate')}"
        return ""


class Collision:
    """Whether a follower `m` touches its leader, `lead`, in whose body axes its view has its place."""

    def __init__(self, lead: Member, m: Member) -> None:
        self.lead, self.m = lead, m
        self._mine, self._other = bars_of(lead.ac.structure.bars), bars_of(m.ac.structure.bars)
        self.reach = sum(_reach(x) for x in (self._mine, self._other))  # further apart the bars need no look

    def step(self) -> str:
        """What has happened to `m`; "" while they are apart."""
        xi = self.m.view.rel
        near = math.hypot(xi[n.R_XI], xi[n.R_XI + 1], xi[n.R_XI + 2]) < self.reach
        return f"touched {self.lead.cfg.name}" if near and self.gap() < 0.0 else ""

    def gap(self) -> float:
        """Least distance [m] between the two bodies; below 0 they touch."""
        lead, own = (np.array(quat_dcm(*v.s[0:4])) for v in (self.lead.view, self.m.view))
        return float(gap(self._mine, self._other, lead, own, np.array(self.m.view.rel[n.R_XI : n.R_XI + 3])))


def bars_of(rows: Sequence[Bar]) -> Arr:
    """[n, 7] start, stop, radius [m] of an airframe's bars; one off the plane of symmetry comes twice."""
    out = []
    for x0, y0, z0, x1, y1, z1, radius in rows:
        for side in (1.0, -1.0) if y0 or y1 else (1.0,):
            out.append((x0, side * y0, z0, x1, side * y1, z1, radius))
    return np.array(out, dtype=float).reshape(-1, 7)


def _reach(bars: Arr) -> float:
    return max((max(math.hypot(*x[:3]), math.hypot(*x[3:6])) + x[6] for x in bars.tolist()), default=0.0)


class Watches:
    """All aircraft of a world: each by itself, and each follower against its leader."""

    def __init__(self, members: Sequence[Member], dt_s: float) -> None:
        self._each = [Watch(m, dt_s) for m in members]
        self.pairs = [Collision(lead, m) for lead, m in pairs(members)]
        self._all: list[Watch | Collision] = [*self._each, *self.pairs]

    @property
    def calm(self) -> bool:
        """Whether nothing is seen as long as all are within their bounds and no pair within its reach."""
        return all(w.calm for w in self._each)

    def step(self, t_us: int, tick: int) -> None:
        """Raises AircraftLostError for the first that is lost at this tick."""
        for watch in self._all:
            if what := watch.step():
                raise AircraftLostError(f"{watch.m.cfg.name} {what} at t = {t_us / 1e6:.2f} s (tick {tick})")
