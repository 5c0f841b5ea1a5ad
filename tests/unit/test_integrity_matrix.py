"""The matrix fits the plant, and a copy of the flying system goes on as the flight it was taken from."""

from __future__ import annotations

from pathlib import Path

import pytest

from ground.report.integrity.build import OUTCOMES, integrity_report
from hil_scripts.campaign import folder as folders
from hil_scripts.campaign import table as results
from hil_scripts.campaign.task import Row
from hil_scripts.studies.integrity import flight, snapshot, table
from hil_scripts.studies.integrity.judge import Outcome
from hil_scripts.studies.integrity.study import STUDY

SECOND = 100  # [tick]


@pytest.fixture(scope="module")
def flown() -> snapshot.Flying:
    f = snapshot.Flying("refueling", 3)
    f.fly_to(2.0)
    return f


def _wire(f: snapshot.Flying, n: int) -> list[str]:
    return [repr(f.tick()) for _ in range(n)]  # in replies that are packets NaN is NaN


def test_a_copy_goes_on_byte_for_byte(flown: snapshot.Flying) -> None:
    """Replies and telemetry of a copy, of a copy of it, and of the flight that was never copied; flying one moves no other."""
    never, copied = snapshot.Flying("refueling", 3), flown.fork()
    assert never.fly_to(2.0) == "observation"
    first = _wire(copied, SECOND)
    again = copied.fork()
    assert _wire(never, SECOND) == first
    assert _wire(never, SECOND) == _wire(again, SECOND) == _wire(copied, SECOND)


def test_every_fault_of_the_matrix_begins_in_the_plant(flown: snapshot.Flying) -> None:
    """300 cases and more, each accepted where it is flown, and under way in it a tick later."""
    assert len(STUDY.cases) >= 300
    f = flown.fork()
    events = {table.event_of(e) for c in STUDY.cases for e in c.params["events"]}
    for event in events:
        f.inject(event)
    f.server.world.sense()
    active = {a.event for a in f.server.world.faults._active}
    once = {e for e in events if e.kind == "spike"}
    assert {e.sensor for e in once} and not once & active
    # of one kind and place the last one stays: compare places
    assert {(e.target, e.sensor, e.surface, e.kind) for e in events - once} == {
        (e.target, e.sensor, e.surface, e.kind) for e in active
    }


def test_a_fault_is_seen_by_truth_and_wire(flown: snapshot.Flying) -> None:
    """Noise of the gyros: the flight differs from the one without; both are judged on the same looks at the truth."""
    m = table.MOMENTS["straight"]
    clean, noisy = flown.fork(), flown.fork()
    noisy.inject(table.event_of({"kind": "garbage", "target": "receiver", "sensor": "imu", "value": [0.5] * 6}))
    a, b = (flight.follow(x, m, 2.0)[0] for x in (clean, noisy))
    assert len(a.t) == len(b.t) == 2 * flight.LOOK_HZ
    assert a.gap[0] == b.gap[0] and abs(a.off[-1] - b.off[-1]) > 1e-6


def test_the_page_knows_every_outcome() -> None:
    assert list(OUTCOMES) == [o.name.lower() for o in Outcome]


def test_the_page_has_one_square_a_case_and_counts_runs(tmp_path: Path) -> None:
    chosen = [
        c for c in STUDY.cases if c.params["group"] == "receiver rel" and c.params["moment"] in ("straight", "turn")
    ]
    rows: list[Row] = []
    for case in chosen:
        for run, outcome in enumerate((Outcome.KEPT, Outcome.SILENT)):
            values = {"outcome": float(outcome), "off_max_m": 1.0, "gap_min_m": 9.0}
            if case is chosen[0]:  # the bound held in one run and not in the other; elsewhere there is none
                values["honest"] = 1.0 - run
            rows.append(Row(case.name, run, run, "ok", "", values))
    folder = tmp_path / "c"
    folder.mkdir()
    results.write_parquet(folder / results.PARQUET, rows, 1)
    results.write_summary(folder / results.SUMMARY, rows, STUDY.binary)
    folders.write_meta(folder, folders.new_meta(None, STUDY, 1, 2, chosen))
    text = integrity_report([folder], tmp_path / "out").read_text()
    assert text.count('class="sq" title=') == len(chosen) - 1 and text.count('class="sq lies" title=') == 1
    assert text.count("kept (off 1.0 m, gap 9.0 m)") == len(chosen)
    n = len(chosen)
    low, high = results.share_interval([1.0] * n + [0.0] * n) or (0.0, 0.0)
    assert f"50.0 ({100 * low:.1f} … {100 * high:.1f})" in text
    low, high = results.share_interval([1.0, 0.0]) or (0.0, 0.0)
    assert f"50.0 ({100 * low:.1f} … {100 * high:.1f})" in text
