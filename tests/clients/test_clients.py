"""Other people's ground stations against a flight in real time: each by its own library, all on one flight.

MAVProxy and MAVSDK come with the extra `tools`; where one is not installed its tests are skipped by name.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from flightsw.icd.link import telemetry_port
from ground.__main__ import app as ground
from ground.columns import load
from tests.clients.proxy import Proxy
from tests.clients.station import UNSUPPORTED, Station
from tests.sil.launch import sil, start, wait_for

pytestmark = pytest.mark.rt  # a flight at the wall clock's pace: `pytest -m rt tests/clients`
HERE = Path(__file__).parent
TOOLS = Path(sys.executable).parent
TANKER, RECEIVER = 1, 2
MODES = {"INIT", "OBSERVATION", "TO_PRECONTACT", "PRECONTACT", "TO_CONTACT", "CONTACT", "DISCONNECT", "RETURN", "BREAKAWAY",
         "HOLD"}  # fmt: skip


def needs(module: str) -> pytest.MarkDecorator:
    """Skip where a client is not installed, and say which."""
    return pytest.mark.skipif(
        importlib.util.find_spec(module) is None, reason=f"{module} is not installed (extra tools)"
    )


class Flight:
    """A flight under way. `land` ends it as Ctrl-C does."""

    def __init__(self, run: Path, offset: int) -> None:
        self.run, self.offset, self.words = run, offset, run.with_suffix(".txt")
        patient = [
            f"--set={who}.peer_timeout_s=60" for who in ("plant.clock", "tanker.link", "receiver.link")
        ]  # a machine at its limit
        args = ("--realtime", "--duration", 300, "--no-rrd", "--out", run, "--port-offset", offset, *patient)
        self.process = start("run", "airdata", *args, out=self.words)

    def port(self, sysid: int) -> int:
        """Telemetry port of an aircraft."""
        return telemetry_port(sysid, self.offset)

    def land(self) -> Path:
        """End the flight; its folder."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(60.0)
        return self.run


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory, next_port_offset: Callable[[], int]) -> Iterator[Flight]:
    """The flight all tests here talk to, once its receiver holds the observation position."""
    flight = Flight(tmp_path_factory.mktemp("clients") / "run", next_port_offset())
    try:
        up = wait_for(
            lambda: "observation" in flight.words.read_text(errors="replace") or flight.process.poll() is not None
        )
        assert up and flight.process.poll() is None, flight.words.read_text(errors="replace")
        yield flight
    finally:
        flight.land()


def test_qgroundcontrol_connects_without_asking_anything_twice(flight: Flight) -> None:
    met = Station(flight.port(RECEIVER), RECEIVER).connect()
    assert met.late == []
    assert set(met.modes) == MODES and met.metadata == [UNSUPPORTED, UNSUPPORTED]
    assert met.version["capabilities"] & 8192 and len(met.parameters) == met.count > 250
    assert len(met.plans[0]) == 5 and met.plans[1] == met.plans[2] == []
    tanker = Station(flight.port(TANKER), TANKER).connect()
    assert tanker.late == [] and set(tanker.modes) == {"INIT", "LEG", "TURN"} and len(tanker.plans[0]) == 5
    assert 100 < tanker.count < met.count


