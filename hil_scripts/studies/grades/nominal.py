"""A long refuelling without a fault, for false alerts: contact, pre-contact and contact again behind a tanker on a racetrack.

What the receiver says is counted; the truth is not looked at, which makes it as quick as it can be.
"""

from __future__ import annotations

from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.grades.setting import Timetable, settings
from hil_scripts.studies.grades.words import Words
from hil_scripts.studies.integrity.flight import RECEIVER
from hil_scripts.studies.integrity.snapshot import HEARD, Flying
from sim_plant.lost import AircraftLostError

BACK, AGAIN = 0.5, 2.0 / 3.0  # of the flight's length: back to pre-contact, and to contact again


def long_settings(grade: str, sigma_mps: float, flown_s: float) -> tuple[str, ...]:
    """What the scenario `refueling` is changed by for a flight of flown_s [s]."""
    return (
        *settings(grade, sigma_mps, Timetable(), guarded=True), f"plant.meta.duration_s={flown_s}",
        f"plant.event.2.t_s={BACK * flown_s}", f"plant.event.3.t_s={AGAIN * flown_s}", "plant.event.3.action=contact",
    )  # fmt: skip


def run_nominal(case: Case, seed: int) -> RunResult:
    """One flight of `long_s`, to its end or until the receiver leaves or is lost. Raises ConfigError for what cannot be flown."""
    p, words, lost = case.params, Words(), False
    flight = Flying("refueling", seed % 2**31, long_settings(p["grade"], p["sigma_mps"], p["long_s"]))
    flight.hear_only(frozenset(), HEARD)
    try:
        while flight.t_s < p["long_s"] and not words.breakaways:
            words.hear(flight.tick()[1][RECEIVER])
    except AircraftLostError:
        lost = True
    return RunResult({"watched_s": flight.t_s, "is.lost": float(lost)} | words.figures())
