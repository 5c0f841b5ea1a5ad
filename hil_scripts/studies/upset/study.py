"""The campaign `upset`: random upsets of receiver and tanker, and whether they come back to level flight."""

from __future__ import annotations

from hil_scripts.campaign.study import Case, Study
from hil_scripts.studies.upset.flight import OUTCOMES, run_case


def case(name: str, aircraft: str, *, load_g: tuple[float, float] = (0.0, 2.0), **more: object) -> Case:
    """load_g: of the lift over the weight at the start."""
    params = {"aircraft": aircraft, "load_g": list(load_g), "stalled": False, "airframe": "derivatives"}
    return Case(name, params | more)


STUDY = Study(
    name="upset",
    title="Upsets",
    purpose="any attitude, rates up to 30 deg/s about each axis, 0.8 to 1.1 times the airspeed of the trim: level again for 5 s "
    "within 60 s and 1500 m, or not, by the truth",
    cases=(
        case("receiver", "receiver"),
        case("receiver_stalled", "receiver", stalled=True),
        case("receiver_full", "receiver", airframe="full"),
        case("tanker", "tanker"),
    ),
    run=run_case,
    default_runs=100,
    binary=OUTCOMES,
)
