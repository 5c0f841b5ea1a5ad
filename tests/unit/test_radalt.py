"""Radio altimeter of the jet transport: errors by grade, range, wire, refusals, failures, and what the ground is shown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from flightsw.health import HealthMonitor, HealthParams
from flightsw.icd.codec import FlightCodec
from flightsw.icd.codec_plant import PlantCodec
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.strict import ConfigError
from flightsw.types import UPD_RADALT, SensorFrame
from ground.link.packets import IDS, decode, packet_id, split
from hil_scripts.studies.integrity.snapshot import Flying
from sim_plant.failures import numbers as inject
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.world import World

ME = "sensors.twinjet.radalt"


def fly(over: dict[str, Any], seconds: float = 4.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [us], readings and true heights of their time [m] of the radio altimeter in trimmed flight."""
    w = World(load_scenario("windshear_paper", over), 1)
    cmds = [w.trim_cmd(0)]
    true, got = {}, []
    for _ in range(round(seconds * w.rate_hz)):
        f = w.sense()[0]
        true[w.t_us] = -w.members[0].view.s[n.S_P + 2]
        if f.updated & UPD_RADALT:
            got.append((f.radalt_t_us, f.radalt_m, w.t_us - f.radalt_t_us))
        w.step(cmds)
    t = np.array([g[0] for g in got])
    assert {g[2] for g in got} <= {60_000}  # latency of 50 ms, in ticks of 20
    return t, np.array([g[1] for g in got]), np.array([true[x] for x in t])


def test_paper_has_none_and_its_keys_are_refused_there() -> None:
    assert len(fly({}, 0.2)[0]) == 0
    assert len(fly({"sensors.twinjet.grade": "tactical", f"{ME}.grade": "paper"}, 0.2)[0]) == 0
    for key in ("rate_hz", "range_max_m", "latency_ms"):
        with pytest.raises(ConfigError, match=rf"radalt.{key} = 10.0: nothing obeys it on an aircraft that carries"):
            load_scenario("windshear_paper", {f"{ME}.{key}": 10.0})
    with pytest.raises(ConfigError, match="on an aircraft that carries"):
        load_scenario("refueling", {"sensors.receiver.radalt.grade": "mems"})


def test_errors_are_those_of_the_table() -> None:
    """White alone over 100 samples (chi-square, 99.9 %); the constant within 4 sigma; scale and Gauss-Markov switched off."""
    off = {"scale": 0.0, "gm": 0.0}
    _, got, true = fly({f"{ME}.grade": "tactical", f"{ME}.terms.height": off})
    d = got - true
    assert len(d) == 97 or len(d) == 98 or len(d) == 99
    assert 0.3 * 0.77 < np.std(d) < 0.3 * 1.25 and 1e-3 < abs(np.mean(d)) < 1.2
    scaled = fly({f"{ME}.grade": "tactical", f"{ME}.terms.height": {**off, "scale": 0.5}})
    factor = (scaled[1] - got) / true
    assert np.ptp(factor) < 1e-9 and abs(factor[0]) > 0.01


def test_beyond_its_range_it_is_silent() -> None:
    over = {f"{ME}.grade": "tactical"}
    t, _, true = fly(over | {f"{ME}.range_max_m": 345.0})
    assert 0 < len(t) < 90 and true.max() <= 345.0
    assert len(fly(over | {f"{ME}.range_max_m": 100.0}, 0.5)[0]) == 0


def test_the_message_is_the_standard_s() -> None:
    """pymavlink reads what the plant sends; what comes back on board is whole centimetres."""
    sc = load_scenario("windshear")
    codec = PlantCodec(sc.load_aircraft()[0], 5)
    data = codec.sensors(SensorFrame(t_us=80_000, updated=UPD_RADALT, radalt_t_us=20_000, radalt_m=123.456))
    [first, *_] = common.MAVLink(None).parse_buffer(data) or []
    assert (first.get_type(), first.current_distance, first.time_boot_ms) == ("DISTANCE_SENSOR", 12346, 20)
    assert first.type == common.MAV_DISTANCE_SENSOR_RADAR and first.orientation == common.MAV_SENSOR_ROTATION_PITCH_270
    board, f = FlightCodec(sc.load_aircraft()[0], 5), SensorFrame()
    board.decode(data, f)
    assert f.updated & UPD_RADALT and (f.radalt_t_us, f.radalt_m) == (20_000, pytest.approx(123.46))


