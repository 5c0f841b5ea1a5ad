"""One case: a copy of the flying system, the fault, and what is seen of it by the truth and over the wire."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from ground.link.packets import IDS
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.integrity import snapshot
from hil_scripts.studies.integrity.honest import Bounds, honest
from hil_scripts.studies.integrity.judge import OVER_BEHIND_M, Outcome, Track, judge, passed_s
from hil_scripts.studies.integrity.table import MOMENTS, Moment, event_of
from hil_scripts.studies.rows import Rows
from sim_plant.aircraft.base import Member
from sim_plant.lost import AircraftLostError, Collision
from sim_plant.truth import Truth, truth_of

WATCH_S = 25.0  # [s] flown after the fault
LOOK_HZ = 20  # of the truth
BANK = math.radians(70.0)
WARNING = 4  # MAV_SEVERITY, and what is below is worse
TEXT = IDS["STATUSTEXT"]
RECEIVER, TANKER = 1, 0  # places in the scenarios flown here


class Watch:
    """Truth and wire of a flight after a fault, look by look."""

    def __init__(self, flight: snapshot.Flying, m: Moment) -> None:
        self.flight, self.m, self.t0 = flight, m, flight.t_s
        world = flight.server.world
        self.members = world.members
        self.pair = Collision(self.members[TANKER], self.members[RECEIVER])
        tanker = self.members[TANKER].ac
        assert isinstance(tanker, Aircraft) and tanker.boom is not None
        geometry, boom = tanker.geometry, tanker.boom
        self._span, self._pivot = geometry.b_m / 2.0, boom.pivot_m[2]
        self.rows = Rows(5)  # [s], off the station [m], gap [m], 1 over the wing, 1 beyond limits
        self.bounds = Bounds()
        self.announced_s = self.left_s = math.inf

    def hear(self, telemetry: list[list[bytes]]) -> None:
        """Take in what both aircraft said at a tick."""
        now = self.flight.t_s - self.t0
        for i, datagrams in enumerate(telemetry):
            for kind, fields in snapshot.said(datagrams):
                if kind == TEXT and fields["severity"] <= WARNING:
                    self.announced_s = min(self.announced_s, now)
                elif kind == snapshot.INTEGRITY and i == RECEIVER:
                    self.bounds.hear(fields)
                elif kind == snapshot.STATUS and i == RECEIVER:
                    self._entered(snapshot.phase_in(fields), now)

    def _entered(self, phase: str, now: float) -> None:
        if phase != self.m.phase:
            self.left_s = min(self.left_s, now)
            self.announced_s = min(self.announced_s, now)

    def look(self) -> None:
        """The truth of the current tick."""
        world = self.flight.server.world
        truths = [truth_of(m, world.t_us) for m in self.members]
        r = truths[RECEIVER]
        x, y, z = r.xi
        self.bounds.see(world.t_us, r.xi)
        over = z < self._pivot and abs(y) < self._span and -OVER_BEHIND_M < x < self._span
        beyond = any(map(_beyond, self.members, truths))
        self.rows.append((world.t_us / 1e6 - self.t0, math.dist(r.xi, self.m.station_m), self.pair.gap(), over, beyond))

    def track(self, lost: bool) -> Track:
        """What has been seen."""
        t, off, gap, over, beyond = np.array(self.rows).T
        return Track(t, off, gap, over > 0.0, beyond > 0.0, self.announced_s, self.left_s, lost)


def _beyond(m: Member, t: Truth) -> bool:
    """Whether an aircraft is beyond 70 deg of bank or the limits of its file."""
    limit = m.ac.limits
    fast = not limit.V_min_mps <= t.V <= limit.V_max_mps
    return abs(t.euler[2]) > BANK or fast or abs(t.alpha) > math.radians(limit.alpha_max_deg)


def follow(flight: snapshot.Flying, m: Moment, watch_s: float = WATCH_S) -> tuple[Track, Bounds]:
    """Fly on from a moment for watch_s [s] or until an aircraft is lost, and say what was seen, and what bounds were heard."""
    watch, lost = Watch(flight, m), False
    every = flight.server.world.rate_hz // LOOK_HZ
    try:
        for k in range(round(watch_s * flight.server.world.rate_hz)):
            _, telemetry = flight.tick()
            watch.hear(telemetry)
            if k % every == 0:
                flight.server.world.sense()
                watch.look()
    except AircraftLostError:
        lost = True
    return watch.track(lost), watch.bounds


def run_case(case: Case, seed: int) -> RunResult:
    """Put the case's fault into a copy of the flying system. Raises what `snapshot.at` and `inject` do."""
    p = case.params
    m = MOMENTS[p["moment"]]
    flight = snapshot.at(p["moment"], seed)
    for event in p["events"]:
        flight.inject(event_of(event))
    t0 = flight.t_s
    track, bounds = follow(flight, m)
    outcome = judge(track, m.limit_m)
    values = {f"is.{o.name.lower()}": float(o is outcome) for o in Outcome}
    values |= {
        "outcome": float(outcome),
        "off_max_m": float(track.off.max()),
        "gap_min_m": float(track.gap.min()),
        "announced_s": track.announced_s,
        "left_s": track.left_s,
        "passed_s": passed_s(track, m.limit_m),
    }
    t, ratio = bounds.ratios()
    return RunResult(values | honest(t - t0, ratio, track.announced_s))
