"""All aircraft of a world in two compiled calls a tick, when all are of six degrees of freedom and nothing is in the air but what
those calls know: prevailing wind, gusts met alike by a whole airframe, a straight wake. What else there is goes on as it does."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from sim_plant.aircraft.base import MAG_N
from sim_plant.aircraft.sixdof import together_kernel as k
from sim_plant.aircraft.sixdof.member import SixDofMember
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.boom import BoomCoupling
from sim_plant.couplings.relative import RelativeMotion
from sim_plant.couplings.wake import WakeCoupling
from sim_plant.failures.schedule import Outage
from sim_plant.flown import Scene
from sim_plant.kernels import layout as n
from sim_plant.sensors.banks import Banks, Carrier
from sim_plant.wind.gusts import Gusts

RADIAL, SPEED, FUEL, MASS = (
    k.B_BOOM + n.R_EXTDOT,
    k.B_BOOM + n.R_SPEED,
    k.B_HELD + n.S_FUEL,
    k.B_OBS + n.O_MASS,
)  # for the boom
PUT = struct.Struct(f"{n.NC}d")  # a command into its row: half the time numpy takes


def together(scene: Scene) -> Together | None:
    """What flies a scene of this kind's members at once; None for one it does not know how to."""
    members = [m for m in scene.members if type(m) is SixDofMember]
    gusts = scene.air.shared(scene.members)
    if len(members) < len(scene.members) or gusts is None:
        return None
    if not all(isinstance(d, WakeCoupling) and d.straight for d in scene.air.disturbances):
        return None
    booms = [c for c in scene.couplings if isinstance(c, BoomCoupling)]
    if any(c.giver is not members[0] for c in booms) or len(booms) > 1:
        return None
    return Together(scene, members, gusts, booms[0] if booms else None)


class Together:
    """The members, the first of them leading, in the rows of the scene's block; theirs are views on it from now on."""

    def __init__(self, scene: Scene, members: Sequence[SixDofMember], gusts: Gusts, boom: BoomCoupling | None) -> None:
        self._block = scene.block
        self._members, self._air, self._gusts, self._boom = members, scene.air, gusts, boom
        self._watches, self._calm = scene.watches, False
        self._dt = 1.0 / scene.rate_hz
        self._block.size(len(members), k.B_PAR + max(len(m.par) for m in members))
        self._ints = np.zeros((len(members), k.NI), dtype=np.int64)
        wake = next((d for d in scene.air.disturbances if isinstance(d, WakeCoupling)), None)
        for i, m in enumerate(members):
            self._lay(i, m)
            if i:
                self._ints[i, k.I_WAKE] = wake is not None
                self._ints[i, k.I_TAKER] = boom is not None and boom.taker is m
        rows = self._block.rows
        if wake is not None:
            rows[0, k.B_SOURCE : k.B_MOST] = wake.source
        rows[0, k.B_MOST], rows[0, k.B_TICKS] = gusts.most, scene.air.rate
        self._ints[0, k.I_ALIGNED], self._ints[0, k.I_AHEAD] = scene.air.aligned, gusts.ahead
        for c in scene.couplings:
            if isinstance(c, RelativeMotion):
                rows[self._row(c.m), k.B_GEO : k.B_ENVELOPE] = c.geometry
        for pair in scene.watches.pairs:
            rows[self._row(pair.m), k.B_REACH] = pair.reach
        if boom is not None:
            rows[self._row(boom.taker), k.B_ENVELOPE : k.B_REACH] = *boom.el, *boom.az, *boom.ext
        rest = [c for c in scene.couplings if not isinstance(c, (RelativeMotion, WakeCoupling, BoomCoupling))]
        self._placing = [c for c in rest if type(c).place is not Coupling.place]
        self._acting = [c for c in rest if type(c).act is not Coupling.act]
        self._moving = [c for c in rest if type(c).advance is not Coupling.advance]
        self._views = [m.view for m in members]
        self._steered = [(m, m.path, m.view, 8 * (i * rows.shape[1] + k.B_C)) for i, m in enumerate(members)]
        self._taker = self._row(boom.taker) if boom is not None else 0
        self._banks = Banks([Carrier(m.bank, m.view, m.frame) for m in members])

    def _row(self, m: object) -> int:
        return next(i for i, own in enumerate(self._members) if own is m)

    def _lay(self, i: int, m: SixDofMember) -> None:
        lay, x = self._block.lay, m.exposure
        m.to_row(lambda at, array: lay(i, at, array))
        rel, boom = (lay(i, at, np.array(v)) for at, v in ((k.B_REL, m.view.rel), (k.B_BOOM, m.view.boom)))
        m.view.see_pair(rel, boom)
        row, ints = self._block.rows[i], self._ints[i]
        row[k.B_MAG : k.B_GEO] = MAG_N
        ints[k.I_PROBES], ints[k.I_PAR] = len(m.probes), len(m.par)
        if x is not None:
            ints[k.I_POINTS], ints[k.I_SPAN], ints[k.I_FRAME] = len(x.points), x.n_span, x.n_frame
            row[k.B_POINTS : k.B_POINTS + x.points.size] = x.points.ravel()
            row[k.B_WEIGHT : k.B_WEIGHT + x.weight.size] = x.weight.ravel()

    def sense(self, tick: int, t_us: int) -> None:
        """See Flown."""
        for c in self._placing:
            c.place()
        air, g, banks = self._air, self._gusts, self._banks
        air.begin()
        row = g.at_hand()
        if row < 0:
            row = g.next_row(self._members[0].height_m)
        plan, store, rows = banks.due(tick), banks.store, self._block.rows
        while True:
            code = k.sense_all(
                rows, self._ints, g.rows, row, g.rings, tick, air.table, air.slow, air.slow_at, t_us, plan.flow, plan.which,
                store.f, store.k, plan.out,
            )  # fmt: skip
            if code >= 0:
                break
            plan.draw()
        for v in self._views:
            v.due = v.pair_due = True
        if code > k.INSIDE or not self._calm:
            for i, m in enumerate(self._members):
                m.well = not code & k.UNWELL << i
            self._watches.step(t_us, tick)
            self._calm = self._watches.calm
        boom = self._boom
        for c in self._acting:
            c.act()
        if boom is not None and (code & k.INSIDE or not boom.idle):
            i, one = self._taker, rows.item
            boom.see(
                code & k.INSIDE != 0, one(i, RADIAL), one(i, SPEED), one(0, FUEL), one(i, FUEL), one(i, MASS)
            )  # fmt: skip
        banks.tell(plan, tick, t_us)

    def advance(self, outages: Sequence[Outage]) -> None:
        """See Flown."""
        put, rows = PUT.pack_into, self._block.rows
        for (m, path, view, at), out in zip(self._steered, outages, strict=True):
            a, e, r, t, _, _ = path.current
            j0, j1, j2 = out.jam
            put(rows, at, a, e, r, t, j0, j1, j2, view.transfer_kgps - m.leak_kgps)  # type: ignore[arg-type]
        k.advance_all(rows, self._ints, self._dt)
        for c in self._moving:
            c.advance()
