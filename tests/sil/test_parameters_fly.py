"""A parameter changed in flight changes the law from its tick on, and nothing before; the flight replays to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flightsw.icd.wire import Sender
from ground.columns import load
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.replay_cmd import replay_run
from hil_scripts.launch.runfolder import make_folder, resolve

AT, TICKS = 150, 250


def fly(folder: Path, change: bool) -> Path:
    """Five seconds of the gust scenario; `change`: at tick AT the reference's pitch hold is made stiffer."""
    plan = resolve("gust", 3, [], TICKS / 50.0)
    run = make_folder(plan, folder)
    flight = InProcess(plan, run)
    k = next(i for i, n in enumerate(flight.nodes) if n.cfg.app.name == "reference")
    packet = Sender(255, 190).named(
        "PARAM_SET",
        target_system=flight.nodes[k].cfg.app.sysid,
        param_id="CTRL_HOLD_THETA",
        param_value=1.2,
        param_type=9,
    )
    for tick in range(TICKS):
        if change and tick == AT:
            flight.nodes[k].step((), None, [packet])  # it waits for the tick's datagram, as in a process of its own
        flight.tick()
    flight.finish()
    return run


def test_a_stiffer_hold_acts_from_its_tick_on_and_replays(tmp_path: Path) -> None:
    runs = [fly(tmp_path / name, change) for name, change in (("as_is", False), ("changed", True))]
    elevator, at_us = [], AT * 20_000
    for run in runs:
        rows = load(run / "tlm.tlog").get(4, "MISSION_STATUS")
        assert rows is not None
        elevator.append((rows.t_us, rows["elevator"]))
    (t, a), (t2, b) = elevator
    assert np.array_equal(t, t2)
    assert np.array_equal(a[t < at_us], b[t < at_us]) and not np.array_equal(a[t >= at_us], b[t >= at_us])
    assert (
        "guid" not in (runs[1] / "params_reference.toml").read_text()
        and not (runs[0] / "params_reference.toml").exists()
    )
    reports = replay_run(runs[1])
    assert all(r.ok and r.ticks == TICKS for r in reports.values()), [r.lines() for r in reports.values()]
