"""Join-up in the whole system, its last stretch: by sight to station keeping, one controller handing over to the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ground import Run
from ground.columns import hold, load
from ground.views.refueling.aircraft import RECEIVER
from tests.sil.launch import sil, summary

SECONDS = 70.0  # [s] simulated
ENROUTE, JOIN_UP, OBSERVATION = 20, 21, 1


def test_the_last_stretch_is_flown_from_sight_to_station_keeping(tmp_path: Path) -> None:
    run = tmp_path / "run"
    start = 'plant.aircraft.receiver.start={relative_to="tanker",xi_m=[-190.0,90.0,15.0]}'
    ended = sil("run", "joinup", "--in-process", "--duration", SECONDS, "--set", start, "--no-rrd", "--out", run)
    assert ended.code == 0, ended.text
    s = summary(run)
    assert s["link.dropped"] == 0
    assert s["join.joinup_at_s"] < 6.0 < s["join.station_at_s"] < SECONDS - 10.0
    assert s["join.forward_max_m"] < -80.0 and s["join.wake_clearance_min_m"] > 30.0
    assert s["fuel.receiver.burned_to_station_kg"] > 0.0
    data, at = Run(run), "receiver/join"
    assert data[f"truth/{at}/wake_clearance"].values.min() == pytest.approx(s["join.wake_clearance_min_m"], rel=1e-6)
    assert data[f"truth/{at}/distance"].values[0] == pytest.approx(np.linalg.norm([190.0, 90.0, 15.0]), abs=1.0)
    pitch = data["truth/tanker/pitch"].values[0]
    below = 190.0 * np.sin(pitch) + 15.0 * np.cos(pitch)
    assert data[f"truth/{at}/height"].values[0] == pytest.approx(-below, abs=0.5)
    closure, distance = data[f"truth/{at}/closure"], data[f"truth/{at}/distance"]
    ends = np.interp(closure.t[[0, -1]], distance.t, distance.values)
    assert np.trapezoid(closure.values, closure.t) == pytest.approx(ends[0] - ends[1], abs=1.0)
    assert data[f"guid/{at}/closure"].values.max() > 1.0
    truth, tlm = load(run / "truth.tlog"), load(run / "tlm.tlog")
    true, status, rel = (
        truth.get(RECEIVER, "TRUTH"),
        tlm.get(RECEIVER, "MISSION_STATUS"),
        tlm.get(RECEIVER, "RELATIVE_STATE"),
    )
    assert true is not None and status is not None and rel is not None
    phases = status["phase"]
    assert list(dict.fromkeys(phases.tolist())) == [0, ENROUTE, JOIN_UP, OBSERVATION]
    # the hand-over is smooth: no bank worth the name, no jump of the path, and the station is held to a metre
    xi = true["xi"]
    on_station = hold(true.t_us, status.t_us, phases) == OBSERVATION
    assert np.linalg.norm(np.diff(xi[on_station], axis=0), axis=1).max() < 0.6
    q = true["q_nb"][on_station]
    bank = np.degrees(np.arctan2(2 * (q[:, 0] * q[:, 1] + q[:, 2] * q[:, 3]), 1 - 2 * (q[:, 1] ** 2 + q[:, 2] ** 2)))
    assert np.abs(bank).max() < 12.0
    wanted = hold(true.t_us, rel.t_us, rel["cmd_pos"][:, 0])
    late = on_station & (true.t_us > true.t_us[on_station][0] + 5_000_000)
    assert np.abs(xi[late, 0] - wanted[late]).max() < 1.5
