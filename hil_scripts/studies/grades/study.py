"""The campaign `grades`: the refuelling under each grade of sensors of both aircraft, in each level of turbulence."""

from __future__ import annotations

from hil_scripts.campaign.study import Case, Study
from hil_scripts.studies.grades.flight import OUTCOMES, run_case
from sim_plant.sensors.terms import GRADES

LEVELS = (0.39, 0.94, 2.10, 6.22)  # [m/s] of the works; light, moderate, severe of MIL-F-8785C at 7010 m

GUARDED = "guarded"  # tactical, with onboard integrity and calibrated wind


def name_of(grade: str, sigma_mps: float) -> str:
    """Name of a case."""
    return f"{grade}_{sigma_mps:g}"


STUDY = Study(
    name="grades",
    title="Grades of sensors and turbulence",
    purpose="the refuelling in closed loop, contact held straight and in the turn, every sensor of both aircraft of one grade",
    cases=(
        *(Case(name_of(g, s), {"grade": g, "sigma_mps": s}) for g in GRADES for s in LEVELS),
        *(Case(name_of(GUARDED, s), {"grade": "tactical", "sigma_mps": s, "guarded": True}) for s in LEVELS),
    ),
    run=run_case,
    default_runs=20,
    small_cases=("paper_0.39", "tactical_0.39", "tactical_2.1", "mems_0.39", "guarded_0.39"),
    binary=OUTCOMES,
)
