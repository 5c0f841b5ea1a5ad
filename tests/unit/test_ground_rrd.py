"""Run folder to Rerun recording: verified by rerun itself, the promised entities are there; shapes to scale; diff."""

from __future__ import annotations

import json
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from flightsw.aircraft import load_aircraft
from flightsw.icd.tlog import LINK_IN, TlogWriter, read
from flightsw.icd.wire import Sender
from ground.columns import LogError
from ground.compare import compare, report
from ground.geometry import euler_quat, quat_conj, quat_euler, quat_mul, quat_rotate, wrap
from ground.rrd import convert, picture_time
from ground.rrd.shot import ScreenshotError, screenshot, viewer
from ground.views.refueling import scene
from tests.drawn import rows, tables

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]


def fly(folder: Path) -> Path:
    """A short run with link logs."""
    synth = Synth(duration_s=30.0)
    run: Path = synth.write(folder)
    for i, name in enumerate(("tanker", "receiver")):
        plant = Sender(i + 1, 190)
        writer = TlogWriter(run / f"link_{name}.tlog")
        for t in synth.t_us.tolist():
            air = plant.named("AIR_DATA", time_usec=t, count=2, valid=3, airspeed=[190.0, 189.0, 0.0, 0.0])
            writer.write_datagram(t, air + plant.named("HIL_SENSOR", time_usec=t, zacc=-9.81), LINK_IN)
        writer.close()
    return run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run folder with run.rrd."""
    folder = fly(tmp_path_factory.mktemp("fly") / "refueling-1")
    assert convert(folder) == folder / "run.rrd"
    return folder


def entities(rrd: Path) -> dict[str, int]:
    """Path -> rows in the recording, of entities and lines."""
    reader = RrdReader(str(rrd))
    assert len(reader.recordings()) == 1
    assert len(reader.blueprints()) == 1
    return rows(rrd)


def test_rerun_verifies_the_file(run: Path) -> None:
    done = subprocess.run([str(viewer()), "rrd", "verify", str(run / "run.rrd")], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_promised_entities_are_there(run: Path) -> None:
    have = entities(run / "run.rrd")
    for name in ("tanker", "receiver"):
        for axis in "ned":
            assert have[f"/truth/{name}/wind/{axis}"] > 300
            assert have[f"/nav/{name}/wind/{axis}"] > 300
            assert have[f"/nav/{name}/wind_3sigma/{axis}"] > 300
        for path in (
            "truth/{}/V", "truth/{}/altitude", "truth/{}/bank", "truth/{}/controls/elevator", "ctrl/{}/elevator",
            "guid/{}/phase", "guid/{}/phases", "sensors/{}/health", "timing/{}/exec_mean", "timing/{}/slips",
            "truth/{}/scene/body", "truth/{}/track", "truth/{}/wind_arrow", "nav/{}/wind_arrow", "sensors/{}/air/V",
            "sensors/{}/imu/acc/z",
        ):  # fmt: skip
            assert have["/" + path.format(name)] > 0
    for axis in "xyz":
        assert have[f"/guid/receiver/error/{axis}"] > 300
    for path in ("boom/envelope", "boom/fixed", "boom/nozzle"):
        assert have[f"/truth/tanker/{path}"] > 0
    assert have["/guid/receiver/box"] > 1
    assert have["/guid/receiver/text"] >= 6
    assert have["/guid/receiver/scene/commanded"] > 300


def told(rrd: Path) -> dict[str, set[str]]:
    """Title of a plot -> lines its blueprint has it draw, by the components they are read from."""
    reader = RrdReader(str(rrd))
    [entry] = reader.blueprints()
    titles: dict[str, str] = {}
    drawn: dict[str, set[str]] = {}
    for chunk in reader.stream(store=entry):
        path, batch = str(chunk.entity_path), chunk.to_record_batch().to_pydict()
        view, _, below = path.removeprefix("/view/").partition("/ViewContents/overrides/")
        for name in batch.get("ViewBlueprint:display_name", ()):
            titles[view] = name[0]
        for mapping in batch.get("VisualizerInstruction:component_map", ()):
            sources = {m["target"]: m["source_component"] for m in mapping}
            entity = below.partition("/visualizers/")[0]
            drawn.setdefault(view, set()).add(f"/{entity}:{sources['Scalars:scalars']}")
            line = sources["Scalars:scalars"].removesuffix(":scalars")
            looks = [v for target, v in sources.items() if target != "Scalars:scalars"]
            assert looks and all(v.startswith(f"{line}:") for v in looks)
            drawn[view] |= {f"/{entity}:{v}" for v in looks}
    return {titles[view]: found for view, found in drawn.items()}


def test_plots_draw_the_lines_that_are_there_and_no_others(run: Path) -> None:
    """The viewer complains of a plot told to draw a component there is none of; one told of too few lacks a line."""
    have = {f"{entity}:{name}" for entity, batch, _ in tables(run / "run.rrd") for name in batch.schema.names}
    plots = told(run / "run.rrd")
    for title, wanted in plots.items():
        assert wanted <= have, (title, wanted - have)
    lines = {title: {p for p in wanted if p.endswith(":scalars")} for title, wanted in plots.items()}
    wind = {f"/{k}/tanker/{w}:d:scalars" for k, w in (("truth", "wind"), ("nav", "wind"), ("nav", "wind_3sigma"))}
    assert lines["tanker wind down [m/s]"] == wind
    assert lines["tanker specific force [m/s2]"] == {f"/sensors/tanker/imu/acc:{axis}:scalars" for axis in "xyz"}


def test_times_are_stored_once_for_all_lines_of_an_entity(run: Path) -> None:
    at: dict[str, list[int]] = {}
    together: dict[str, set[str]] = {}
    for entity, batch, own in tables(run / "run.rrd"):
        if own and "Scalars:scalars" not in own:
            at.setdefault(entity, []).extend(batch.column("sim_time").cast("int64").to_pylist())
            together.setdefault(entity, set()).update(own)
    for entity in ("/truth/tanker", "/truth/tanker/controls", "/nav/receiver/wind", "/ctrl/receiver"):
        assert len(together[entity]) >= 3 and len(at[entity]) == len(set(at[entity])) > 100, entity


def test_rebuilding_gives_the_same_entities(run: Path, tmp_path: Path) -> None:
    again = fly(tmp_path / "again")
    assert entities(convert(again)) == entities(run / "run.rrd")


def test_a_run_cut_short_still_converts(run: Path, tmp_path: Path) -> None:
    for name in ("truth.tlog", "tlm.tlog"):
        raw = (run / name).read_bytes()
        (tmp_path / name).write_bytes(raw[: len(raw) // 20])
    assert entities(convert(tmp_path))["/truth/tanker/V"] > 1


def test_empty_logs_convert(tmp_path: Path) -> None:
    for name in ("truth.tlog", "tlm.tlog"):
        (tmp_path / name).touch()
    assert convert(tmp_path).exists()


def test_missing_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"truth\.tlog"):
        convert(tmp_path)


def test_screenshot_says_what_is_missing(run: Path, tmp_path: Path) -> None:
    with pytest.raises(ScreenshotError, match="does not exist"):
        screenshot(tmp_path / "no.rrd", tmp_path / "a.png")
    with pytest.raises(ScreenshotError, match="WIDTHxHEIGHT"):
        screenshot(run / "run.rrd", tmp_path / "a.png", size="big")


def test_recording_and_monitor_do_not_import_rerun() -> None:
    code = "import sys, ground.__main__, ground.link.record, ground.link.live, ground.metrics; assert 'rerun' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_picture_is_taken_inside_contact(run: Path) -> None:
    from ground.run import load

    assert 0.35 * 30 < (picture_time(load(run)) or 0.0) < 0.85 * 30


def test_silhouettes_are_to_scale() -> None:
    for mesh, length, span in ((scene.tanker_mesh(), 41.5, 39.88), (scene.receiver_mesh(), 13.2, 10.36)):
        size = np.ptp(mesh.vertices, axis=0)
        assert size[0] == pytest.approx(length, rel=0.04)
        assert size[1] == pytest.approx(span, rel=0.02)
        assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0)


def test_envelope_and_nozzle_at_the_works_contact_position() -> None:
    boom = load_aircraft("kc135r").boom
    assert boom is not None
    pivot = np.array(boom.pivot_m)
    lines = np.concatenate(scene.envelope_lines(boom)) - pivot
    reach = np.linalg.norm(lines, axis=1)
    assert reach.min() == pytest.approx(boom.length_retracted_m + boom.extension_m[0])
    assert reach.max() == pytest.approx(boom.length_retracted_m + boom.extension_m[1])
    elevation = np.degrees(np.arcsin(-lines[:, 2] / reach))
    assert (elevation.min(), elevation.max()) == pytest.approx((-40.0, -20.0))
    tip = scene.boom_point(boom, np.radians([-30.0]), np.array([0.0]), np.array([8.53 + 3.66]))[0]
    receptacle = np.array([-35.5, 0.0, 8.5]) + np.array(load_aircraft("learjet24").receptacle.position_m)  # type: ignore[union-attr]
    assert tip == pytest.approx(receptacle, abs=0.02)


def test_rotations() -> None:
    rng = np.random.default_rng(1)
    euler = rng.uniform(-1.4, 1.4, (50, 3))
    q = euler_quat(euler)
    assert quat_euler(q) == pytest.approx(euler, abs=1e-12)
    v = rng.standard_normal((50, 3))
    assert quat_rotate(quat_conj(q), quat_rotate(q, v)) == pytest.approx(v, abs=1e-12)
    p = euler_quat(rng.uniform(-1, 1, (50, 3)))
    assert quat_rotate(quat_mul(p, q), v) == pytest.approx(quat_rotate(p, quat_rotate(q, v)), abs=1e-12)
    east = quat_rotate(euler_quat(np.array([[np.pi / 2, 0.0, 0.0]])), np.array([[1.0, 0.0, 0.0]]))
    assert east[0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)  # heading 90 deg: nose to the east
    assert wrap(np.array([3.5, -3.5, np.pi])) == pytest.approx([3.5 - 2 * np.pi, 2 * np.pi - 3.5, np.pi])


def test_diff_of_equal_and_unequal_runs(tmp_path: Path) -> None:
    a = Synth(duration_s=10.0).write(tmp_path / "a")
    b = shutil.copytree(a, tmp_path / "b")
    assert compare(a, b).same
    records = list(read(b / "tlm.tlog"))
    writer = TlogWriter(b / "tlm.tlog")
    for k, (t, link, packet) in enumerate(records):
        changed = Sender(1, 1).named("NAV_STATE", time_usec=t, V=1.0) if k == 40 else packet
        writer.write(t, changed, link)
    writer.close()
    (b / "summary.json").write_text(json.dumps({"loop.slips": 7}))
    result = compare(a, b)
    assert not result.same
    text = "\n".join(report(result))
    assert "record 40" in text
    assert "tlm.tlog: DIFFERENT" in text
    assert "truth.tlog: identical" in text
    assert "loop.slips: 2 | 7  (+5)" in text


def test_diff_of_what_is_no_run(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"nowhere' is not a run folder: it does not exist"):
        compare(tmp_path / "nowhere", tmp_path)
    with pytest.raises(LogError, match=r"is not a run folder: it has no \.tlog"):
        compare(tmp_path, tmp_path)
