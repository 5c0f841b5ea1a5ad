"""The couplings of a scenario, in the order in which they act."""

from __future__ import annotations

from collections.abc import Sequence

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.boom import BoomCoupling
from sim_plant.couplings.bow import BowCoupling
from sim_plant.couplings.relative import RelativeMotion, pairs
from sim_plant.couplings.traffic import Traffic
from sim_plant.couplings.tuning import MemberTarget, Tuning
from sim_plant.couplings.wake import WakeCoupling
from sim_plant.scenario import Scenario
from sim_plant.wind.field import AirMass


def build_couplings(sc: Scenario, members: Sequence[Member], air: AirMass, seed: int, dt_s: float) -> list[Coupling]:
    """Everything that acts between `members`, before they start. Raises ConfigError for a pair that cannot be coupled."""
    named = {m.cfg.name: m for m in members}
    out: list[Coupling] = [RelativeMotion(lead, m) for lead, m in pairs(members)]
    if sc.wind.wake.source:
        wake = WakeCoupling(sc.wind.wake, members, dt_s)
        air.disturb(wake)
        out.append(wake)
    if sc.wind.bow.source:
        bow = BowCoupling(sc.wind.bow, named[sc.wind.bow.source], members[0])
        air.disturb(bow)
        out.append(bow)
    traffic = Traffic(sc.traffic, sc.track, air.steady(sc.traffic.alt_m), seed, dt_s) if sc.traffic.on else None
    if traffic is not None:
        out.append(traffic)
    for m in members:
        to = m.cfg.tacan_to
        if traffic is not None and to == sc.traffic_name:
            out.append(Tuning(m, traffic))
        elif to:
            out.append(Tuning(m, MemberTarget(named[to], sc.track)))
    takers = [m for m in members if m.cfg.boom_to]
    for m in takers[1:]:
        raise ConfigError(
            f"aircraft.{m.cfg.name}.boom_to = {m.cfg.boom_to!r}: allowed: on one aircraft, and {takers[0].cfg.name!r} has it"
        )
    for m in takers:
        out.append(BoomCoupling(named[m.cfg.boom_to], m, sc.refuel, dt_s))
    return out