def test_pymavlink_reads_sets_and_commands(flight: Flight) -> None:
    """mavutil in a process of its own: its dialect is a global of the process."""
    code = """
import json, sys, time
from pymavlink import mavutil
m = mavutil.mavlink_connection("udpout:127.0.0.1:" + sys.argv[1], source_system=255)
m.mav.heartbeat_send(6, 8, 0, 0, 4)
out = {"target": [m.wait_heartbeat(timeout=10).get_srcSystem(), m.target_component]}
def wait(kind, test=lambda x: True):
    end = time.time() + 10
    while time.time() < end:
        x = m.recv_match(type=kind, blocking=True, timeout=1)
        if x is not None and test(x):
            return x
def read(name):
    m.param_fetch_one(name)
    return wait("PARAM_VALUE", lambda x: x.param_id == name).param_value
out["before"] = read("GUID_BOOM_MAKE")
m.param_set_send("GUID_BOOM_MAKE", 31.0)
wait("PARAM_VALUE", lambda x: x.param_id == "GUID_BOOM_MAKE")
out["after"] = read("GUID_BOOM_MAKE")
m.mav.command_long_send(m.target_system, 1, 31010, 0, 5000, 0, 0, 0, 0, 0, 0)
out["ack"] = wait("COMMAND_ACK", lambda x: x.command == 31010).result
m.mav.ping_send(5, 9, 0, 0)
out["ping"] = wait("PING").seq
m.mav.set_mode_send(m.target_system, 1, 1003)
out["mode"] = wait("COMMAND_ACK", lambda x: x.command == 176).result
m.mav.log_request_list_send(m.target_system, 1, 0, 65535)
out["logs"] = wait("LOG_ENTRY").num_logs
for kind in ("GPS_RAW_INT", "HOME_POSITION", "EXTENDED_SYS_STATE", "HIGHRES_IMU", "SCALED_PRESSURE", "SYSTEM_TIME", "VFR_HUD"):
    out[kind] = wait(kind).to_dict()
out["flightmode"] = m.flightmode
v1 = mavutil.mavlink_connection("udpout:127.0.0.1:" + sys.argv[1], source_system=254)
import pymavlink.dialects.v10.common as old
mav1 = old.MAVLink(v1, srcSystem=254)
mav1.ping_send(5, 77, 0, 0)
end = time.time() + 10
while time.time() < end:
    x = v1.recv_match(type="PING", blocking=True, timeout=1)
    if x is not None:
        out["ping1"] = x.seq
        break
print(json.dumps(out, default=str))
"""
    env = {**os.environ, "MAVLINK20": "1"}
    r = subprocess.run(
        [sys.executable, "-c", code, str(flight.port(RECEIVER))],
        capture_output=True,
        text=True,
        timeout=90,
        env=env,
        check=False,
    )
    assert r.returncode == 0, r.stderr
    out = json.loads(r.stdout.splitlines()[-1])
    assert out["target"][0] == 2 and (out["before"], out["after"]) == (30.0, 31.0)
    assert (out["ack"], out["ping"], out["mode"], out["logs"], out["ping1"]) == (2, 9, 3, 0, 77)
    assert out["flightmode"].startswith("Mode(10")  # no other autopilot's word for it
    assert out["GPS_RAW_INT"]["fix_type"] == 3 and out["EXTENDED_SYS_STATE"]["landed_state"] == 2
    assert abs(out["GPS_RAW_INT"]["lat"] * 1e-7 - out["HOME_POSITION"]["latitude"] * 1e-7) < 1.0
    assert 90.0 < out["VFR_HUD"]["airspeed"] < 160.0  # calibrated at 7 km: 195 m/s true
    assert 1.7e9 <= out["SYSTEM_TIME"]["time_unix_usec"] / 1e6 < 1.7e9 + 600.0
    assert 350.0 < out["SCALED_PRESSURE"]["press_abs"] < 450.0 and out["HIGHRES_IMU"]["zacc"] < -5.0


