"""Rendezvous figures and geometry of the ground side, on made-up runs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from ground import Run
from ground.columns import load
from ground.link.packets import DTYPES, IDS
from ground.views.rendezvous.draw import turn_path
from ground.views.rendezvous.read import covariances, nees3, rendezvous_metrics, to_plan, to_r
from tests.drawn import are_signals

FRAME = np.array([100.0, -50.0, math.radians(120.0)])


def test_plan_and_rendezvous_axes_are_each_others_inverse() -> None:
    x, y = np.array([0.0, 3.0, -7.0]), np.array([0.0, 4.0, 2.0])
    p = to_plan(FRAME, x, y)
    back = to_r(FRAME, -p[:, 1] - FRAME[0], p[:, 0] - FRAME[1])
    assert np.allclose(back, np.stack([x, y], axis=1))
    # +x along 120 deg: south-east, so right and down in a view whose y points down
    ahead = to_plan(FRAME, np.array(10.0), np.array(0.0)) - to_plan(FRAME, np.array(0.0), np.array(0.0))
    assert ahead[0] == pytest.approx(10.0 * math.sin(math.radians(120.0))) and ahead[1] == pytest.approx(5.0)


def test_nees_of_errors_drawn_from_their_covariance_is_one() -> None:
    rng = np.random.default_rng(1)
    A = rng.normal(size=(4, 4))
    P = A @ A.T
    e = rng.multivariate_normal(np.zeros(4), P, size=20_000)
    P3 = np.broadcast_to(P, (len(e), 4, 4))
    assert nees3(e, P3).mean() == pytest.approx(1.0, abs=0.02)
    upper = P[np.triu_indices(4)].astype(np.float32)
    assert np.allclose(covariances(upper[None])[0], P, rtol=1e-6)
    assert np.isnan(nees3(e[:1], np.zeros((1, 4, 4)))).all()


def row(**fields: object) -> np.ndarray:
    r = np.zeros(1, dtype=DTYPES[IDS["RENDEZVOUS_STATE"]])
    for k, v in fields.items():
        r[k][0] = v
    return r[0]


def test_planned_turn_is_the_straight_piece_and_the_arcs() -> None:
    r = 8000.0
    one = row(own=(1e3, -2e3, 0.0), cmd_speed=200.0, time_to_go=10.0, turn_time=math.pi * r / 200.0, final_psi=math.pi)
    p = turn_path(one)
    assert p[1] == pytest.approx((3e3, -2e3), abs=1.0)
    assert p[-1] == pytest.approx((3e3, -2e3 + 2 * r), abs=1.0)
    two = row(own=(0.0, 0.0, 0.0), cmd_speed=200.0, phase=1, radius=(6e3, 9e3), final_psi=math.pi)
    p = turn_path(two)
    # quarter turn of each radius
    assert p[-1] == pytest.approx((6e3 - 9e3, 6e3 + 9e3), abs=1.0)
    assert len(turn_path(row(own=(0.0, 0.0, 3.2), final_psi=math.pi))) == 1


def written(tmp_path: Path, roll: bool = True) -> Path:
    """A tanker that is level at 30 s, 100 m too far ahead and 50 m to the right of the receiver's track."""
    truth, tlm = TlogWriter(tmp_path / "truth.tlog"), TlogWriter(tmp_path / "tlm.tlog")
    tk, rv, fl = Sender(1, 200), Sender(2, 200), Sender(1, 1)
    for k in range(801):
        t = k * 50_000
        x_t = 20_000.0 - 200.0 * k * 0.05
        bank = 0.0 if t >= 30_000_000 else -0.4
        q = (math.cos(bank / 2), math.sin(bank / 2), 0.0, 0.0)
        for send, x, y, qq in ((tk, x_t, 0.0, q), (rv, x_t + 3704.0 + 100.0, 50.0, (1.0, 0.0, 0.0, 0.0))):
            # +x north: y to the left is west
            fields = {"time_usec": t, "pos_n": (x, -y, -7000.0), "vel_n": (-200.0, 0.0, 0.0), "q_nb": qq}
            truth.write(t, send.named("TRUTH", **fields))
        if k % 10 == 0:
            cov = np.diag([100.0**2, 4.0, 50.0**2, 1.0])[np.triu_indices(4)]
            est = (x_t + 3804.0 + 100.0, -200.0, 50.0, 0.0)
            phase = 1 if t < 28_000_000 else 2 if t < 31_000_000 else 3
            state = {
                "time_usec": t,
                "est": est,
                "cov": tuple(cov),
                "phase": phase,
                "valid": 1,
                "updates": 4,
                "alarm": int(k == 400),
            }
            tlm.write(t, fl.named("RENDEZVOUS_STATE", **state))
            mission = 14 if phase == 1 or not roll else 15 if phase == 2 else 10
            tlm.write(t, fl.named("MISSION_STATUS", time_usec=t, phase=mission))
    truth.close()
    tlm.close()
    return tmp_path