def test_a_height_beyond_what_the_message_can_say_is_refused_not_read_as_its_most() -> None:
    """700 m: beyond the most in the standard's words, no 655 m on board; at 655 m it is one."""
    sc, sent = load_scenario("windshear"), []
    for k, h in enumerate((655.0, 700.0)):
        at = 20_000 * (k + 1)
        data = PlantCodec(sc.load_aircraft()[0], 5).sensors(
            SensorFrame(t_us=at, updated=UPD_RADALT, radalt_t_us=at, radalt_m=h)
        )
        [first, *_] = common.MAVLink(None).parse_buffer(data) or []
        board, f = FlightCodec(sc.load_aircraft()[0], 5), SensorFrame()
        board.decode(data, f)
        kept, health = HealthMonitor(HealthParams(), 0).step(f)
        sent.append((first.current_distance > first.max_distance, bool(kept.updated & UPD_RADALT), health.radalt_bad))
    assert sent == [(False, True, False), (True, False, True)]


@pytest.mark.parametrize("change", [{"orientation": 0}, {"type": 0}])
def test_another_sensor_s_distance_is_no_height(change: dict[str, int]) -> None:
    fields: dict[str, Any] = {"max_distance": 65500, "current_distance": 100, "type": 3, "orientation": 25} | change
    board, f = FlightCodec(load_scenario("windshear").load_aircraft()[0], 5), SensorFrame()
    board.decode(Sender(5, 1).named("DISTANCE_SENSOR", time_boot_ms=20, **fields), f)
    assert not f.updated & UPD_RADALT and board.count.unknown == 1
    assert BY_NAME["DISTANCE_SENSOR"].id == common.MAVLINK_MSG_ID_DISTANCE_SENSOR


def test_out_of_range_and_stuck_are_refused_and_said_once() -> None:
    h = HealthMonitor(HealthParams(), 0)
    seen = []
    for k in range(60):
        height = 700.0 + 100.0 * (k < 5) if k < 10 else 300.0 if k < 40 else 300.0 + 0.1 * k
        f, _ = h.step(
            SensorFrame(t_us=20_000 * (k + 1), updated=UPD_RADALT, radalt_m=height + 0.01 * (k % 3) * (k < 10))
        )
        seen.append(bool(f.updated & UPD_RADALT))
    assert not any(seen[:5]) and all(seen[5:19]) and not any(seen[20:40]) and all(seen[40:])
    words = [t.text for t in h.texts]
    assert words == ["radio altimeter refused", "radio altimeter back"] * 2 and h.out.rejected >= 25


@pytest.mark.parametrize(("kind", "value"), [(inject.WRONG, 7.0), (inject.OFF, 0.0), (inject.SCALE, 1.5)])
def test_it_fails_as_the_others_do_and_the_ground_sees_what_is_read(kind: int, value: float) -> None:
    """Ten heights a second to the ground, right within the grade before the failure, as the failure says after it."""
    event = {
        "t_s": 1.5,
        "target": "plant.twinjet",
        "kind": "command",
        "command": 420,
        "params": [67, kind, 0, 0, value],
    }
    f = Flying("windshear", 1, (f"plant.{ME}.grade=tactical", f"plant.event=[{_toml(event)}]"))
    rows = []
    while f.t_s < 3.0:
        _, [telemetry] = f.tick()
        true = -f.server.world.members[0].view.s[n.S_P + 2]
        for packet, _ in (p for d in telemetry for p in split(d)):
            if packet_id(packet) == IDS["DISTANCE_SENSOR"]:
                rows.append((f.t_s, 0.01 * decode(packet)["current_distance"], true))
    t, got, height = np.array(rows).T
    before, after = t < 1.5, t > 1.9
    assert 12 <= before.sum() <= 15 and np.abs(got - height)[before].max() < 15.0
    if kind == inject.OFF:
        assert t.max() < 2.2
    else:
        jump = np.mean((got - height)[after]) - np.mean((got - height)[before])
        assert jump == pytest.approx(
            value if kind == inject.WRONG else 0.5 * np.mean(height[after]), abs=15.0 if value == 1.5 else 0.6
        )


def _toml(event: dict[str, Any]) -> str:
    return "{" + ", ".join(f"{k} = {v!r}".replace("'", '"') for k, v in event.items()) + "}"