@needs("mavsdk")
def test_mavsdk_finds_it_healthy_reads_sets_fails_and_downloads(flight: Flight) -> None:
    r = subprocess.run(
        [sys.executable, str(HERE / "sdk.py"), str(flight.port(RECEIVER)), "GUID_V_CLOSE"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    found = re.search(r"RESULT (\{.*\})", r.stdout)
    assert found, r.stdout[-2000:] + r.stderr[-2000:]
    out: dict[str, Any] = json.loads(found[1])
    assert out["system"] == RECEIVER and out["health_all_ok"] and out["in_air"]
    assert 35.0 < out["position"][0] < 36.0 and 6800.0 < out["position"][2] < 7200.0
    assert out["mode"] in MODES and 1.7e9 <= out["unix_s"] < 1.7e9 + 600.0
    assert out["parameters"][0] > 250 and out["parameters"][1] == 0
    assert out["set"] == "" and out["read_back"] == pytest.approx(1.25)
    assert out["refused"] == ["VALUE_OUT_OF_RANGE", "READ_ONLY", "DOES_NOT_EXIST"]
    assert out["inject"] == ["", ""] and out["refused_failure"] == "DENIED"
    assert len(out["route"]) == 5 and out["fence"] == out["rally"] == 0


@needs("MAVProxy")
def test_mavproxy_shows_and_sets_parameters_lists_plans_and_modes(flight: Flight, tmp_path: Path) -> None:
    with Proxy(tmp_path, flight.port(TANKER), modules="param,mode,wp,fence,rally,misc,cmdlong") as proxy:
        proxy.ask("param show GUID_HEADNG_GAIN", r"GUID_HEADNG_GAIN +0\.039999\d* *|GUID_HEADNG_GAIN +0\.04")
        proxy.ask("param set GUID_HEADNG_GAIN 0.02", r"GUID_HEADNG_GAIN 0\.04 -> 0\.02")
        proxy.ask("param show GUID_HEADNG_GAIN", r"GUID_HEADNG_GAIN +0\.0199")
        proxy.ask("param set GUID_HEADNG_GAIN 7", r"GUID_HEADNG_GAIN = 7: allowed 0 to 1")
        proxy.ask("wp list", r"Requesting 5 waypoints")
        proxy.ask("fence list", r"Requesting 0 fence items")
        proxy.ask("rally list", r"Requesting 0 rally items")
        proxy.ask("mode 1010", r"modes are phases of the mission")
        proxy.ask("status GPS_RAW_INT", r"GPS_RAW_INT \{.*fix_type : 3")
        proxy.ask("status HOME_POSITION", r"HOME_POSITION \{.*latitude : 351800000")
    text = proxy.said()
    assert "Mode(1010)" in text and "fence breach" not in text
    assert not any(word in text for word in ("RTL>", "STABILIZE>", "CIRCLE>"))


@needs("MAVProxy")
def test_mavproxys_map_has_both_aircraft_their_headings_home_and_the_route(flight: Flight, tmp_path: Path) -> None:
    """The map module itself, told to draw on no window."""
    drawn = tmp_path / "drawn.jsonl"
    before = [str(HERE / "map.py"), str(drawn)]

    def of(*names: str) -> list[list[Any]]:
        return [d for d in map(json.loads, drawn.read_text().splitlines()) if d[1] in names]

    ports, modules = map(flight.port, (TANKER, RECEIVER)), "wp,fence,rally,misc"
    with Proxy(tmp_path, *ports, modules=modules, before=before, ready="Detected vehicle 2:1") as proxy:
        proxy.ask("vehicle 1", r"Detected vehicle 1:1")
        proxy.ask("module load map", r"Loaded module map")
        proxy.ask("wp list", r"Requesting 5 waypoints")
        assert wait_for(lambda: bool(of("mission 0")) and all(len(of(f"PosVehicle{k}")) > 12 for k in (1, 2)), 60.0), (
            drawn.read_text()[-3000:], proxy.said()[-2000:],
        )  # fmt: skip
    for sysid in (TANKER, RECEIVER):
        icon, *moves = [d for d in of(f"PosVehicle{sysid}") if d[0] in ("SlipIcon", "set_position")]
        assert icon[0] == "SlipIcon" and icon[2][1] == "redplane.png"
        at = np.radians([m[2][0] for m in moves])
        heading = np.radians([m[3]["rotation"] for m in moves])
        step = np.diff(at, axis=0) * [1.0, math.cos(at[0, 0])]
        flown = np.arctan2(step[1:, 1], step[1:, 0])
        off = (flown - heading[1:-1] + np.pi) % (2.0 * np.pi) - np.pi
        assert np.abs(off).max() < math.radians(20.0)  # the wind's drift
        assert moves[-1][3]["label"] == str(sysid)
        gps = [d[2][0] for d in of(f"GPSVehicle{sysid}") if d[0] == "set_position"]
        assert gps and np.hypot(*(gps[-1] - np.degrees(at[-1]))) * 111e3 < 1000.0  # once a second at 200 m/s
    assert next(d[2][1] for d in of("HOME_POSITION")) == "home.png"
    route = np.array(of("mission 0")[-1][2][0])
    home = np.array(of("HOME_POSITION")[-1][2][0])
    assert len(route) >= 4 and np.hypot(*(route - home).T).max() * 111e3 < 200e3
    assert {d[1] for d in map(json.loads, drawn.read_text().splitlines()) if d[0] == "SlipLabel"} >= {
        "miss_cmd 0/0",
        "miss_cmd 0/3",
    }


# --- after the flight -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def landed(flight: Flight) -> Path:
    """The run folder."""
    time.sleep(1.0)
    return flight.land()


def test_what_was_set_is_in_the_folder_in_the_log_and_replays(landed: Path) -> None:
    entries = tomllib.loads((landed / "params_receiver.toml").read_text())["set"]
    assert ("guid.boom_make_s", 31.0, 255) in [(e["key"], e["value"], e["system"]) for e in entries]
    values = load(landed / "tlm.tlog").get(RECEIVER, "PARAM_VALUE")
    assert values is not None
    ended = sil("replay", landed)
    assert ended.code == 0, ended.text


def test_pymavlinks_tools_read_the_logs_and_with_the_dialect_truth(landed: Path, tmp_path: Path) -> None:
    made = CliRunner().invoke(ground, ["dialect", "--out", str(tmp_path / "wakefield.py")])
    assert made.exit_code == 0, made.output
    tlm, truth, types = landed / "tlm.tlog", landed / "truth.tlog", "GPS_RAW_INT,PARAM_VALUE,CURRENT_MODE"
    jobs: list[list[object]] = [
        ["dump.txt", "mavlogdump.py", "--types", types, tlm],
        ["gpx.txt", "mavtogpx.py", tlm],
        ["graph.txt", "mavgraph.py", "--output", "a.png", tlm, "VFR_HUD.airspeed"],
        ["truth.txt", "mavlogdump.py", "--dialect", "wakefield", "--types", "TRUTH", "--robust", truth],
        ["truth_graph.txt", "mavgraph.py", "--dialect", "wakefield", "--output", "t.png", truth, "TRUTH.V"],
    ]
    jobs = [[out, str(TOOLS / str(tool)), *map(str, args)] for out, tool, *args in jobs]
    r = subprocess.run(
        [sys.executable, str(HERE / "tools.py"), str(tmp_path), json.dumps(jobs)],
        capture_output=True, text=True, timeout=120, cwd=tmp_path, check=False,
    )  # fmt: skip
    assert r.returncode == 0, r.stderr[-3000:]
    dump = (tmp_path / "dump.txt").read_text()
    assert dump.count("GPS_RAW_INT {") > 5 and "GUID_BOOM_MAKE" in dump
    track = (landed / "tlm.tlog.gpx").read_text()
    assert track.count("<trkpt") > 5 and "2023-11-14" in track
    assert (tmp_path / "truth.txt").read_text().count("TRUTH {") > 100
    assert min((tmp_path / name).stat().st_size for name in ("a.png", "t.png")) > 5000
