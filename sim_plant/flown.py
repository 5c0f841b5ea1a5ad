"""How the members of a world are flown through a tick: each by itself, or by their kind all together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from sim_plant.aircraft.base import Member
from sim_plant.block import Block
from sim_plant.couplings.base import Coupling
from sim_plant.failures.schedule import Outage
from sim_plant.lost import Watches
from sim_plant.wind.field import AirMass


@dataclass(frozen=True)
class Scene:
    """The members of a world in scenario order, started, and what acts on them. `block`: nobody's yet."""

    members: Sequence[Member]
    air: AirMass
    couplings: Sequence[Coupling]
    watches: Watches
    rate_hz: int
    block: Block


class Flown(Protocol):
    """One way to fly a scene. To the bit all are alike."""

    def sense(self, tick: int, t_us: int) -> None:
        """Who is where, wind, observation, losses, what couplings do, sensors: frames of the tick at t_us [us] without commands.
        Raises AircraftLostError."""
        ...

    def advance(self, outages: Sequence[Outage]) -> None:
        """Fly one tick by the commands in force; outages: of each member."""
        ...


class Apart:
    """Each by itself, whatever its kind."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def sense(self, tick: int, t_us: int) -> None:
        """See Flown."""
        x = self._scene
        for c in x.couplings:
            c.place()
        x.air.begin()
        for m in x.members:
            x.air.step(m, tick)
            m.observe()
        x.watches.step(t_us, tick)
        for c in x.couplings:
            c.act()
        for m in x.members:
            f = m.frame
            f.t_us, f.updated = t_us, 0
            if f.commands:
                f.commands = []
            m.bank.read(tick, t_us, m.view, f)

    def advance(self, outages: Sequence[Outage]) -> None:
        """See Flown."""
        for m, out in zip(self._scene.members, outages, strict=True):
            m.advance(out.jam)
        for c in self._scene.couplings:
            c.advance()
