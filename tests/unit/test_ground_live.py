"""A run drawn as it flies: the same rows as its recording, bounded memory, damage and restarts, addresses on loopback."""

from __future__ import annotations

import itertools
import runpy
from collections import defaultdict
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from flightsw.icd.tlog import LINK_IN, TlogWriter
from flightsw.icd.wire import Sender
from ground import columns
from ground.rrd import convert, viewer
from ground.rrd.flow import Flow, Picture
from ground.rrd.series import APPLICATION
from ground.window import ROWS, Tail, Telemetry

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
Rows = dict[str, dict[int, list[float]]]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run with a link log."""
    synth = Synth(duration_s=24.0)
    folder: Path = synth.write(tmp_path_factory.mktemp("live") / "refueling-1")
    plant = Sender(1, 190)
    writer = TlogWriter(folder / "link_tanker.tlog")
    for t in synth.t_us.tolist():
        writer.write_datagram(t, plant.named("HIL_SENSOR", time_usec=t, zacc=-9.81), LINK_IN)
    writer.close()
    return folder


def rows_of(rrd: Path) -> Rows:
    """Component -> time [us] -> numbers of its row, temporal rows only."""
    out: Rows = defaultdict(dict)
    for chunk in RrdReader(str(rrd)).stream():
        batch = chunk.to_record_batch()
        if "sim_time" not in batch.schema.names:
            continue
        at = batch.column("sim_time").cast(pa.int64()).to_numpy() // 1000
        values = {n: c for n, c in zip(batch.schema.names, batch.columns, strict=True) if ":" in n}
        for (name, column), (i, t) in itertools.product(values.items(), enumerate(at.tolist())):
            flat = column.slice(i, 1)
            while hasattr(flat, "flatten") and pa.types.is_nested(flat.type):
                flat = flat.flatten() if not pa.types.is_struct(flat.type) else pa.concat_arrays(flat.flatten())
            row = [float(hash(v)) if isinstance(v, str) else float(v) for v in flat.to_pylist() if v is not None]
            out[f"{chunk.entity_path}:{name}"][t] = row
    return out


def grow(source: Path, target: Path, share: float) -> None:
    """Write the logs of a run up to a share of their bytes, cut anywhere."""
    for path in source.glob("*.tlog"):
        raw = path.read_bytes()
        with (target / path.name).open("ab") as f:
            f.write(raw[f.tell() : int(len(raw) * share)])


def test_live_and_recorded_pictures_have_the_same_rows(run: Path, tmp_path: Path) -> None:
    flow = Flow(tmp_path, by_log=True)
    rec = rr.RecordingStream(APPLICATION, recording_id="live")
    rec.save(str(tmp_path / "live.rrd"))
    picture = Picture(flow, "live", rec)
    steps = 40
    for k in range(1, steps + 1):
        grow(run, tmp_path, k / steps)
        if flow.take() and flow.end_us:
            picture.lay_out()
        if flow.end_us:
            picture.batch()
    for _ in range(2):
        flow.take()
        picture.batch(last=True)
    rec.flush()
    rec.disconnect()
    live, recorded = rows_of(tmp_path / "live.rrd"), rows_of(convert(run, tmp_path / "run.rrd"))
    whole = {
        p for p in recorded if p.endswith((":telemetry_lost:scalars", ":box:scalars", ":target:scalars"))
    }  # as long as the run, not rows of it
    assert recorded.keys() <= live.keys() and len(recorded) > 60
    for path in recorded.keys() - whole:
        assert list(live[path]) == list(recorded[path]), path
        for t, row in recorded[path].items():
            assert live[path][t] == pytest.approx(row, abs=1e-9), (path, t)
    lines = {p for p in recorded if p.endswith(":scalars") and not p.endswith(":Scalars:scalars")}
    assert {p.removesuffix(":scalars").replace(":", "/").strip("/") for p in lines} == picture.sink.lines
    assert picture.shown is not None and not picture.shown.fit(picture.sink.lines)  # its plots have been told of all


def test_what_is_held_does_not_grow_with_the_run() -> None:
    telemetry, sender = Telemetry(), Sender(1, 1)
    for second in range(400):
        for k in range(20):
            telemetry.take(sender.named("NAV_STATE", time_usec=second * 1_000_000 + k * 50_000))
        telemetry.settle()
        telemetry.stretch.forget(second * 1_000_000 - 5_000_000)
    assert 100 <= len(telemetry.stretch.tables[1, "NAV_STATE"]) <= 122
    for _ in range(ROWS + 5):
        telemetry.take(sender.named("NAV_STATE", time_usec=400_000_000))
    assert telemetry.skipped == 5


def test_damage_and_loss_are_counted_and_a_restart_is_seen() -> None:
    telemetry, sender = Telemetry(), Sender(2, 1)
    telemetry.take(b"\xfd rubbish")
    for k in range(20):
        packet = sender.named("NAV_STATE", time_usec=60_000_000 + k * 100_000)
        if k != 7:
            telemetry.take(packet)
    telemetry.settle()
    assert telemetry.junk == 1 and telemetry.stretch.dropped == {2: 1} and not telemetry.restarted
    assert telemetry.stretch.newest() == {2: 61_900_000}
    telemetry.take(sender.named("NAV_STATE", time_usec=61_000_000))  # overtaken, no restart
    telemetry.settle()
    assert (np.diff(telemetry.stretch.tables[2, "NAV_STATE"].t_us) >= 0).all() and not telemetry.restarted
    for k in range(5):
        telemetry.take(sender.named("NAV_STATE", time_usec=k * 100_000))
    assert telemetry.restarted


def test_a_log_is_read_as_it_grows(run: Path, tmp_path: Path) -> None:
    path = tmp_path / "tlm.tlog"
    raw, tail = (run / "tlm.tlog").read_bytes(), Tail(path)
    assert tail.take() == 0
    for start in range(0, len(raw), 4999):
        with path.open("ab") as f:
            f.write(raw[start : start + 4999])
        tail.take()
    whole = columns.load(run / "tlm.tlog")
    assert {k: len(t) for k, t in tail.stretch.tables.items()} == {k: len(t) for k, t in whole.tables.items()}
    assert tail.skipped == 0
    path.write_bytes(raw[:2000])  # another log of that name
    tail.take()
    assert tail.read == len(raw) + 2000


def test_pages_and_viewers_are_bound_to_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    page = viewer.in_browser(0, 0)
    assert page.page.startswith("http://127.0.0.1:") and "127.0.0.1" in page.url
    monkeypatch.setenv("DISPLAY", ":0")
    for shown in (page, viewer.native(viewer.free_port(0))):
        assert shown.command[shown.command.index("--bind") + 1] == "127.0.0.1"
        assert any(k.endswith("memory-limit") for k in shown.command)
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(viewer.ViewerError, match="--web"):
        viewer.native(viewer.free_port(0))
