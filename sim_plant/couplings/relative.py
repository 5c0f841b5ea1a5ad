"""Who is where relative to the leader: what relative navigation, boom and wake go by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.kernels import layout as n
from sim_plant.kernels.geometry import relative


def pairs(members: Sequence[Member]) -> list[tuple[Member, Member]]:
    """(leader, follower) of all that fly in formation: the first of them leads."""
    flight = [m for m in members if m.kind.formation]
    return [(flight[0], m) for m in flight[1:]]


class RelativeMotion(Coupling):
    """Place and velocity of a follower `m` in its leader's body axes, and of its receptacle in those of the leader's boom."""

    def __init__(self, lead: Member, m: Member) -> None:
        self._lead, self.m = lead, m
        self._rel, self.geometry = np.zeros(n.NR), np.zeros(7)
        if lead.boom is not None and m.receptacle is not None:
            self.geometry[0:3], self.geometry[3:6] = lead.boom.pivot_m, m.receptacle.position_m
            self.geometry[6] = lead.boom.length_retracted_m

    def place(self) -> None:
        relative(self._lead.s, self.m.s, self.geometry, self._rel)
        self.m.view.rel = self.m.view.boom = self._rel.tolist()
