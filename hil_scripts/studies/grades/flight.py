"""One graded refuelling: plant and onboard processes whole, the orders of the scenario, judged by the truth from contact on."""

from __future__ import annotations

import math

import numpy as np

from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.grades.estimates import LIMIT_M, READ, Estimates, in_contact, in_precontact
from hil_scripts.studies.grades.setting import Timetable, settings
from hil_scripts.studies.grades.words import Words
from hil_scripts.studies.integrity.flight import LOOK_HZ, RECEIVER, TANKER, Watch
from hil_scripts.studies.integrity.judge import Outcome, judge
from hil_scripts.studies.integrity.snapshot import HEARD, STATUS, Flying, phase_in, said
from hil_scripts.studies.integrity.table import Moment
from hil_scripts.studies.rows import Rows
from sim_plant.lost import AircraftLostError
from sim_plant.sensors.terms import PAPER

STATION_M = (-35.5, 0.0, 8.5)  # [m] contact, tanker axes
NOT_REACHED = "not_reached"  # contact was never flown, and nothing said why
REFUSED = "refused"  # nor was it, and the receiver left, saying why
OUTCOMES = (*(o.name.lower() for o in Outcome), REFUSED, NOT_REACHED)
LEAST_S = 5.0  # [s] of contact below which there are no figures of it


class Graded(Watch):
    """What Watch sees in contact, and the estimates there."""

    def __init__(self, estimates: Estimates, words: Words) -> None:
        flight = estimates.flight
        super().__init__(flight, Moment("refueling", flight.t_s, LIMIT_M, "contact", STATION_M))
        self.estimates, self.words = estimates, words
        self.contact = Rows(3)  # [m] true xi less the station, per look in contact

    def look(self) -> None:
        """The truth of the current tick, sensed."""
        super().look()
        e = self.estimates
        t, r = e.look()
        e.winds[TANKER].look(t)
        e.winds[RECEIVER].look(r)
        if math.isinf(self.left_s):
            self.contact.append(tuple(a - b for a, b in zip(r.xi, STATION_M, strict=True)))

    def read(self, telemetry: list[list[bytes]]) -> None:
        """Take in the telemetry of a tick, of both."""
        self.hear(telemetry)
        self.words.hear(telemetry[RECEIVER])
        if math.isinf(self.left_s):
            self.estimates.read(telemetry, True)


def arrive(e: Estimates, words: Words, latest_s: float) -> bool:
    """Fly until the receiver reports contact, or to latest_s [s]; whether it did. Raises AircraftLostError."""
    flight, world = e.flight, e.flight.server.world
    every = world.rate_hz // LOOK_HZ
    while flight.t_s < latest_s:
        if world.tick % every == 0:
            world.sense()
            e.look()
        _, telemetry = flight.tick()
        words.hear(telemetry[RECEIVER])
        if any(kind == STATUS and phase_in(f) == "contact" for kind, f in said(telemetry[RECEIVER])):
            return True
        e.read(telemetry, False)
    return False


def follow(watch: Graded, watch_s: float) -> bool:
    """Fly on for watch_s [s] or until an aircraft is lost; whether one was."""
    flight, world = watch.flight, watch.flight.server.world
    every = world.rate_hz // LOOK_HZ
    try:
        for _ in range(round(watch_s * world.rate_hz)):
            if world.tick % every == 0:
                world.sense()
                watch.look()
            _, telemetry = flight.tick()
            watch.read(telemetry)
    except AircraftLostError:
        return True
    return False


def figures(watch: Graded) -> dict[str, float]:
    """Station keeping and errors of the estimates while the receiver was in contact; nothing below LEAST_S of it."""
    if len(watch.contact) < LEAST_S * LOOK_HZ:
        return {}
    e = np.array(watch.contact)
    out = {f"contact.rms_m.{x}": float(np.sqrt(np.mean(e[:, i] ** 2))) for i, x in enumerate("xyz")}
    out |= {f"contact.p95_m.{x}": float(np.percentile(np.abs(e[:, i]), 95)) for i, x in enumerate("xyz")}
    out["contact.s"] = len(e) / LOOK_HZ
    return out | in_contact(watch.estimates)


def run_case(case: Case, seed: int) -> RunResult:
    """One flight of one seed under a grade and a level. Raises ConfigError for what cannot be flown."""
    p = case.params
    times, guarded, words = Timetable(**p.get("times", {})), p.get("guarded", False), Words()
    flight = Flying("refueling", seed % 2**31, settings(p["grade"], p["sigma_mps"], times, guarded))
    flight.hear_only(HEARD.union(READ))
    e = Estimates(flight, p["grade"] if guarded and p["grade"] != PAPER else "")
    outcome, values = NOT_REACHED, {}
    try:
        reached = arrive(e, words, times.arrive_s)
        outcome = REFUSED if words.breakaways else NOT_REACHED
    except AircraftLostError:
        reached, outcome = False, Outcome.LOST.name.lower()
    if reached:
        watch = Graded(e, words)
        track = watch.track(follow(watch, times.watch_s))
        outcome = judge(track, LIMIT_M).name.lower()
        values = figures(watch) | {"off_max_m": float(track.off.max()), "gap_min_m": float(track.gap.min())}
        values["unpaired"] = float(e.contact.unpaired)
    values |= {"reached_s": flight.t_s if not reached else watch.t0, "watched_s": flight.t_s}
    return RunResult({f"is.{o}": float(o == outcome) for o in OUTCOMES} | values | in_precontact(e) | words.figures())
