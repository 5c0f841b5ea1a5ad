"""A flight in memory, without logs or sockets, that can be copied whole: plant and onboard processes with every filter, delay
line and generator. A copy goes on bit for bit as the flight it was taken from; messages go through the same codecs, and are
handed over without being made into bytes where nobody wants those.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from functools import lru_cache
from typing import Generic

from flightsw.icd.port import DIRECT, H, Port
from flightsw.icd.wire import SPECS, Counters, split
from ground.link.packets import IDS, PHASES, Fields
from hil_scripts.launch import preflight, runfolder
from hil_scripts.studies.integrity.table import MOMENTS, Moment
from sim_plant.failures.script import Event, check_event
from sim_plant.server import PlantServer

STATUS = IDS["MISSION_STATUS"]
INTEGRITY = IDS["INTEGRITY_STATUS"]
HEARD = frozenset((STATUS, INTEGRITY, IDS["STATUSTEXT"]))
ACCEPT = {i: SPECS[i] for i in HEARD}


def said(datagrams: list[bytes]) -> Iterator[tuple[int, Fields]]:
    """MISSION_STATUS, INTEGRITY_STATUS and STATUSTEXT of an aircraft's telemetry: (message id, fields)."""
    for datagram in datagrams:
        for spec, values, *_ in split(datagram, ACCEPT, Counters()):
            yield spec.id, spec.to_dict(values)


def phase_in(fields: Fields) -> str:
    """The word of a MISSION_STATUS's phase."""
    return PHASES[int(fields["phase"])].lower()


class Flying(Generic[H]):
    """A scenario under way, between plant and aircraft by `port`. Raises ConfigError for what cannot be flown."""

    def __init__(
        self,
        scenario: str,
        seed: int,
        settings: tuple[str, ...] = (),
        port: Port[H] = DIRECT,  # type: ignore[assignment]
    ) -> None:
        self._begin(runfolder.resolve(scenario, seed, list(settings), None), port)

    @classmethod
    def of(cls, plan: runfolder.RunPlan, port: Port[H] = DIRECT) -> Flying[H]:  # type: ignore[assignment]
        """A plan under way. Raises ConfigError for what cannot be flown."""
        flight = cls.__new__(cls)
        flight._begin(plan, port)
        return flight

    def _begin(self, plan: runfolder.RunPlan, port: Port[H]) -> None:
        built = preflight.build(plan, port)
        self.server = PlantServer(built.world.scenario, plan.seed, None, built.world, port)
        self.nodes = built.nodes
        self.names = [f.name for f in plan.flights]

    def hear_only(self, messages: frozenset[int], of_last: frozenset[int] | None = None) -> None:
        """Let the aircraft send no messages but these (ids), and texts: nobody reads any other. of_last: other ones of the last
        aircraft. They fly alike."""
        for node in self.nodes:
            wanted = of_last if of_last is not None and node is self.nodes[-1] else messages
            for name in node.telemetry.rates:
                if IDS[name] not in wanted:
                    node.telemetry.set_rate(name, 0.0)

    @property
    def t_s(self) -> float:
        """Time of the tick to come [s]."""
        return self.server.t_us / 1e6

    def tick(self) -> tuple[list[H], list[list[bytes]]]:
        """One tick of everything: the replies of the aircraft and their telemetry datagrams. Raises AircraftLostError."""
        return self.tick_heard()[1:]

    def tick_heard(self) -> tuple[list[H], list[H], list[list[bytes]]]:
        """`tick`, and before it what each aircraft received from the plant."""
        sent = self.server.begin_tick()
        replies = [node.step((d,)) for node, d in zip(self.nodes, sent, strict=True)]
        self.server.end_tick(replies)
        telemetry = []
        for node in self.nodes:
            telemetry.append(node.after())
            if node.heard:
                node.take_heard()
            if node.settled:
                node.take_settled()
        return sent, replies, telemetry

    def fly_to(self, t_s: float) -> str:
        """Fly until the tick at t_s [s]; the phase the last aircraft reported then. Raises AircraftLostError."""
        end, phase = round(t_s * self.server.world.rate_hz), ""
        while self.server.tick < end:
            _, telemetry = self.tick()
            if end - self.server.tick < self.server.world.rate_hz:
                for kind, fields in said(telemetry[-1]):
                    phase = phase_in(fields) if kind == STATUS else phase
        return phase

    def fork(self) -> Flying[H]:
        """A copy that shares nothing with this flight that either changes."""
        return copy.deepcopy(self)

    def inject(self, event: Event) -> None:
        """Let a fault begin at the tick to come. Raises ConfigError if it fits no aircraft here."""
        check_event("fault", event, self.names)
        world = self.server.world
        world.faults.inject(event, world.tick)


def warm() -> None:
    """The first second of a flight of the matrix, thrown away: what flights like it use has been loaded."""
    m = next(iter(MOMENTS.values()))
    Flying(m.scenario, 1, m.settings).fly_to(1.0)


@lru_cache(maxsize=2)
def _flown(scenario: str, seed: int, settings: tuple[str, ...]) -> dict[str, Flying]:
    """Copies of one flight at every moment of its scenario, by name. Raises ValueError where it is in another phase."""
    flight, found = Flying(scenario, seed, settings), {}
    flight.hear_only(frozenset(), HEARD)  # of others a Watch reads texts
    here = {k: m for k, m in MOMENTS.items() if (m.scenario, m.settings) == (scenario, settings)}
    for name, m in sorted(here.items(), key=lambda item: item[1].t_s):
        phase = flight.fly_to(m.t_s)
        if phase != m.phase:
            raise ValueError(
                f"moment {name}: at t = {m.t_s:g} s of {scenario}, seed {seed}, the phase is {phase}, not {m.phase}"
            )
        found[name] = flight.fork()
    return found


def at(moment: str, seed: int) -> Flying:
    """A flight of its own at a named moment; the flight there is made once a process and seed."""
    m: Moment = MOMENTS[moment]
    return _flown(m.scenario, seed, m.settings)[moment].fork()
