"""How tests are dealt out to parallel workers: a file goes to one worker, files that take long go first.

Tests of a file share flights, designs, and kernels that nothing else compiles: dealt out one by one, each worker would make all
of them anew. Marks of the distribution plugin group nothing under the test framework of the lock file (it gave names to tests
another way).
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parent.parent
FORKS = r"tests\.(forks|sil\.launch|component\.test_flight_process)"
FORKING = re.compile(rf"^from {FORKS} import .*\b(Flight|Forked|apart|start)\b", re.MULTILINE)
TOGETHER = "forks of one prepared process"  # units of files whose programs are: two of it are enough
REAL_TIME = ("tests/hil/", "tests/clients/")  # the unit of those that wait for the wall clock
# units of more than three seconds of processor time, longest first: none of them may come last
HEAVY: tuple[str, ...] = (
    "tests/browser/test_pages.py",
    "tests/sil/test_airdata.py",
    "tests/component/test_relative_variants.py",
    "tests/unit/test_studies_hoffmann.py",
    "tests/unit/test_wake_position.py",
    "tests/unit/test_rivard_mc.py",
    "tests/unit/test_windshear_errors.py",
    "tests/keys/test_rigs.py",
    "tests/unit/test_filters_adaptive.py",
    "tests/component/test_gust_found.py",
    "tests/unit/test_rivard_geometry.py",
    "tests/unit/test_report_sevil.py",
    "tests/sil/test_processors.py",
    "tests/unit/test_estimate_log.py",
    "tests/unit/test_studies_sevil.py",
    "tests/unit/test_report_hoffmann.py",
    "tests/keys/test_aircraft.py",
    "tests/component/test_windshear_mission.py",
    "tests/unit/test_report_jing.py",
    "tests/unit/test_studies_lee.py",
    "tests/unit/test_windshear_units.py",
    "tests/unit/test_joinup.py",
    "tests/unit/test_answer_flight.py",
    "tests/unit/test_integrity_bank.py",
    "tests/component/test_gust_faults.py",
    "tests/component/test_onboard_app.py",
    "tests/component/test_windshear_estimators.py",
    "tests/unit/test_integrity_wake.py",
    "tests/icd/test_port.py",
    "tests/unit/test_studies_sevil_flight.py",
    "tests/unit/test_probe_offsets.py",
    "tests/sil/test_example_plugin.py",
    "tests/sil/test_scenarios.py",
    "tests/unit/test_report_six_dof.py",
    "tests/sil/test_run_as_data.py",
    "tests/unit/test_wake_ml.py",
    "tests/sil/test_forked.py",
    "tests/hil/test_restart.py",
    "tests/unit/test_lee_recovery.py",
    "tests/unit/test_kinematic.py",
    "tests/sil/test_warmup.py",
    "tests/unit/test_fdi_detectors.py",
    "tests/keys/test_acts.py",
    "tests/unit/test_campaign.py",
    "tests/validation/test_srukf.py",
    "tests/unit/test_sevil_six_dof.py",
    "tests/unit/test_plant_faults.py",
    "tests/sil/test_fuzz.py",
    "tests/component/test_led_astray.py",
    "tests/keys/test_reads.py",
    "tests/unit/test_windshear_nav.py",
    "tests/unit/test_report_rivard.py",
    "tests/component/test_refusals.py",
    "tests/unit/test_identify_flight.py",
    "tests/sil/test_lost_link.py",
    "tests/sil/test_rendezvous.py",
)
LATER = 12  # place in HEAVY of the forks in real time: when those that fly flat out, which wait much too, are through


@cache
def text(path: str) -> str:
    """Source of a test file, "" if there is none."""
    try:
        return (ROOT / path).read_text(encoding="utf-8")
    except OSError:
        return ""


def unit(nodeid: str) -> str:
    """Name of the unit a test belongs to: its file, or what it shares with others."""
    path = nodeid.partition("::")[0]
    if FORKING.search(text(path)):
        return f"{TOGETHER}, {'in real time' if path.startswith(REAL_TIME) else 'flat out'}"
    return path


def rank(name: str) -> int:
    """Place of a unit in HEAVY, the longest before it; behind all of them if it is none. The two that wait most of their time
    do so one after the other: at once, they would leave a core of two with nothing to do."""
    if name.startswith(TOGETHER):
        return -1 if name.endswith("flat out") else LATER
    return HEAVY.index(name) if name in HEAVY else len(HEAVY)


class Units(LoadScopeScheduling):
    """Work units by `unit`, in the order of collection."""

    def _split_scope(self, nodeid: str) -> str:
        return unit(nodeid)
