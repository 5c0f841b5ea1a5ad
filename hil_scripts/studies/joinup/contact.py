"""`joinup_contact`: the scenario rendezvous_to_contact whole, both aircraft with sensors of one grade, judged by the truth.

A flight makes contact and keeps it until the mission itself lets go, or leaves and says why; anything else is a fault. Nothing is
asked of the way there but that it is flown.
"""

from __future__ import annotations

import math

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.grades.estimates import LIMIT_M
from hil_scripts.studies.grades.flight import STATION_M
from hil_scripts.studies.grades.words import Words
from hil_scripts.studies.integrity.flight import LOOK_HZ, RECEIVER, Watch
from hil_scripts.studies.integrity.judge import KEEP_OUT_M
from hil_scripts.studies.integrity.snapshot import HEARD, STATUS, Flying, phase_in, said, warm
from hil_scripts.studies.integrity.table import Moment
from hil_scripts.studies.rows import Rows
from sim_plant.lost import AircraftLostError
from sim_plant.truth import truth_of

SCENARIO = "rendezvous_to_contact"
LATEST_S = 1100.0  # [s] contact is made by then or not at all
SETTLE_S = 10.0  # [s] of contact that the scenario's own figures leave out too
OUTCOMES = ("kept", "left", "refused", "not_reached", "keep_out", "lost")


def settings(grade: str) -> tuple[str, ...]:
    """What the scenario is changed by: sensors of `grade` on both, and the receiver's flight file that believes them."""
    sensors = tuple(f"plant.sensors.{who}.grade={grade}" for who in ("tanker", "receiver"))
    return (*sensors, f"plant.aircraft.receiver.mission=receiver_to_contact_{grade}")


class Held(Watch):
    """What is seen from contact on: true place less the station, per look while the receiver reports contact."""

    def __init__(self, flight: Flying) -> None:
        super().__init__(flight, Moment(SCENARIO, flight.t_s, LIMIT_M, "contact", STATION_M))
        self.contact = Rows(3)

    def look(self) -> None:
        """The truth of the current tick, sensed."""
        super().look()
        xi = truth_of(self.members[RECEIVER], self.flight.server.world.t_us).xi
        self.contact.append(tuple(a - b for a, b in zip(xi, STATION_M, strict=True)))

    def figures(self) -> dict[str, float]:
        """Station keeping in contact; no RMS where it lasted no longer than SETTLE_S."""
        gap = np.array(self.rows)[:, 2]
        out = {"contact.s": len(self.contact) / LOOK_HZ, "gap_min_m": float(gap.min(initial=math.inf))}
        e = np.array(self.contact)[round(SETTLE_S * LOOK_HZ) :]
        if len(e):
            out |= {f"contact.rms_m.{x}": float(np.sqrt(np.mean(e[:, i] ** 2))) for i, x in enumerate("xyz")}
            out |= {f"contact.p95_m.{x}": float(np.percentile(np.abs(e[:, i]), 95)) for i, x in enumerate("xyz")}
        return out


def _phase(telemetry: list[list[bytes]], last: str) -> str:
    for kind, fields in said(telemetry[RECEIVER]):
        last = phase_in(fields) if kind == STATUS else last
    return last


def fly(flight: Flying, words: Words) -> tuple[str, Held | None]:
    """Fly until contact has ended or LATEST_S [s] are over without it: one of OUTCOMES, and what was seen of contact."""
    world, phase, held = flight.server.world, "", None
    every = world.rate_hz // LOOK_HZ
    try:
        while not flight.server.done and (held is not None or flight.t_s < LATEST_S):
            if held is not None and world.tick % every == 0:
                world.sense()
                held.look()
            telemetry = flight.tick()[1]
            words.hear(telemetry[RECEIVER])
            phase = _phase(telemetry, phase)
            if held is None and phase == "contact":
                held = Held(flight)
            elif words.breakaways or (held is not None and phase != "contact"):
                break
    except AircraftLostError:
        return "lost", held
    if held is None:
        return ("refused" if words.breakaways else "not_reached"), None
    _, _, gap, over, _ = np.array(held.rows).T
    if ((gap < KEEP_OUT_M) | (over > 0.0)).any():
        return "keep_out", held
    return ("left" if words.breakaways else "kept"), held


def run_one(case: Case, seed: int) -> RunResult:
    """One flight of one seed. Raises ConfigError for what cannot be flown."""
    words = Words()
    flight = Flying(SCENARIO, seed % 2**31, settings(case.params["grade"]))
    flight.hear_only(frozenset(), HEARD)
    outcome, held = fly(flight, words)
    values = {f"is.{o}": float(o == outcome) for o in OUTCOMES} | {"ended_s": flight.t_s}
    if held is not None:
        values |= {"reached_s": held.t0} | held.figures()
    return RunResult(values | words.figures())


STUDY = Study(
    name="joinup_contact",
    title="From 30 NM to contact, sensors as they are",
    purpose="rendezvous, join-up and contact in one flight, sensors of one grade: contact made and kept, or left and said",
    cases=(Case("tactical", {"grade": "tactical"}),),
    run=run_one,
    warm=warm,
    default_runs=20,
    binary=OUTCOMES,
)
