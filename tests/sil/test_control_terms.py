"""What the laws of every mission say of their commands, against what the aircraft says it commands and flies by."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ground import run as runs
from ground.columns import match
from ground.rrd import convert, terms
from ground.run import Run
from tests.drawn import rows
from tests.sil.conftest import Flown

FLOWN = {
    "refueling": {"tanker": ["autopilot", "recovery"], "receiver": ["station_keeping", "recovery"]},
    "rendezvous_to_contact": {
        "tanker": ["pilot", "autopilot", "recovery"],
        "receiver": ["join_up", "autopilot", "station_keeping", "recovery"],
    },
    "gust": {"alexis": ["hold", "alleviation", "elevator"], "reference": ["hold", "alleviation", "elevator"]},
    "windshear": {"twinjet": ["inversion"]},
}  # fmt: skip
PARTS = ("proportional", "integral", "feedforward", "cut")


def run_of(flown: Flown, scenario: str) -> Run:
    return runs.load(flown(scenario)[0])


def sent(law: terms.Law, q: terms.Quantity) -> np.ndarray:
    p, i, f, cut = (law.table[k][:, q.at].astype(np.float64) for k in PARTS)
    return p + i + f - cut


@pytest.mark.parametrize("scenario", FLOWN)
def test_every_law_reports_and_its_parts_make_up_what_is_commanded(flown: Flown, scenario: str) -> None:
    run = run_of(flown, scenario)
    found = terms.laws_of(run)
    said: dict[str, list[str]] = {}
    for law in found:
        said.setdefault(law.aircraft, []).append(law.name)
        limited, cut = law.table["output_limit"] != 0, law.table["cut"] != 0.0
        assert (limited == cut).all(), law.path  # nothing is kept back but by a limit
    assert said == FLOWN[scenario]
    checked = 0
    for sysid, name in run.names.items():
        status = run.tlm.get(sysid, "MISSION_STATUS")
        assert status is not None
        for law in (law for law in found if law.aircraft == name):
            closed = law.table["closed"] != 0
            ia, ib = match(law.table.t_us[closed], status.t_us)
            for q in law.outputs:
                if q.name in ("aileron", "elevator", "rudder"):
                    assert sent(law, q)[closed][ia] == pytest.approx(status[q.name][ib], abs=2e-7, rel=1e-5)
                    checked += len(ia)
    assert checked > 20


def test_errors_are_those_of_the_estimate_to_the_reference(flown: Flown) -> None:
    run = run_of(flown, "refueling")
    by = {law.name: law for law in terms.laws_of(run)}
    autopilot, keeping = by["autopilot"].table, by["station_keeping"].table
    nav, status, rel = (run.tlm.get(*k) for k in ((1, "NAV_STATE"), (1, "MISSION_STATUS"), (2, "RELATIVE_STATE")))
    assert nav is not None and status is not None and rel is not None
    rows = autopilot["closed"] != 0
    ia, ib = match(autopilot.t_us[rows], nav.t_us)
    assert autopilot["error"][rows][ia, 0] == pytest.approx(nav["V"][ib] - status["cmd_V"][ib], abs=1e-4)
    rows = keeping["closed"] != 0
    ia, ib = match(keeping.t_us[rows], rel.t_us)
    assert len(ia) > 10
    assert keeping["error"][rows][ia, :3] == pytest.approx(rel["pos"][ib] - rel["cmd_pos"][ib], abs=1e-4)
    e, grown = keeping["error"][rows][:, :3], np.diff(keeping["error_integral"][rows][:, :3], axis=0)
    free = (keeping["controlled_limit"][rows][1:, :3] == 0) & (grown != 0.0)  # not held in either step between
    mean = 0.1 * 0.5 * (e[1:] + e[:-1])[free]
    assert free.sum() > 30 and mean @ grown[free] == pytest.approx(mean @ mean, rel=0.1)


def test_they_are_in_the_recording(flown: Flown, tmp_path: Path) -> None:
    run = run_of(flown, "windshear")
    path = convert(run.folder, tmp_path / "run.rrd", tab="controller")
    assert {"/ctrl/twinjet/inversion/elevator/proportional", "/ctrl/twinjet/inversion/error/airspeed"} <= set(
        rows(path)
    )
