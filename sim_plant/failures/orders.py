"""Commands of the scenario and of the ground: to aircraft, handed to their frames; to the plant, judged and done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flightsw.strict import ConfigError
from flightsw.types import ACCEPTED, DENIED, Command
from sim_plant.aircraft.base import Member
from sim_plant.failures.judge import judge
from sim_plant.failures.numbers import Fitted, Verdict
from sim_plant.failures.schedule import CLEAR, FaultPlan
from sim_plant.failures.script import ACTIONS, CMD_REFUEL, Event, plant_targets
from sim_plant.scenario import Scenario

GROUND_SYSID, GROUND_COMPID = 255, 190


@dataclass(frozen=True)
class Injected:
    """A command to the plant about aircraft i, as answered; `tick`: when it takes effect (accepted) or was refused."""

    tick: int
    i: int
    command: Command
    verdict: Verdict
    scripted: bool


class Orders:
    """Scripted commands by tick, and whatever the ground sends. `injected`: commands to the plant; whoever records them empties
    it. Raises ConfigError for a scripted command to the plant that the plant refuses."""

    def __init__(self, sc: Scenario, members: Sequence[Member], faults: FaultPlan) -> None:
        self._members, self._faults = members, faults
        self._rate_hz = sc.clock.base_rate_hz
        self._radio = len(members) > 1
        self.injected: list[Injected] = []
        self._to_plant: dict[int, list[tuple[int, Command]]] = {}
        self._commands: dict[int, list[tuple[Member, Command]]] = {}
        self._place = {m.cfg.name: i for i, m in enumerate(members)}
        for k, e in enumerate(sc.event):
            if e.kind == "command":
                self._script(f"event[{k}]", e)

    def _script(self, at: str, e: Event) -> None:
        tick = round(e.t_s * self._rate_hz)
        params = (float(ACTIONS[e.action]), *e.params[1:]) if e.action else e.params
        params = (*params, *([0.0] * (7 - len(params))))
        cmd = Command(CMD_REFUEL if e.action else e.command, params, GROUND_SYSID, GROUND_COMPID)
        named = plant_targets(e.target, list(self._place))
        if not named:
            self._commands.setdefault(tick, []).append((self._members[self._place[e.target]], cmd))
            return
        # as precise as on the wire, so that the same command from the ground does the same
        with np.errstate(over="ignore"):
            cmd = replace(cmd, params=tuple(float(np.float32(p)) for p in params))
        for name in named:
            i = self._place[name]
            verdict = self._judge(self._members[i], cmd)
            if verdict.result != ACCEPTED:
                raise ConfigError(f"{at}.params: refused by the plant: {verdict.text}")
            self._to_plant.setdefault(tick, []).append((i, cmd))

    def _judge(self, m: Member, cmd: Command) -> Verdict:
        air = next((s for s in m.sensors if s.group == "air"), None)
        rate = self._rate_hz / air.div if air is not None else 0.0
        rates = {s.group: self._rate_hz / s.div for s in m.sensors if s.group != "air"}
        probes = len(m.probes) if air is not None else 0
        columns = {s.group: s.columns for s in m.sensors}
        fitted = Fitted(
            probes, rate, rates, tuple(m.kind.surfaces), self._radio, columns, m.engines, m.tanks is not None
        )
        return judge(cmd.command, cmd.params, m.cfg.name, fitted)

    def command(self, i: int, cmd: Command, tick: int, scripted: bool = False) -> Injected:
        """A command to the plant about aircraft i: judged, noted in `injected`, and done at `tick`, not yet sensed."""
        verdict = self._judge(self._members[i], cmd)
        e = verdict.event
        if e is not None and e.kind.startswith(CLEAR):
            if self._faults.wider(e):
                verdict = Verdict(DENIED, "a fault under way is wider than that; clear all of it")
            else:
                self._faults.clear(e, tick)
        elif e is not None:
            self._faults.inject(e, tick)
        self.injected.append(Injected(tick, i, cmd, verdict, scripted))
        return self.injected[-1]

    def begin(self, tick: int) -> None:
        """Scripted commands to the plant at `tick`."""
        for i, cmd in self._to_plant.pop(tick, ()):
            self.command(i, cmd, tick, scripted=True)

    def deliver(self, tick: int) -> None:
        """Scripted commands to aircraft at `tick`, into their frames."""
        for m, cmd in self._commands.get(tick, ()):
            m.frame.commands = [*m.frame.commands, cmd]
