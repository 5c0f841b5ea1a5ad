"""The receiver leaves the boom by rule when the tanker's data stops, whichever radio has failed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import read
from tests.sil.launch import sil

POINTS = ("plant.aircraft.receiver.start.xi_m", "receiver.guid.observation_m", "receiver.guid.precontact_m")
NEAR = [word for key in POINTS for word in ("--set", f"{key}=[-38.0, 0.0, 6.7]")]  # contact is reached at 26 s
ORDERS = ((10.0, "precontact"), (16.0, "contact"))
LOST_S = 30.0


@pytest.mark.parametrize("target", ["tanker", "receiver"])
def test_lost_data_link_breaks_away(tmp_path: Path, target: str) -> None:
    orders = (f'{{t_s={t}, kind="command", target="receiver", action="{name}"}}' for t, name in ORDERS)
    event = f'plant.event=[{", ".join(orders)}, {{t_s={LOST_S}, kind="link_loss", target="{target}", for_s=5.0}}]'
    run = ("run", "refueling", "--duration", LOST_S + 9.0, *NEAR, "--set", event)
    ended = sil(*run, "--in-process", "--no-rrd", "--out", tmp_path / "run")
    assert ended.code == 0, ended.text
    said = []
    for t_us, _link, packet in read(tmp_path / "run" / "tlm.tlog"):
        for spec, values, sysid, *_ in wire.split(packet, wire.SPECS, wire.Counters()):
            if spec.name == "STATUSTEXT" and sysid == 2:
                said.append((t_us * 1e-6, spec.to_dict(values)["text"]))
    away = [t for t, s in said if s.startswith("breakaway: tanker data link silent")]
    assert len(away) == 1 and LOST_S + 0.9 < away[0] < LOST_S + 1.5, said
    assert not any("left its domain" in s for _, s in said), said
    assert _distances(tmp_path / "run")[-1] < 90.0  # still formating: on its way to the breakaway position, not lost
    assert any("data link back" in s for t, s in said if t > LOST_S + 4.9), said


def _distances(run: Path) -> list[float]:
    """Distance between the two aircraft along the run, from the plant's truth."""
    out = []
    for _t, _link, packet in read(run / "truth.tlog"):
        for spec, values, sysid, *_ in wire.split(packet, wire.SPECS, wire.Counters()):
            if sysid == 2:
                out.append(math.dist(spec.to_dict(values)["xi"], (0.0, 0.0, 0.0)))
    return out
