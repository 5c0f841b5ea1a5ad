"""The plant's world: several aircraft in one moving air mass. The order of one tick is written here, once:

sense():  faults -> wind (sounding, slow, gusts, wake) -> what instruments see -> boom -> sensors -> frames
step():   command delay -> fuel transfer -> servos, forces, integration -> next tick
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError
from flightsw.types import ACCEPTED, DENIED, ActuatorCmd, Command, SensorFrame
from sim_plant.actuators import CommandPath
from sim_plant.aircraft.base import Craft
from sim_plant.aircraft.register import make_craft
from sim_plant.aircraft.sixdof.eom import step as integrate
from sim_plant.aircraft.sixdof.observe import observe
from sim_plant.aircraft.sixdof.trim import throttle_for, trim
from sim_plant.aircraft.sixdof.vehicle import Vehicle
from sim_plant.couplings.boom import BoomCoupling
from sim_plant.couplings.traffic import Traffic
from sim_plant.failures.judge import Verdict, judge
from sim_plant.failures.schedule import CLEAR, FaultPlan
from sim_plant.failures.script import ACTIONS, CMD_REFUEL, Event, plant_targets
from sim_plant.kernels import layout as n
from sim_plant.kernels.geometry import relative
from sim_plant.kernels.rot import quat_dcm
from sim_plant.lost import AircraftLostError, Watches
from sim_plant.scenario import SIXDOF, Scenario
from sim_plant.sensors.airdata import AirSensor
from sim_plant.truth import Truth, truth_of
from sim_plant.wind.field import AirMass

__all__ = ["AircraftLostError", "Injected", "World"]
MAG_N = np.array([0.215, 0.010, 0.440])  # [gauss] earth's field at the origin, NED (mid-latitude dipole)
GROUND_SYSID, GROUND_COMPID = 255, 190


@dataclass(frozen=True)
class Injected:
    """A command to the plant about aircraft i, as answered; `tick`: when it takes effect (accepted) or was refused."""

    tick: int
    i: int
    command: Command
    verdict: Verdict
    scripted: bool


class World:
    """Aircraft of a scenario flown from trim. Call sense(), answer with one ActuatorCmd per aircraft to step();
    repeat."""

    def __init__(self, scenario: Scenario, seed: int | None = None) -> None:
        self.scenario = scenario
        self.seed = scenario.meta.seed if seed is None else seed
        self.rate_hz = scenario.clock.base_rate_hz
        self.dt_s = 1.0 / self.rate_hz
        self.tick = 0
        self._sensed = False
        records = list(zip(scenario.aircraft, scenario.load_aircraft(), strict=True))
        six = [(c, ac) for c, ac in records if c.model == SIXDOF and isinstance(ac, Aircraft)]
        lead = six[0][1] if six else None
        self.vehicles = [Vehicle(i, c, a, lead if i else None, scenario, self.seed) for i, (c, a) in enumerate(six)]
        # aircraft of another kind fly by themselves, without leader, wake and boom
        others = [(c, ac) for c, ac in records if c.model != SIXDOF]
        self.air = AirMass(scenario.wind, self.vehicles, self.seed, self.dt_s, tuple(c.name for c, _ in others))
        self.crafts = [make_craft(c, ac, scenario, self.seed, self.air.steady(-c.start.pos_n_m[2])) for c, ac in others]
        both: list[Vehicle | Craft] = [*self.vehicles, *self.crafts]
        self.members = sorted(both, key=lambda v: scenario.aircraft.index(v.cfg))
        self.watches = Watches(self.members, self.vehicles, self.dt_s)
        for v in self.vehicles:
            self._start(v)
        self.air.fill_history(self.vehicles)
        tf = scenario.traffic
        wind = self.air.steady(tf.alt_m) if tf.on else (0.0, 0.0)
        self.traffic = Traffic(tf, scenario.track, wind, self.seed, self.dt_s) if tf.on else None
        self._tuned = [v for v in self.vehicles if v.cfg.tacan_to]
        self._receiver = next((v for v in self.vehicles if v.cfg.boom_to), None)
        for c in self.crafts:
            c.observe()
        for m in self.members:
            self._within_limits(m)
        self.boom: BoomCoupling | None = None
        if self._receiver is not None:
            leader = self._vehicle(self._receiver.cfg.boom_to)
            if leader.ac.boom is None or self._receiver.ac.receptacle is None:
                at = f"aircraft.{self._receiver.cfg.name}.boom_to = {leader.cfg.name!r}"
                raise ConfigError(f"{at}: that aircraft's file needs a [boom] and this one's a [receptacle]")
            self.boom = BoomCoupling(leader.ac.boom, scenario.refuel, self.dt_s)
        for m in self.members:
            for s in m.sensors:
                if isinstance(s, AirSensor):
                    s.names = [p.name for p in m.ac.probe]
        self.faults = FaultPlan(
            scenario, {v.cfg.name: {s.group: s for s in v.sensors} for v in self.members}, self.rate_hz, self.seed
        )
        for k, e in enumerate(scenario.event):
            for c in self.crafts:
                if e.kind == "jam" and e.target == c.cfg.name and e.surface not in c.surfaces:
                    raise ConfigError(
                        f"event[{k}].surface = {e.surface!r}: {e.target} (model = {c.cfg.model!r}) has {', '.join(c.surfaces)}"
                    )
        self.injected: list[Injected] = []  # commands to the plant; whoever records them empties it
        self._to_plant: dict[int, list[tuple[int, Command]]] = {}
        self._commands: dict[int, list[tuple[Vehicle | Craft, Command]]] = {}
        for k, e in enumerate(scenario.event):
            if e.kind == "command":
                self._script(f"event[{k}]", e)

    def _script(self, at: str, e: Event) -> None:
        """Note a scripted command for its tick. Raises ConfigError if it is one to the plant that the plant refuses."""
        tick = round(e.t_s * self.rate_hz)
        params = (float(ACTIONS[e.action]), *e.params[1:]) if e.action else e.params
        params = (*params, *([0.0] * (7 - len(params))))
        cmd = Command(CMD_REFUEL if e.action else e.command, params, GROUND_SYSID, GROUND_COMPID)
        named = plant_targets(e.target, [v.cfg.name for v in self.members])
        if named:  # as precise as on the wire, so that the same command from the ground does the same
            with np.errstate(over="ignore"):
                cmd = replace(cmd, params=tuple(float(np.float32(p)) for p in params))
        if not named:
            self._commands.setdefault(tick, []).append((self.members[self._place(e.target)], cmd))
        for name in named:
            i = self._place(name)
            verdict = self._judge(self.members[i], cmd)
            if verdict.result != ACCEPTED:
                raise ConfigError(f"{at}.params: refused by the plant: {verdict.text}")
            self._to_plant.setdefault(tick, []).append((i, cmd))

    def _judge(self, v: Vehicle | Craft, cmd: Command) -> Verdict:
        air = next((s for s in v.sensors if s.group == "air"), None)
        rate = self.rate_hz / air.div if air is not None else 0.0
        return judge(cmd.command, cmd.params, v.cfg.name, len(v.probes) if air is not None else 0, rate)

    def command(self, i: int, cmd: Command, scripted: bool = False) -> Injected:
        """A command to the plant about aircraft i: judged, noted in `injected`, and done at the next tick not yet sensed."""
        verdict = self._judge(self.members[i], cmd)
        tick = self.tick + 1 if self._sensed else self.tick
        e = verdict.event
        if e is not None and e.kind == CLEAR:
            if self.faults.wider(e):
                verdict = Verdict(DENIED, "a fault under way is wider than that; clear all of it")
            else:
                self.faults.clear(e, tick)
        elif e is not None:
            self.faults.inject(e, tick)
        self.injected.append(Injected(tick, i, cmd, verdict, scripted))
        return self.injected[-1]

    @property
    def t_us(self) -> int:
        """Simulated time of the current tick [us]."""
        return self.tick * 1_000_000 // self.rate_hz

    @property
    def done(self) -> bool:
        """Whether the scenario's duration is over."""
        return self.tick >= round(self.scenario.meta.duration_s * self.rate_hz)

    def _place(self, name: str) -> int:
        return next(i for i, v in enumerate(self.members) if v.cfg.name == name)

    def _vehicle(self, name: str) -> Vehicle:
        return next(v for v in self.vehicles if v.cfg.name == name)

    def _start(self, v: Vehicle) -> None:
        """Put an aircraft into trimmed flight in the mean wind (wake included, gusts not)."""
        st = v.cfg.start
        other = self._vehicle(st.relative_to) if st.relative_to else None
        if other is None:
            pos = np.array(st.pos_n_m)
            v.s[n.S_P : n.S_P + 3] = pos
            self.air.mean(v)
            psi = math.radians(st.psi_deg)
            vel = v.free + st.V_mps * np.array([math.cos(psi), math.sin(psi), 0.0])
            vel[2] = 0.0
        else:
            q = other.s
            C_nb = np.array(quat_dcm(q[0], q[1], q[2], q[3])).reshape(3, 3)
            pos = q[n.S_P : n.S_P + 3] + (C_nb * st.xi_m).sum(axis=1)
            vel = other.s[n.S_V : n.S_V + 3].copy()
            v.s[0:4] = other.s[0:4]
        fuel = float(v.s[n.S_FUEL])
        v.s[n.S_P : n.S_P + 3], v.s[n.S_V : n.S_V + 3] = pos, vel
        for _ in range(3):  # attitude and wake depend on each other a little
            self.air.mean(v)
            v.s[:] = trim(pos, vel, v.wind, fuel, v.par)
        self._observe(v)
        a, e, r = (float(x) for x in v.s[n.S_SURF : n.S_SURF + 3])
        v.trim = (a, e, r, throttle_for(v.s, v.wind, v.par), False, 0.0)
        v.path = CommandPath(
            self.seed,
            v.cfg.name,
            self.scenario.link.actuator_delay_ticks,
            self.scenario.link.actuator_jitter_ticks,
            v.trim,
        )

    def _within_limits(self, v: Vehicle | Craft) -> None:
        """Raise ConfigError for a start beyond the limits of the aircraft's file."""
        o, limits = (v.obs if isinstance(v, Vehicle) else v.view.o), v.ac.limits
        V, alpha = float(o[n.O_V]), math.degrees(o[n.O_ALPHA])
        if not limits.V_min_mps <= V <= limits.V_max_mps or not abs(alpha) <= limits.alpha_max_deg:
            raise ConfigError(
                f"aircraft.{v.cfg.name}.start: {V:.1f} m/s of airspeed at {alpha:.1f} deg of incidence; allowed by the limits of "
                f"{v.cfg.file!r}: {limits.V_min_mps:g} to {limits.V_max_mps:g} m/s, up to {limits.alpha_max_deg:g} deg"
            )

    def trim_cmd(self, i: int) -> ActuatorCmd:
        """The command that holds aircraft i in its initial trim."""
        a, e, r, t, _, flap = self.members[i].trim
        return ActuatorCmd(0, a, e, r, t, flap=flap)

    def _observe(self, v: Vehicle) -> None:
        observe(v.s, v.wind, v.free, v.par, MAG_N, v.probes, v.probe_wake, v.work, v.obs)

    def _evaluate(self) -> None:
        """Wind and everything instruments could see, at the current tick."""
        self.air.begin()
        for v in self.vehicles:
            if v.index:
                relative(self.vehicles[0].s, v.s, v.geo, v.rel)
            self.air.step(v, self.tick)
            self._observe(v)
            view = v.view
            view.s, view.o = v.s.tolist(), v.obs.tolist()
            if v.index:
                view.rel = v.rel.tolist()
        for c in self.crafts:
            self.air.over(c)
            c.observe()
        self.watches.step(self.t_us, self.tick)
        for v in self._tuned:
            self._tune(v)
        if self.boom is not None and self._receiver is not None:
            r, lead = self._receiver.view, self.vehicles[0]
            self.boom.step(r.rel, self._receiver.path.current[4])
            lead.view.rel = r.rel
            for view in (lead.view, r):
                view.contact, view.inside = self.boom.contact, self.boom.inside
            flow = self.boom.flow_kgps(
                lead.view.s[n.S_FUEL],
                r.s[n.S_FUEL],
                r.o[n.O_MASS],
                self._receiver.ac.mass.fuel_capacity_kg,
                self._receiver.ac.mass.max_kg,
            )
            r.transfer_kgps, lead.view.transfer_kgps = flow, -flow

    def _tune(self, v: Vehicle) -> None:
        """What the TACAN and the radar of `v` are directed at."""
        tf, track = self.traffic, self.scenario.track
        if tf is not None and v.cfg.tacan_to == tf.cfg.name:
            v.view.target, v.view.lateral_m, v.view.lateral_read = tf.position, tf.cfg.y_m, True
            return
        x, y, z = (float(a) for a in self._vehicle(v.cfg.tacan_to).s[n.S_P : n.S_P + 3])
        h = math.radians(track.heading_deg)
        v.view.target = (x, y, z)
        v.view.lateral_m = math.sin(h) * (x - track.north_m) - math.cos(h) * (y - track.east_m)

    def sense(self) -> list[SensorFrame]:
        """Sensor frames of the current tick, one per aircraft. The frame objects are reused from tick to tick.

        Raises AircraftLostError when an aircraft is lost.
        """
        if self._sensed:
            return [v.frame for v in self.members]
        for i, cmd in self._to_plant.pop(self.tick, ()):
            self.command(i, cmd, scripted=True)
        self.faults.step(self.tick)
        self._evaluate()
        t_us = self.t_us
        for v in self.members:
            f = v.frame
            f.t_us, f.updated = t_us, 0
            if f.commands:
                f.commands = []
            for s in v.sensors:
                s.step(self.tick, t_us, v.view, f)
        for v, cmd in self._commands.get(self.tick, ()):
            v.frame.commands = [*v.frame.commands, cmd]
        self._sensed = True
        return [v.frame for v in self.members]

    def step(self, cmds: list[ActuatorCmd] | list[ActuatorCmd | None]) -> None:
        """Advance one tick with the replies to the frames of `sense` (None: no reply, last command stays)."""
        if not self._sensed:
            self.sense()
        for v, cmd in zip(self.members, cmds, strict=True):
            v.path.push(self.tick, cmd)
            jam = self.faults.outage[v.cfg.name].jam
            if isinstance(v, Craft):
                v.advance(jam)
                continue
            a, e, r, t, _, _ = v.path.current
            v.c[:] = (a, e, r, t, jam[0], jam[1], jam[2], v.view.transfer_kgps)
            integrate(v.s, v.c, v.wind, v.par, self.dt_s, v.scratch)
        if self.traffic is not None:
            self.traffic.step()
        self.tick += 1
        self._sensed = False

    def link_up(self, i: int) -> bool:
        """Whether aircraft i's radio transmits and receives (no link_loss event active)."""
        return not self.faults.outage[self.members[i].cfg.name].link_down

    def truth(self, i: int) -> Truth:
        """True state of aircraft i at the current tick."""
        if not self._sensed:
            self.sense()
        return truth_of(self.members[i], self.t_us)

    def traffic_truth(self) -> Truth | None:
        """True state of the receiver of [traffic] at the current tick, if there is one."""
        if self.traffic is None:
            return None
        own = self.truth(0)
        return self.traffic.truth(self.t_us, own.pos_n, np.array(quat_dcm(*own.q_nb)).reshape(3, 3).T)
