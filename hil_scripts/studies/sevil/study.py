"""Sevil (2013), the table cases: position in the wake and air-data fault detection, printed method beside ours.

One study whose cases are of several kinds; the sweeps and the full sets are the studies sevil_* of the other modules.
"""

from __future__ import annotations

from collections.abc import Callable

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil import dynamic as sevil_dynamic
from hil_scripts.studies.sevil import faults as sevil_faults
from hil_scripts.studies.sevil import fdi as sevil_fdi
from hil_scripts.studies.sevil import static as sevil_static

RUN: dict[str, Callable[[Case, int], RunResult]] = {
    "static": sevil_static.run_static,
    "dynamic": sevil_dynamic.run_dynamic,
    "mismatch": sevil_dynamic.run_mismatch,
    "fdi_table": sevil_fdi.run_table,
    "two_faults": sevil_fdi.run_two_faults,
    "integrated": sevil_faults.run_integrated,
}


def run_case(case: Case, seed: int) -> RunResult:
    """One run of a case of any kind. Raises KeyError for an unknown kind."""
    return RUN[case.params["kind"]](case, seed)


TABLE = Study(
    name="sevil",
    title="Air data: position in the wake, and faults",
    purpose="the table cases of Sevil (2013): the printed method beside this project's, on the same flights and noise",
    cases=(
        *sevil_static.TABLE_CASES,
        *sevil_dynamic.TABLE_DYNAMIC,
        *sevil_dynamic.TABLE_MISMATCH,
        *sevil_faults.TABLE_FDI,
        *sevil_faults.TABLE_TWO,
        *sevil_faults.TABLE_INTEGRATED,
    ),
    run=run_case,
    default_runs=12,
    binary=("lost", "false_exclusion", "isolated", "readmitted"),
)
STUDIES = (TABLE,)
