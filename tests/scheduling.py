"""How tests are dealt out to parallel workers: what shares a flight goes to one worker, what takes long goes first.

Marks of the distribution plugin group nothing under the test framework of the lock file (it gave names to tests another way),
so a file whose fixtures live for a module is one unit here, and every other test is one by itself.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parent.parent
SHARED = 'scope="module"'
FORKS = r"tests\.(forks|sil\.launch|component\.test_flight_process)"
FORKING = re.compile(rf"^from {FORKS} import .*\b(Flight|Forked|apart|start)\b", re.MULTILINE)
TOGETHER = "forks of one prepared process"  # unit of all files whose programs are: one of it is enough
# units of more than five seconds of processor time, longest first: none of them may come last. A head is enough
HEAVY: tuple[str, ...] = (
    "tests/component/test_relative_variants.py",
    "tests/unit/test_studies_hoffmann.py",
    "tests/sil/test_airdata.py",
    "tests/unit/test_wake_position.py",
    "tests/unit/test_estimate_log.py",
    "tests/sil/test_example_plugin.py",
    "tests/unit/test_report_sevil.py",
    "tests/unit/test_studies_lee.py",
    "tests/sil/test_processors.py",
    "tests/component/test_gust_faults.py",
    "tests/browser/test_pages.py",
    "tests/unit/test_campaign.py",
    "tests/unit/test_report_hoffmann.py",
    "tests/unit/test_report_jing.py",
    "tests/keys/test_reads.py",
    "tests/keys/test_aircraft.py::test_every_number_of_the_file_is_read_by_both_sides[alexis-onboard]",
    "tests/unit/test_plant_faults.py",
    "tests/sil/test_forked.py::test_forked_and_started_afresh",
    "tests/unit/test_report_lee.py",
    "tests/component/test_onboard_app.py",
    "tests/sil/test_run_as_data.py",
    "tests/component/test_refusals.py",
    "tests/sil/test_rendezvous.py::test_tanker_rolls_out",
    "tests/unit/test_report_rivard.py",
    "tests/sil/test_fuzz.py::test_a_flight_under_fire",
    "tests/unit/test_kinematic.py::test_wind_error",
    "tests/sil/test_joinup.py::test_the_last_stretch",
    "tests/replay/test_replay.py",
    "tests/sil/test_truncated.py",
    "tests/validation/test_plant_vs_jsbsim.py",
)


@cache
def text(path: str) -> str:
    """Source of a test file, "" if there is none."""
    try:
        return (ROOT / path).read_text(encoding="utf-8")
    except OSError:
        return ""


def unit(nodeid: str) -> str:
    """Name of the unit a test belongs to: its file, or itself."""
    path = nodeid.partition("::")[0]
    if FORKING.search(text(path)):
        return TOGETHER
    return path if SHARED in text(path) else nodeid


def rank(name: str) -> int:
    """Place of a unit in HEAVY, the longest before it; behind all of them if it is none."""
    if name == TOGETHER:
        return -1
    return next((i for i, head in enumerate(HEAVY) if name.startswith(head)), len(HEAVY))


class Units(LoadScopeScheduling):
    """Work units by `unit`, in the order of collection."""

    def _split_scope(self, nodeid: str) -> str:
        return unit(nodeid)
