"""Against the wall clock: the run completes, keeps its rates in sample time, accounts for its slips, and replays.

How late the loop wakes up is a property of the machine of the day: `sil bench` prints it, nothing here judges it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import read
from hil_scripts.bench.realtime import loop_timing
from tests.sil.launch import Ended, sil, summary

pytestmark = pytest.mark.rt
SECONDS = 10.0


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory, next_port_offset: Callable[[], int]) -> tuple[Path, Ended]:
    """One paced run."""
    run = tmp_path_factory.mktemp("rt") / "run"
    args = ("--realtime", "--duration", SECONDS, "--no-rrd", "--out", run, "--port-offset", next_port_offset())
    return run, sil("run", "refueling", *args)


def test_it_completes(flown: tuple[Path, Ended]) -> None:
    run, ended = flown
    assert ended.code == 0, ended.text
    assert summary(run)["run.outcome"] == "completed"


def test_message_rates(flown: tuple[Path, Ended]) -> None:
    """NAV_STATE 10 Hz, LOOP_TIMING and HEARTBEAT 1 Hz per aircraft, counted over the run."""
    counts: Counter[tuple[int, int]] = Counter()
    for _, _, packet in read(flown[0] / "tlm.tlog"):
        counts[packet[5], wire.message_id(packet)] += 1
    for sysid in (1, 2):
        for name, rate in (("NAV_STATE", 10), ("LOOP_TIMING", 1), ("HEARTBEAT", 1)):
            got = counts[sysid, wire.BY_NAME[name].id]
            assert got == pytest.approx(rate * SECONDS, rel=0.25, abs=2), (sysid, name, got)


def test_slips_are_accounted_for(flown: tuple[Path, Ended]) -> None:
    """Ticks run and periods skipped together make the time flown."""
    timing: list[dict[str, Any]] = loop_timing(flown[0] / "tlm.tlog")
    assert [t["sysid"] for t in timing] == [1, 2]
    for t in timing:
        assert t["late_p50"] <= t["late_p99"] <= t["late_p999"] <= t["late_max"]
        assert t["exec_mean"] <= t["exec_max"]
        assert t["ticks"] + t["slips"] == pytest.approx(100 * SECONDS, rel=0.2)


def test_a_paced_run_replays_to_the_bit(flown: tuple[Path, Ended]) -> None:
    ended = sil("replay", flown[0])
    assert ended.code == 0, ended.text
