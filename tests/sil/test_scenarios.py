"""Every scenario file flies, in short form: it starts, both sides talk, nothing is lost, the figures come out."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.icd.tlog import read
from hil_scripts.launch.places import SCENARIOS
from hil_scripts.launch.runfolder import resolve
from tests.sil.launch import sil, summary

SHORT_S = 8.0  # [s] simulated


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.toml")), ids=lambda p: p.stem)
def test_scenario_flies(path: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    ended = sil("run", path.stem, "--in-process", "--duration", SHORT_S, "--no-rrd", "--out", run)
    assert ended.code == 0, ended.text
    s = summary(run)
    assert s["run.outcome"] == "completed"
    assert s["run.sim_s"] == pytest.approx(SHORT_S)
    assert s["link.dropped"] == 0 and s["loop.slips"] == 0
    for f in resolve(path.stem, None, [], SHORT_S).flights:
        last = max(t for t, _, _ in read(run / f"link_{f.name}.tlog"))
        assert last / 1e6 == pytest.approx(SHORT_S, abs=0.05)
        assert (run / f"flight_{f.name}.toml").exists()
    for name in ("scenario.toml", "meta.json", "tlm.tlog", "truth.tlog"):
        assert (run / name).stat().st_size > 0
