"""What the TACAN and the radar of an aircraft are directed at."""

from __future__ import annotations

import math
from typing import Protocol

from flightsw.types import Vec3
from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.traffic_config import Track
from sim_plant.kernels import layout as n


class Target(Protocol):
    """Something a set can be tuned to."""

    lateral_read: bool  # lateral_m is already what the crew reads, the truth being spread about it

    @property
    def position(self) -> Vec3:
        """North, east, down [m]."""

    @property
    def lateral_m(self) -> float:
        """Off the refuelling track [m]."""


class MemberTarget:
    """Another member; `track`: what lateral positions are measured from."""

    lateral_read = False

    def __init__(self, m: Member, track: Track) -> None:
        self._m, self._track = m, track

    @property
    def position(self) -> Vec3:
        """North, east, down [m]."""
        x, y, z = self._m.view.s[n.S_P : n.S_P + 3]
        return x, y, z

    @property
    def lateral_m(self) -> float:
        """Off the refuelling track [m]."""
        (x, y, _), t = self.position, self._track
        h = math.radians(t.heading_deg)
        return math.sin(h) * (x - t.north_m) - math.cos(h) * (y - t.east_m)


class Tuning(Coupling):
    """The set of `m` is tuned to `to`."""

    def __init__(self, m: Member, to: Target) -> None:
        self._m, self._to = m, to

    def act(self) -> None:
        view, to = self._m.view, self._to
        view.target, view.lateral_m, view.lateral_read = to.position, to.lateral_m, to.lateral_read
