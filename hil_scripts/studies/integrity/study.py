"""The campaign `integrity`: every case of the fault matrix from copies of the flying system."""

from __future__ import annotations

from hil_scripts.campaign.study import Study
from hil_scripts.studies.integrity.flight import run_case
from hil_scripts.studies.integrity.judge import Outcome
from hil_scripts.studies.integrity.snapshot import warm
from hil_scripts.studies.integrity.table import DATA, cases

STUDY = Study(
    name="integrity",
    title="Fault matrix",
    purpose="one fault put into the flying system at a time (two, for the relative sensor with each other source): kept, left in "
    "time, late, silent, keep-out violated, upset or lost, by the truth",
    cases=cases(DATA),
    run=run_case,
    warm=warm,
    default_runs=5,
    small_cases=("straight_*_off_whole",),
    binary=(*(o.name.lower() for o in Outcome), "honest"),
)
