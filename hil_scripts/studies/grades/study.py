"""The campaign `grades`: the refuelling under each grade of sensors of both aircraft, in each level of turbulence."""

from __future__ import annotations

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.grades.flight import OUTCOMES, run_case
from hil_scripts.studies.grades.nominal import run_nominal
from hil_scripts.studies.integrity.snapshot import warm
from sim_plant.sensors.terms import GRADES

LEVELS = (0.39, 0.94, 2.10, 6.22)  # [m/s] of the works; light, moderate, severe of MIL-F-8785C at 7010 m

GUARDED = "guarded"  # with onboard integrity and calibrated wind by flight files that believe the grade's sensors
LIGHT, LONG_S = LEVELS[1], 1800.0  # 20 runs: 10 h


def name_of(grade: str, sigma_mps: float) -> str:
    """Name of a case."""
    return f"{grade}_{sigma_mps:g}"


def run(case: Case, seed: int) -> RunResult:
    """One flight of a case. Raises ConfigError for what cannot be flown."""
    return (run_nominal if "long_s" in case.params else run_case)(case, seed)


STUDY = Study(
    name="grades",
    title="Grades of sensors and turbulence",
    purpose="the refuelling in closed loop, contact held straight and in the turn, every sensor of both aircraft of one grade",
    cases=(
        *(Case(name_of(g, s), {"grade": g, "sigma_mps": s}) for g in GRADES for s in LEVELS),
        *(Case(name_of(GUARDED, s), {"grade": "tactical", "sigma_mps": s, "guarded": True}) for s in LEVELS),
        Case(name_of(f"{GUARDED}_mems", LIGHT), {"grade": "mems", "sigma_mps": LIGHT, "guarded": True}),
        Case(name_of("nominal", LIGHT), {"grade": "tactical", "sigma_mps": LIGHT, "guarded": True, "long_s": LONG_S}),
    ),
    run=run,
    warm=warm,
    default_runs=20,
    small_cases=("paper_0.39", "tactical_0.39", "tactical_2.1", "mems_0.39", "guarded_0.39"),
    binary=OUTCOMES,
)
