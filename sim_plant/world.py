"""The plant's world: several aircraft in one moving air mass. The order of one tick is written here, once:

sense():  orders, faults -> who is where -> wind on each and what its instruments see -> losses -> couplings -> sensors -> frames
step():   command delay -> each member's servos, forces, integration -> what couplings move -> next tick

Between orders and frames, and from the servos on, flown.py goes through it.
"""

from __future__ import annotations

from flightsw.types import ActuatorCmd, Command, SensorFrame
from sim_plant.aircraft.kind import Setup, kind_of
from sim_plant.block import Block
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.build import build_couplings
from sim_plant.failures.actuators import bend
from sim_plant.failures.orders import Injected, Orders
from sim_plant.failures.schedule import FaultPlan
from sim_plant.flown import Apart, Flown, Scene
from sim_plant.lost import AircraftLostError, Watches
from sim_plant.scenario import Scenario
from sim_plant.truth import Truth, truth_of
from sim_plant.wind.field import AirMass

__all__ = ["AircraftLostError", "Injected", "World"]


class World:
    """Aircraft of a scenario flown from steady flight. Call sense(), answer with one ActuatorCmd per aircraft to step();
    repeat. Raises ConfigError naming what of the scenario cannot be flown. together=False: each aircraft flies by itself, though
    its kind could fly all at once, to the same bit."""

    def __init__(self, scenario: Scenario, seed: int | None = None, together: bool = True) -> None:
        self._block = Block()  # first: a copy of a world begins with it
        self.scenario = scenario
        self.seed = scenario.meta.seed if seed is None else seed
        self.rate_hz = scenario.clock.base_rate_hz
        self.dt_s = 1.0 / self.rate_hz
        self.tick = 0
        self._sensed = False
        records = scenario.load_aircraft()
        kinds = [kind_of(a) for a in scenario.aircraft]
        aloft = [(a.name, k.formation) for a, k in zip(scenario.aircraft, kinds, strict=True)]
        self.air = AirMass(scenario.wind, aloft, self.seed, self.dt_s)
        self.members = [
            k.build(Setup(k, a, ac, scenario, self.seed))
            for k, a, ac in zip(kinds, scenario.aircraft, records, strict=True)
        ]
        self.couplings = build_couplings(scenario, self.members, self.air, self.seed, self.dt_s)
        self._with_others = [c for c in self.couplings if type(c).others is not Coupling.others]
        named = {m.cfg.name: m for m in self.members}
        for m in self.members:
            to = m.cfg.start.relative_to
            m.start(self.air, named[to] if to else None)
        for m in self.members:
            m.unit.begin(m.view)
        self.air.fill_history(self.members)
        for m in self.members:
            m.check_limits()
        self.watches = Watches(self.members, self.dt_s)
        self.faults = FaultPlan(scenario, self.members, self.seed)
        self._outages = [self.faults.outage[m.cfg.name] for m in self.members]
        self.orders = Orders(scenario, self.members, self.faults)
        self._frames = [m.frame for m in self.members]
        self._steered = [(m.path, m.unit, m.view, out) for m, out in zip(self.members, self._outages, strict=True)]
        scene = Scene(self.members, self.air, self.couplings, self.watches, self.rate_hz, self._block)
        whole = kinds[0].together(scene) if together and all(k == kinds[0] for k in kinds) else None
        self._flown: Flown = Apart(scene) if whole is None else whole

    @property
    def t_us(self) -> int:
        """Simulated time of the current tick [us]."""
        return self.tick * 1_000_000 // self.rate_hz

    @property
    def done(self) -> bool:
        """Whether the scenario's duration is over."""
        return self.tick >= round(self.scenario.meta.duration_s * self.rate_hz)

    def sense(self) -> list[SensorFrame]:
        """Sensor frames of the current tick, one per aircraft. The frame objects are reused from tick to tick.

        Raises AircraftLostError when an aircraft is lost.
        """
        if self._sensed:
            return self._frames
        tick = self.tick
        self.orders.begin(tick)
        self.faults.step(tick)
        self._flown.sense(tick, tick * 1_000_000 // self.rate_hz)
        self.orders.deliver(tick)
        self._sensed = True
        return self._frames

    def step(self, cmds: list[ActuatorCmd] | list[ActuatorCmd | None]) -> None:
        """Advance one tick with the replies to the frames of `sense` (None: no reply, last command stays)."""
        if not self._sensed:
            self.sense()
        tick = self.tick
        for (path, unit, view, out), cmd in zip(self._steered, cmds, strict=True):
            path.push(tick, cmd)
            if path.silent > unit.after:
                path.current = unit.command(path.current, view)
            if out.bent:
                path.current = bend(path.current, out.bent, view)
        self._flown.advance(self._outages)
        self.tick = tick + 1
        self._sensed = False

    def command(self, i: int, cmd: Command) -> Injected:
        """A command to the plant about aircraft i: judged, noted in `injected`, and done at the next tick not yet sensed."""
        return self.orders.command(i, cmd, self.tick + 1 if self._sensed else self.tick)

    @property
    def injected(self) -> list[Injected]:
        """Commands to the plant; whoever records them empties it."""
        return self.orders.injected

    def trim_cmd(self, i: int) -> ActuatorCmd:
        """The command that holds aircraft i in its initial trim."""
        a, e, r, t, _, flap = self.members[i].trim
        return ActuatorCmd(0, a, e, r, t, flap=flap)

    def link_up(self, i: int) -> bool:
        """Whether aircraft i's radio transmits and receives (no link_loss event active)."""
        return not self._outages[i].link_down

    def truth(self, i: int) -> Truth:
        """True state of aircraft i at the current tick."""
        if not self._sensed:
            self.sense()
        return truth_of(self.members[i], self.t_us)

    def others(self) -> list[tuple[int, Truth]]:
        """(sysid, true state) at the current tick of what flies without being a member."""
        if not self._with_others:
            return []
        own = self.truth(0)
        return [x for c in self._with_others for x in c.others(own)]
