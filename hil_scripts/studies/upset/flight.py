"""One upset: plant and onboard processes whole, from the first tick on, judged by the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

from flightsw.aircraft import Aircraft, load_aircraft
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.integrity.snapshot import Flying
from hil_scripts.studies.upset.draw import draw
from sim_plant.kernels.layout import G0
from sim_plant.lost import AircraftLostError
from sim_plant.truth import Truth, truth_of

HERE = Path(__file__).parent
FAR_M = [-2000.0, 2500.0, 0.0]  # of the receiver in the tanker's axes: out of wake and way
LEVEL, HELD_S = math.radians(5.0), 5.0  # [rad] of bank and path, [s] without a break
HEIGHT_M = 1500.0  # [m] there is to lose
TIME_S = 60.0  # [s] after which it has not recovered
LOOK_HZ = 20
V_TRIM, H_TRIM = 195.0, 7010.0  # [m/s], [m] of the scenarios
SETTINGS = {
    "receiver": (f"plant.aircraft.receiver.start.xi_m={FAR_M}",),
    "tanker": (),
}
OUTCOMES = ("recovered", "too_low", "lost", "not_level")


@dataclass
class Seen:
    """What the truth showed of one aircraft; `level_s`: since when it has been level, infinite: it is not."""

    ac: Aircraft
    h0: float
    level_s: float = math.inf
    since: float = math.inf
    lost_m: float = 0.0
    loads: list[float] = field(default_factory=list)
    V: list[float] = field(default_factory=list)

    def look(self, t_s: float, t: Truth, load: float) -> bool:
        """Take in one look at t_s [s]; whether it has been level for HELD_S."""
        path = math.asin(min(max((t.wind_n[2] - t.vel_n[2]) / t.V, -1.0), 1.0))
        flat = abs(t.euler[2]) < LEVEL and abs(path) < LEVEL
        level = flat and abs(t.alpha) < math.radians(self.ac.limits.alpha_max_deg)
        self.since = min(self.since, t_s) if level else math.inf
        self.lost_m = max(self.lost_m, self.h0 + t.pos_n[2])
        self.loads.append(load)
        self.V.append(t.V)
        return t_s - self.since >= HELD_S


def fly(case: Case, seed: int) -> tuple[str, Seen]:
    """One flight of one seed: outcome and what was seen. Raises ConfigError for what cannot be flown."""
    p = case.params
    who, files = p["aircraft"], {"receiver": "learjet24", "tanker": "kc135r"}
    ac = load_aircraft(files[who])
    upset = draw(ac, V_TRIM, H_TRIM, tuple(p["load_g"]), p["stalled"], seed)
    scenario = "refueling" if who == "receiver" else str(HERE / "tanker.toml")
    settings = (*SETTINGS[who], f"plant.aircraft.{who}.airframe={p['airframe']}", *upset.settings(who))
    flight = Flying(scenario, seed % 2**31, settings)
    flight.hear_only(frozenset())
    world = flight.server.world
    member = world.members[flight.names.index(who)]
    seen = Seen(ac, member.height_m)
    try:
        for k in range(round(TIME_S * world.rate_hz)):
            flight.tick()
            if k % (world.rate_hz // LOOK_HZ) == 0:
                world.sense()
                t = truth_of(member, world.t_us)
                if seen.look(flight.t_s, t, -member.view.o[2] / G0):
                    break
    except AircraftLostError as e:
        return "lost" if str(e).startswith(who) else "not_level", seen
    if seen.lost_m > HEIGHT_M:
        return "too_low", seen
    return "recovered" if math.isfinite(seen.since) and flight.t_s - seen.since >= HELD_S else "not_level", seen


def run_case(case: Case, seed: int) -> RunResult:
    """One upset of one seed. Raises ConfigError for what cannot be flown."""
    outcome, seen = fly(case, seed)
    values = {f"is.{o}": float(o == outcome) for o in OUTCOMES}
    values |= {"height_lost_m": seen.lost_m, "load_max_g": max(seen.loads), "load_min_g": min(seen.loads)}
    values |= {"V_max_mps": max(seen.V), "V_min_mps": min(seen.V), "level_after_s": seen.since}
    return RunResult(values)
