"""The whole rendezvous through the plant link, in process, and its kinematic twin."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import pytest

from flightsw.icd.codec_receive import ACCEPT
from flightsw.icd.wire import BY_NAME, SPECS, Counters, split
from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.process.config import load_flight
from flightsw.process.node import Node
from hil_scripts.launch.runfolder import make_folder
from hil_scripts.studies.rivard.six_dof import pool
from hil_scripts.studies.rivard.six_dof_flight import fly, fly_twin, plan_of
from sim_plant.scenario import load_scenario
from sim_plant.server import PlantServer


def test_tanker_rolls_out_ahead_of_the_receiver_as_its_twin_does() -> None:
    plan = plan_of((), 2)
    six, kin = fly(plan), fly_twin(plan)
    assert six.done and kin.done
    for m in (six, kin):
        assert abs(m.x_m) < 1500.0 and abs(m.y_m) < 400.0 and 150.0 < m.end_s < 300.0
        assert len(m.nees3) == 6 and all(0.0 < v < 8.0 for v in m.nees3)
    assert abs(six.x_m - kin.x_m) < 600.0 and abs(six.y_m - kin.y_m) < 250.0
    mc = {
        "mc.n": 400.0,
        "mc.done": 399.0,
        "mc.x.square_m2": 4e4,
        "mc.y.square_m2": 1e4,
        "mc.x.mean_m": 1.0,
        "mc.y.mean_m": 2.0,
    }
    figures = pool([six.values("six") | kin.values("kin") | mc] * 2)
    assert figures["six.x.rms_m"] == pytest.approx(abs(six.x_m)) and figures["six.unfinished"] == 0
    assert figures["mc.unfinished"] == 2 and figures["ratio.mc.x"] == pytest.approx(abs(six.x_m) / 200.0)
    assert figures["ratio.kin.y"] == pytest.approx(abs(six.y_m / kin.y_m))


def test_a_link_of_its_own_rate_is_flown_with_over_the_wire() -> None:
    """Twelve seconds over the plant link: positions each 100 ms come through, one a second is fused, none is dropped."""
    at = "plant.sensors.tanker.tacan."
    own = (f"{at}link_std_m=100.0", f"{at}link_dt_s=0.1", f"{at}link_tau_s=5.0", f"{at}link_latency_ms=150.0")
    plan = plan_of((*own, f"{at}bearing_std_deg=1.0", f"{at}bearing_dt_s=0.1", f"{at}bearing_tau_s=5.0"), 2)
    with tempfile.TemporaryDirectory() as tmp:
        run = make_folder(plan, Path(tmp) / "run")
        server = PlantServer(load_scenario(str(run / "scenario.toml")), plan.seed)
        node = Node(load_flight(run / f"flight_{plan.flights[0].name}.toml"))
    for _ in range(1200):
        server.end_tick([node.step((server.begin_tick()[0],))])
        node.after()
        node.take_heard()
    mission = node.app.mission  # type: ignore[attr-defined]
    r, ((_, other),) = mission.track.out, server.world.others()
    x, y = mission.track.frame.to_r(other.pos_n[0], other.pos_n[1])
    assert r.valid and r.updates == 2 and mission.track.est.out.sided
    assert mission.track.est.fixes[kf.FS_COUNT] in (22.0, 23.0)  # bearings and positions since 1 s, and a range
    sx, sy = math.sqrt(r.cov[0]), math.sqrt(r.cov[7])
    assert sx < 250.0 and sy < 250.0 and abs(r.mean[0] - x) < 4.0 * sx and abs(r.mean[2] - y) < 4.0 * sy
    assert node.count == Counters()
    server.close()


def test_nothing_but_sensor_messages_reaches_the_onboard_software() -> None:
    server = PlantServer(load_scenario("rendezvous", {"sensors.tanker.tacan.bearing_std_deg": 1.0}), 1)
    names = set()
    for _ in range(150):
        [d] = server.begin_tick()
        names |= {p[0].name for p in split(d, SPECS, Counters())}
        server.end_tick([None])
    assert {"TACAN", "CREW_RADAR", "HIL_SENSOR"} <= names and "TRUTH" not in names
    assert {BY_NAME[n].id for n in names} <= set(ACCEPT)
