"""Air data on the ground: frames against scipy, metrics with known answers, words, pictures only where a run has it."""

from __future__ import annotations

import math
import runpy
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from flightsw.aircraft import load_aircraft
from flightsw.icd.tlog import TlogWriter, read
from flightsw.icd.wire import Sender
from ground import Run
from ground.columns import load
from ground.link.packets import IDS, packet_id
from ground.link.packets import PHASES as PHASE_NAMES
from ground.metrics import compute
from ground.rrd import convert
from ground.rrd.blueprint import NoTabError
from ground.rrd.shot import viewer
from ground.views.airdata.figures import LEGS, PHASES, legs, position_stats
from ground.views.airdata.read import (
    ellipses,
    to_air_path,
    true_position,
    vortices,
)
from tests.drawn import are_signals, rows

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
Air = runpy.run_path(str(Path(__file__).with_name("airdata_synth.py")))
ERROR = (0.3, -0.4)
FAULTS = ((30.0, 35.0, 4, 9.0), (40.0, 42.0, 6, -9.0), (41.0, 44.0, 0, 9.0))  # beta left, alpha nose low, V nose
SCENARIO = """
[[aircraft]]
name = "tanker"
file = "kc135r"
[wind.wake]
source = "tanker"
core_wing_m = 1.2
core_tail_m = 0.6
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """60 s with a constant position error, three faults, and 3 s without position."""
    folder: Path = Synth(duration_s=60.0).write(tmp_path_factory.mktemp("air") / "refueling-1")
    (folder / "scenario.toml").write_text(SCENARIO)
    made: Path = Air["add_airdata"](folder, error=ERROR, faults=FAULTS, invalid=(22.0, 25.0))
    return made


@pytest.fixture(scope="module")
def found(run: Path) -> dict[str, Any]:
    """Its metrics."""
    return compute(run)


# --- frames -----------------------------------------------------------------------------------------------------------
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.lists(st.floats(-100, 100), min_size=3, max_size=3))
def test_air_path_axes_are_scipys_and_lay_x_along_the_air_velocity(alpha: float, beta: float, v: list[float]) -> None:
    x = np.array([v])
    ours = to_air_path(x, np.array([alpha]), np.array([beta]))
    assert ours == pytest.approx(Rotation.from_euler("YZ", [-alpha, beta]).inv().apply(x), abs=1e-9)
    assert np.linalg.norm(ours) == pytest.approx(np.linalg.norm(x), abs=1e-9)
    air = [math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)]
    assert to_air_path(np.array([air]), np.array([alpha]), np.array([beta]))[0] == pytest.approx([1, 0, 0], abs=1e-12)


def test_incidence_lowers_what_is_behind() -> None:
    at = to_air_path(np.array([[-35.5, 1.0, 8.5]]), np.array([math.radians(3.0)]), np.array([0.0]))[0]
    assert at[1] == 1.0
    assert at[2] == pytest.approx(8.5 * math.cos(math.radians(3.0)) + 35.5 * math.sin(math.radians(3.0)))


def test_true_position_between_samples_and_beyond_the_log(run: Path) -> None:
    true = true_position(load(run / "truth.tlog"))
    t, place = Air["true_air_path"](run / "truth.tlog")
    assert true.pos == pytest.approx(place, abs=1e-5)
    inside, at = true.at(np.array([t[3], (t[3] + t[4]) // 2, t[-1] + 1]))
    assert inside.tolist() == [True, True, False]
    assert at[1] == pytest.approx(0.5 * (place[3] + place[4]), abs=1e-5)


@given(st.floats(0.01, 5.0), st.floats(0.01, 5.0), st.floats(-0.99, 0.99))
def test_every_point_of_an_ellipse_is_two_sigma_away(sy: float, sz: float, r: float) -> None:
    cov = np.array([[sy * sy, r * sy * sz], [r * sy * sz, sz * sz]])
    [ring] = ellipses(np.array([[1.0, -2.0]]), np.array([[cov[0, 0], cov[0, 1], cov[1, 1]]]))
    d = ring - np.array([1.0, -2.0])
    assert np.einsum("ni,ij,nj->n", d, np.linalg.inv(cov), d) == pytest.approx(4.0, rel=1e-6)
    assert ring[0] == pytest.approx(ring[-1])


def test_ellipse_of_no_covariance_is_a_dot() -> None:
    assert np.ptp(ellipses(np.array([[3.0, 4.0]]), np.zeros((1, 3))), axis=1) == pytest.approx(0.0)


def test_vortices_lie_pi_quarters_of_the_span_apart(run: Path, tmp_path: Path) -> None:
    v = vortices(run, 0.0)
    assert v is not None
    ac = load_aircraft("kc135r")
    assert v.centre[1, 0] - v.centre[0, 0] == pytest.approx(math.pi / 4 * ac.geometry.b_m)
    assert v.centre[:, 1].tolist() == [ac.wake.wing_ac_m[2]] * 2 + [ac.wake.tail_ac_m[2]] * 2
    assert v.core.tolist() == [1.2, 1.2, 0.6, 0.6]
    assert np.ptp(v.wing[:, 0]) == pytest.approx(39.88)
    tilted = vortices(run, 0.06)
    assert tilted is not None and tilted.centre[3, 1] > v.centre[3, 1]  # the tail sits lower in the air path
    assert vortices(tmp_path, 0.0) is None
    (tmp_path / "scenario.toml").write_text("[wind.wake]\nsource = 'nobody'\n")
    assert vortices(tmp_path, 0.0) is None


# --- metrics ----------------------------------------------------------------------------------------------------------
def test_constant_error_is_its_own_rms_and_percentile(found: dict[str, Any]) -> None:
    for part in ("", "contact.", "closing.", "to_precontact.", "to_precontact.lateral.", "observation."):
        for kind in ("rms_m", "p95_m"):
            for axis, want in (("y", 0.3), ("z", 0.4), ("radial", 0.5)):
                assert found[f"airdata.position.{part}{kind}.{axis}"] == pytest.approx(want, abs=1e-4)
        assert found[f"airdata.position.{part}mean_m.z"] == pytest.approx(-0.4, abs=1e-4)


def test_available_share_by_phase(found: dict[str, Any]) -> None:
    n = found["airdata.position.samples"]
    assert n == 601
    assert found["airdata.position.available_pct"] == pytest.approx(100.0 * (601 - 30) / 601)
    assert found["airdata.position.contact.samples"] == 300
    assert found["airdata.position.contact.available_pct"] == pytest.approx(90.0)
    assert found["airdata.position.breakaway.samples"] == 0
    assert found["airdata.position.breakaway.rms_m.radial"] is None
    assert found["airdata.position.restarts"] == 0
    assert found["airdata.position.to_precontact.down.samples"] == 0  # the path is straight, mostly sideways
    assert found["airdata.position.to_precontact.lateral.samples"] == found["airdata.position.to_precontact.samples"]


def test_phases_are_the_dialects() -> None:
    words = {"closing": "TO_CONTACT"}
    for name, number in PHASES.items():
        assert PHASE_NAMES[number] == words.get(name, name.upper())
    assert LEGS == ("down", "lateral", "forward")


def test_legs_by_dominant_axis_and_pauses_continue() -> None:
    still = [0.0, 0.0, 0.0]
    down, across, up = [0.0, 0.1, 1.0], [-0.1, -1.5, 0.0], [0.5, 0.0, -0.7]
    assert legs(np.array([still, down, still, across, still, up, [0.5, 0.0, 0.0]])).tolist() == [-1, 0, 0, 1, 1, 2, 2]
    assert legs(np.empty((0, 3))).tolist() == []


def test_two_sigma_share_and_rms_of_gaussian_errors() -> None:
    rng = np.random.default_rng(3)
    cov = np.array([[0.04, 0.02], [0.02, 0.09]])
    e = rng.multivariate_normal([0.0, 0.0], cov, 40_000)
    rows = np.tile([0.04, 0.02, 0.09], (len(e), 1))
    s = position_stats(e, rows, np.ones(len(e), dtype=bool), np.full(len(e), 9.0))
    assert s["inside_2sigma_pct"] == pytest.approx(100.0 * chi2.cdf(4.0, 2), abs=0.6)
    assert s["rms_m.y"] == pytest.approx(0.2, rel=0.02)
    assert s["rms_m.radial"] == pytest.approx(math.sqrt(0.13), rel=0.02)
    assert s["nis_mean"] == 9.0


def test_alarms_exclusions_and_times_by_channel(found: dict[str, Any]) -> None:
    assert found["airdata.fdi.exclusions"] == 3
    assert found["airdata.fdi.valid_pct"] == 100.0
    kept = {k.removeprefix("airdata.fdi.excluded_s."): v for k, v in found.items() if ".excluded_s." in k}
    assert kept.pop("beta.left") == pytest.approx(5.9)  # from 0.1 s after the beginning to 1 s after the end
    assert kept.pop("alpha.nose") == pytest.approx(2.9)
    assert kept.pop("V.nose") == pytest.approx(3.9)
    assert set(kept.values()) == {0.0}
    assert len(kept) == 6
    assert found["airdata.fdi.alarm_s.beta"] == pytest.approx(5.0, abs=0.5)
    assert found["airdata.fdi.alarms"] == sum(found[f"airdata.fdi.alarms.{v}"] for v in ("V", "beta", "alpha"))
    assert found["airdata.fdi.alarms.alpha"] >= 1


def test_a_run_without_the_messages_has_none_of_the_keys(tmp_path: Path) -> None:
    assert not [k for k in compute(Synth(duration_s=10.0).write(tmp_path)) if k.startswith("airdata")]


# --- pictures ---------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def rrd(run: Path) -> Iterator[Path]:
    """run.rrd."""
    yield convert(run)


def entities(path: Path) -> set[str]:
    """Paths with data."""
    return set(rows(path))


def test_recording_has_the_promised_entities(rrd: Path) -> None:
    have = entities(rrd)
    for path in (
        "fdi/portrait/V/vector", "fdi/portrait/beta/frame", "fdi/ratio/alpha", "fdi/alarm/beta", "fdi/excluded",
        "wake/map/position", "wake/map/ellipse", "wake/scale/tail", "wake/nis", "wake/state", "wake/error/y",
    ):  # fmt: skip
        assert f"/nav/receiver/{path}" in have
    for path in ("truth/receiver/wake_map/position", "truth/tanker/wake_map/cores", "guid/receiver/wake_map/commanded"):
        assert f"/{path}" in have
    done = subprocess.run([str(viewer()), "rrd", "verify", str(rrd)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_is_drawn_is_there_as_signals(run: Path, rrd: Path) -> None:
    data, nav = Run(run), "nav/receiver"
    met = are_signals(data, rrd, {})
    assert {f"{nav}/wake/scale/wing", f"{nav}/wake/nis", f"{nav}/wake/wind/x", f"{nav}/fdi/ratio/V"} <= met
    both = data.align(f"{nav}/wake/position")
    error = both[f"{nav}/wake/position"] - both["truth/receiver/wake/position"]
    assert np.allclose(error, [0.0, *ERROR], atol=1e-4)
    sigma = data[f"{nav}/wake/position_sigma"]
    assert sigma.parts == ("y", "z") and np.allclose(sigma.values, np.sqrt([Air["COV"][0], Air["COV"][2]]))
    assert set(data[f"{nav}/wake/state"].values) == {"valid", "not observable"}
    assert {"none"} < set(data[f"{nav}/fdi/alarms"].values) and {"none"} < set(data[f"{nav}/fdi/excluded"].values)


def test_tab_only_where_the_run_has_it(run: Path, tmp_path: Path) -> None:
    plain = Synth(duration_s=10.0).write(tmp_path / "plain")
    have = entities(convert(plain))
    assert not [p for p in have if "/fdi/" in p or "/wake" in p]
    with pytest.raises(NoTabError, match="no tab 'air data'"):
        convert(plain, tab="air data")
    assert convert(run, tmp_path / "air.rrd", tab="AIR DATA").exists()
    with pytest.raises(NoTabError, match="Overview, Station keeping"):
        convert(run, tmp_path / "b.rrd", tab="dance")


def test_failures_the_plant_was_told_to_make_are_shown(tmp_path: Path) -> None:
    folder = Synth(duration_s=10.0).write(tmp_path / "run")
    assert not [k for k in compute(folder) if k.startswith("plant.")]
    plant = Sender(2, 190)
    writer = TlogWriter(folder / "plant.tlog")
    for t, result in ((1_000_000, 0), (2_000_000, 3), (3_000_000, 0)):
        writer.write(t, plant.named("COMMAND_ACK", command=420, result=result))
        writer.write(t, plant.named("STATUSTEXT", severity=4, text="air probe 2 beta: bias 0.0175"))
    writer.close()
    found = compute(folder)
    assert (found["plant.failures.accepted"], found["plant.failures.refused"]) == (2, 1)
    assert "/sensors/receiver/failures" in entities(convert(folder))


@pytest.mark.parametrize("gone", ["FDI_STATUS", "WAKE_POSITION", "TRUTH"])
def test_a_run_with_a_part_only_converts(run: Path, tmp_path: Path, gone: str) -> None:
    shutil.copy(run / "truth.tlog", tmp_path)
    log = "truth.tlog" if gone == "TRUTH" else "tlm.tlog"
    writer_name = {"truth.tlog": run / "truth.tlog", "tlm.tlog": run / "tlm.tlog"}
    shutil.copy(run / "tlm.tlog", tmp_path)
    writer = TlogWriter(tmp_path / log)
    for t, link, packet in read(writer_name[log]):
        if packet_id(packet) != IDS[gone]:
            writer.write(t, packet, link)
    writer.close()
    assert convert(tmp_path).exists()
    found = compute(tmp_path)
    assert ("airdata.fdi.alarms" in found) == (gone != "FDI_STATUS")
    assert ("airdata.position.samples" in found) == (gone != "WAKE_POSITION")