def test_misses_are_taken_where_the_wings_are_level(tmp_path: Path) -> None:
    run = written(tmp_path)
    m = rendezvous_metrics(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    assert m["rendezvous.done"] == 1 and m["rendezvous.rollout_s"] == pytest.approx(30.0)
    assert m["rendezvous.x_m"] == pytest.approx(100.0, abs=1e-6) and m["rendezvous.y_m"] == pytest.approx(
        50.0, abs=1e-6
    )
    assert m["rendezvous.closing_mps"] == pytest.approx(0.0, abs=1e-9)
    assert m["rendezvous.error_m.x"] == pytest.approx(100.0, abs=0.01) and m["rendezvous.error_m.y"] == pytest.approx(
        0.0, abs=0.01
    )
    assert m["rendezvous.nees3_mean"] == pytest.approx(1.0 / 3.0, rel=1e-3)
    assert m["rendezvous.alarms"] == 1 and m["rendezvous.alarm_s"] == pytest.approx(20.0)
    assert m["rendezvous.bank_max_deg"] == pytest.approx(math.degrees(0.4), rel=1e-6)


def test_own_separation_is_read_from_the_run(tmp_path: Path) -> None:
    run = written(tmp_path)
    (run / "flight_tanker.toml").write_text("[rendezvous.pilot.guidance]\nseparation_m = 3000.0\n")
    m = rendezvous_metrics(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    assert m["rendezvous.x_m"] == pytest.approx(804.0, abs=1e-6)


def test_a_turn_never_finished_has_no_miss(tmp_path: Path) -> None:
    run = written(tmp_path, roll=False)
    m = rendezvous_metrics(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    assert m["rendezvous.done"] == 0 and m["rendezvous.x_m"] is None and m["rendezvous.nees3_mean"] is not None


def test_run_becomes_a_recording_with_its_tab(tmp_path: Path) -> None:
    from ground.rrd import convert

    run = written(tmp_path)
    cloud = Sender(1, 1)
    log = TlogWriter(tmp_path / "cloud.tlog")
    for part, count in ((0, 16), (1, 3)):
        row16 = tuple(float(i) for i in range(16))
        fields = {"time_usec": 2_000_000, "x": row16, "y": row16, "weight": (1 / 19,) * 16, "part": part, "parts": 2}
        log.write(2_000_000, cloud.named("RENDEZVOUS_CLOUD", **fields, count=count))
    log.close()
    with (run / "tlm.tlog").open("ab") as f:
        f.write((tmp_path / "cloud.tlog").read_bytes())
    out = convert(run, tmp_path / "plain.rrd")
    data = out.read_bytes()
    assert b"nav/tanker/rendezvous/map/cloud" in data and b"nav/tanker/rendezvous/map/turn" in data
    assert convert(run, tmp_path / "tab.rrd", tab="rendezvous").stat().st_size > 10_000
    data, at = Run(run), "tanker/rendezvous"
    met = are_signals(data, out, {f"nav/{at}/range": 1e-3, f"guid/{at}/time_to_go": 1.0})
    assert {f"nav/{at}/nees", f"nav/{at}/bank", f"guid/{at}/miss/x", f"nav/{at}/window_nis"} <= met
    both = data.align(f"nav/{at}/position")  # 100 m too far out, on the line
    assert np.allclose(both[f"nav/{at}/position"] - both[f"truth/{at}/position"], [100.0, 0.0], atol=0.01)
    assert np.allclose(data[f"nav/{at}/position_sigma"].values, [100.0, 50.0])
    assert np.allclose(data[f"nav/{at}/velocity_sigma"].values, [2.0, 1.0])
    assert list(data[f"nav/{at}/alarm"].values).count("NOT AS PLANNED") == 1
