"""The receiver leaves the boom by rule when the tanker's data stops, whichever radio has failed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import read
from tests.sil.launch import sil

SCENARIO = Path("sim_plant/scenarios/refueling.toml")


@pytest.mark.parametrize("target", ["tanker", "receiver"])
def test_lost_data_link_breaks_away(tmp_path: Path, target: str) -> None:
    text = SCENARIO.read_text().replace("duration_s = 1000.0", "duration_s = 75.0")
    text = text[: text.index("# what the run must show")]
    text += f'[[event]]\nt_s = 66.0\nkind = "link_loss"\ntarget = "{target}"\nfor_s = 5.0\n'
    path = tmp_path / "lost.toml"
    path.write_text(text)
    ended = sil("run", path, "--in-process", "--no-rrd", "--out", tmp_path / "run")
    assert ended.code == 0, ended.text
    said = []
    for t_us, _link, packet in read(tmp_path / "run" / "tlm.tlog"):
        for spec, values, sysid, *_ in wire.split(packet, wire.SPECS, wire.Counters()):
            if spec.name == "STATUSTEXT" and sysid == 2:
                said.append((t_us * 1e-6, spec.to_dict(values)["text"]))
    away = [t for t, s in said if s.startswith("breakaway: tanker data link silent")]
    assert len(away) == 1 and 66.9 < away[0] < 67.5, said
    assert not any("left its domain" in s for _, s in said), said
    assert _distances(tmp_path / "run")[-1] < 90.0  # still formating: on its way to the breakaway position, not lost
    assert any("data link back" in s for t, s in said if t > 70.9), said


def _distances(run: Path) -> list[float]:
    """Distance between the two aircraft along the run, from the plant's truth."""
    out = []
    for _t, _link, packet in read(run / "truth.tlog"):
        for spec, values, sysid, *_ in wire.split(packet, wire.SPECS, wire.Counters()):
            if sysid == 2:
                out.append(math.dist(spec.to_dict(values)["xi"], (0.0, 0.0, 0.0)))
    return out
