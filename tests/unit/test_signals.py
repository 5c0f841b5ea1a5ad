"""Signals of a run brought to each other's times, and what is drawn of them, against closed forms and scipy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from ground import Run
from ground.rrd import convert
from tests.drawn import are_signals

RATE = 0.9  # [rad/s] of the turn, through north
TRUTH_US, NAV_US, LATE_US = 50_000, 100_000, 12_000
SECONDS, GAP_S = 12, (5.0, 6.0)  # without truth


def quaternion(t_s: np.ndarray) -> np.ndarray:
    """Body to NED (n,4), scalar first, of a banked turn."""
    euler = np.column_stack([RATE * t_s, 0.1 * np.sin(t_s), np.full_like(t_s, 0.4)])
    return np.asarray(Rotation.from_euler("ZYX", euler).as_quat(scalar_first=True))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """One aircraft; telemetry off the truth's grid, and a second in which there is no truth."""
    folder = tmp_path_factory.mktemp("turn")
    truth, tlm, plant, craft = (
        TlogWriter(folder / "truth.tlog"),
        TlogWriter(folder / "tlm.tlog"),
        Sender(1, 190),
        Sender(1, 1),
    )
    t_us = np.arange(0, SECONDS * 1_000_000, TRUTH_US)
    for t, q in zip(t_us.tolist(), quaternion(t_us / 1e6), strict=True):
        if not GAP_S[0] < t / 1e6 < GAP_S[1]:
            wind = (2.0 + 0.5 * t / 1e6, -1.0, 0.0)
            truth.write(t, plant.named("TRUTH", time_usec=t, q_nb=q, wind_n=wind, V=60.0, alpha=0.04))
    for t in range(LATE_US, SECONDS * 1_000_000, NAV_US):
        psi = RATE * t / 1e6
        tlm.write(
            t, craft.named("NAV_STATE", time_usec=t, valid=1, psi=psi, V=60.0, wind=(2.0 + 0.5 * t / 1e6, -1.0, 0.0))
        )
        tlm.write(t, craft.named("MISSION_STATUS", time_usec=t, phase=0))
    truth.close()
    tlm.close()
    return Run(folder)


def test_truth_comes_to_the_times_of_the_estimate(run: Run) -> None:
    name = run.names[1]
    both = run.align(f"{name}/nav/wind")
    want = np.arange(LATE_US, SECONDS * 1_000_000, NAV_US) / 1e6
    inside = ~((want > GAP_S[0]) & (want < GAP_S[1]))
    assert np.array_equal(both.t, want[inside]) and both.left_out == {f"truth/{name}/wind": int((~inside).sum())}
    assert np.allclose(both[f"truth/{name}/wind"], both[f"{name}/nav/wind"], atol=1e-5)
    assert both.units[f"truth/{name}/wind"] == "m/s"
    wide = run.align(f"{name}/nav/wind", f"{name}/truth/wind", gap_s=1.5)
    assert len(wide) == len(want) and wide.left_out == {f"{name}/truth/wind": 0}


def test_angles_go_the_short_way_and_attitudes_turn(run: Run) -> None:
    name = run.names[1]
    both = run.align(f"{name}/nav/V", f"{name}/truth/heading", f"{name}/truth/attitude")
    heading = (RATE * both.t + np.pi) % (2.0 * np.pi) - np.pi
    off = (both[f"{name}/truth/heading"] - heading + np.pi) % (2.0 * np.pi) - np.pi
    assert np.ptp(heading) > 6.0 and np.abs(off).max() < 2e-4
    s = run[f"{name}/truth/attitude"]
    turned = Slerp(s.t, Rotation.from_quat(s.values, scalar_first=True))(both.t)
    got = Rotation.from_quat(both[f"{name}/truth/attitude"], scalar_first=True)
    assert (turned.inv() * got).magnitude().max() < 2e-5
    assert run.align(f"{name}/truth/V", f"{name}/guid/phase")[f"{name}/guid/phase"][3] == "INIT"


def test_truth_of_truth_is_refused(run: Run) -> None:
    with pytest.raises(KeyError, match="is truth itself"):
        run.align(f"{run.names[1]}/truth/wind")
    with pytest.raises(KeyError, match="at least one signal"):
        run.frame()


def test_the_pictures_draw_these_signals(run: Run, tmp_path: Path) -> None:
    """Every line of the common part is a signal of that path, thinned, in the unit of the plot."""
    met = are_signals(run, convert(run.folder, tmp_path / "a.rrd"), {})
    assert {f"{k}/{run.names[1]}/{q}" for k, q in (("truth", "heading"), ("nav", "wind/n"), ("truth", "V"))} <= met
