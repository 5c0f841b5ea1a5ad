"""All aircraft of a world flown in two calls a tick against the same aircraft one by one."""

from __future__ import annotations

import copy
from dataclasses import astuple, replace
from typing import Any

import numpy as np
import pytest

from sim_plant.aircraft.sixdof.together import Together
from sim_plant.block import Block
from sim_plant.flown import Apart
from sim_plant.kernels import layout as n
from sim_plant.lost import AircraftLostError
from sim_plant.scenario import load_scenario
from sim_plant.world import World

RECEIVER = "aircraft.receiver"
FAULTS = [
    {"t_s": 0.10, "kind": "engine_off", "target": "tanker", "index": 0, "for_s": 0.5},
    {"t_s": 0.15, "kind": "jam", "target": "receiver", "surface": "elevator", "for_s": 0.3},
    {"t_s": 0.20, "kind": "leak", "target": "receiver", "value": [3.0]},
    {"t_s": 0.20, "kind": "spike", "target": "receiver", "sensor": "gnss", "value": [9.0]},
    {"t_s": 0.25, "kind": "delayed", "target": "receiver", "sensor": "imu", "samples": 7, "for_s": 0.4},
    {"t_s": 0.30, "kind": "blocked", "target": "receiver", "sensor": "air", "index": 1},
    {"t_s": 0.30, "kind": "float", "target": "tanker", "surface": "rudder"},
    {"t_s": 0.35, "kind": "stamp", "target": "tanker", "sensor": "gnss", "value": [-0.2]},
]
AT_THE_BOOM = {
    f"{RECEIVER}.start.xi_m": [-35.0, 0.0, 9.2], "refuel.capture_s": 0.1, "refuel.capture_speed_mps": 50.0,
}  # fmt: skip
WORLDS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "faults": {"event": FAULTS},
    "contact": AT_THE_BOOM,
    "sensors of a grade": {"sensors.tanker.grade": "mems", "sensors.receiver.grade": "tactical"},
    "late": {"sensors.receiver.rel.latency_ms": 60.0, "sensors.receiver.rel.range_max_m": 81.0},
    "upset": {f"{RECEIVER}.start.upset": {"attitude_deg": [0.0, 20.0, 100.0], "rates_degps": [30.0, 0.0, 0.0], "V_mps": 180.0}},
    "no wake, no track": {"wind.wake.source": "", "wind.dryden.axes": "ned", "wind.slow.sigma_mps": 1.0},
    "delays": {"link.actuator_delay_ticks": 2, "link.actuator_jitter_ticks": 3},
    "the earth round": {"earth": "wgs84", f"{RECEIVER}.airframe": "full", "wind.density": "sounding"},
}  # fmt: skip


def seen(w: World) -> str:
    """All that there is to see at a tick, to the bit; the air at the probes when it is read."""
    frames = [astuple(f) for f in w.sense()]
    truths = [w.truth(i) for i in range(len(w.members))]
    views = [(m.view.contact, m.view.transfer_kgps, m.view.rel, m.view.boom) for m in w.members]
    arrays = [[a.tolist() for a in (m.s, m.obs[: n.O_PROBE], m.wind, m.free, m.calm)] for m in w.members]
    read = [m for m in w.members if any(s.group == "air" and w.tick % s.div == 0 for s in m.sensors)]
    probes = [[a.tolist() for a in (m.obs[n.O_PROBE :], m.probe_wake)] for m in read]
    return repr((frames, truths, views, arrays, probes))


def fly(w: World, ticks: int) -> list[str]:
    """What is seen of so many ticks; the receiver asks for the latch and moves its elevator."""
    out = []
    for k in range(ticks):
        out.append(seen(w))
        cmd = w.trim_cmd(1)
        cmd = replace(cmd, latch=True, elevator=cmd.elevator + 0.01 * (k % 3))
        w.step([w.trim_cmd(0), None if k % 50 > 45 else cmd])
    return out


@pytest.mark.parametrize("what", WORLDS)
def test_together_all_fly_to_the_bit_as_one_by_one(what: str) -> None:
    """And so does a copy made on the way."""
    sc = load_scenario("refueling", WORLDS[what])
    whole, single = World(sc, 3), World(sc, 3, together=False)
    assert isinstance(whole._flown, Together) and isinstance(single._flown, Apart)
    first = fly(whole, 45)
    assert first == fly(single, 45)
    twin = copy.deepcopy(whole)
    rest = fly(single, 80)
    assert fly(twin, 80) == rest
    assert fly(whole, 80) == rest
    assert len(set(rest)) == 80
    coupled = f"(True, {sc.refuel.transfer_kgps}, "  # contact, and what flows
    assert any(coupled in x for x in first) == (what == "contact")


@pytest.mark.parametrize("faulty", [False, True])
def test_the_air_at_the_probes_is_worked_out_when_air_data_are_due(faulty: bool) -> None:
    """Also for an instrument with a fault, which is read by itself."""
    stuck = {"t_s": 0.0, "kind": "stuck", "target": "receiver", "sensor": "air"}
    w = World(load_scenario("refueling", {"event": [stuck] * faulty}), 1)
    air = [next(s for s in m.sensors if s.group == "air") for m in w.members]
    assert [s.div for s in air] == [5, 5]
    seen_at = []
    for _ in range(16):
        w.sense()
        assert air[1].faulty is faulty
        seen_at.append([m.obs[n.O_PROBE :].tolist() for m in w.members])
        w.step([w.trim_cmd(0), w.trim_cmd(1)])
    for i in range(2):
        rows = [x[i] for x in seen_at]
        assert [k for k in range(1, 16) if rows[k] != rows[k - 1]] == [5, 10, 15]


def test_who_is_lost_is_lost_at_the_same_tick() -> None:
    said = []
    for together in (True, False):
        w = World(load_scenario("refueling", {f"{RECEIVER}.start.xi_m": [-20.0, 0.0, 0.0]}), 1, together)
        with pytest.raises(AircraftLostError) as e:
            for _ in range(1500):
                w.sense()
                w.step([w.trim_cmd(0), replace(w.trim_cmd(1), throttle=1.0)])
        said.append(str(e.value))
    assert said[0] == said[1] and "touched" in said[0]


@pytest.mark.parametrize(
    "sets",
    [
        {"wind.wake.path": "flown"},
        {"wind.bow.source": "receiver"},
        {"wind.dryden.over": "field"},
        {"wind.dryden.independent": True},
        {f"{RECEIVER}.model": "jsbsim"},
    ],
)
def test_what_the_two_calls_do_not_know_is_flown_one_by_one(sets: dict[str, Any]) -> None:
    w = World(load_scenario("refueling", sets), 1)
    assert isinstance(w._flown, Apart)
    fly(w, 2)


def test_a_copied_block_has_views_of_its_own() -> None:
    block = Block()
    block.size(2, 9)
    view = block.lay(1, 3, np.array([[1.0, 2.0], [3.0, 4.0]]))
    both = {"block": block, "held": view, "again": [view]}
    twin = copy.deepcopy(both)
    twin["block"].rows[1, 3] = 7.0  # type: ignore[attr-defined]
    assert twin["held"] is twin["again"][0]  # type: ignore[index]
    assert twin["held"].tolist() == [[7.0, 2.0], [3.0, 4.0]] and view.tolist() == [[1.0, 2.0], [3.0, 4.0]]  # type: ignore[attr-defined]
    view[1, 1] = 9.0
    assert block.rows[1].tolist() == [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 9.0, 0.0, 0.0]
