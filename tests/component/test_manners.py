"""What stock clients ask besides commands and parameters: each request has the protocol's own answer."""

from __future__ import annotations

import math

import pytest

from flightsw.icd import wire
from flightsw.icd.dialect import VALUES
from flightsw.icd.geo import Origin, to_geodetic
from flightsw.process.plans import ACK, NAK, NOT_FOUND
from flightsw.types import UPD_BARO, UPD_GNSS, UPD_MAG

from .flight_fakes import fields, names
from .test_services import GCS, Bench

PLACES = ((1000.0, -2000.0, -7010.0), (3000.0, 500.0, -7010.0))
TO = {"target_system": 2, "target_component": 1}


def bench() -> Bench:
    b = Bench()
    b.app.places = PLACES
    return b


def test_the_route_is_downloaded_item_by_item() -> None:
    b = bench()
    [count] = fields(b.tick(GCS.named("MISSION_REQUEST_LIST", **TO)), "MISSION_COUNT")
    assert (count["count"], count["mission_type"], count["target_system"]) == (2, 0, 255)
    b.app.places = ()  # what is under way stays as it was listed
    for ask in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
        for k, place in enumerate(PLACES):
            [item] = fields(b.tick(GCS.named(ask, seq=k, **TO)), "MISSION_ITEM_INT")
            lat, lon, alt = to_geodetic(place, Origin())
            assert (item["x"] * 1e-7, item["y"] * 1e-7) == pytest.approx((lat, lon), abs=1e-7)
            assert item["z"] == pytest.approx(alt) and item["seq"] == k
            assert (item["frame"], item["command"]) == (6, 16)
    [ack] = fields(b.tick(GCS.named("MISSION_REQUEST_INT", seq=2, **TO)), "MISSION_ACK")
    assert ack["type"] == VALUES["MAV_MISSION_INVALID_SEQUENCE"]
    assert not fields(b.tick(GCS.named("MISSION_ACK", **TO)), "MISSION_ACK")  # the end of a download is not answered


@pytest.mark.parametrize("plan", [1, 2])
def test_fence_and_rally_points_are_none(plan: int) -> None:
    b = bench()
    [count] = fields(b.tick(GCS.named("MISSION_REQUEST_LIST", mission_type=plan, **TO)), "MISSION_COUNT")
    assert (count["count"], count["mission_type"]) == (0, plan)


@pytest.mark.parametrize(
    "name", ["MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT", "MISSION_WRITE_PARTIAL_LIST"]
)
def test_an_upload_is_refused(name: str) -> None:
    [ack] = fields(bench().tick(GCS.named(name, **TO)), "MISSION_ACK")
    assert ack["type"] == VALUES["MAV_MISSION_UNSUPPORTED"] and ack["target_system"] == 255


def test_ping_mode_logs_and_files_have_their_answers() -> None:
    b = bench()
    [ping] = fields(b.tick(GCS.named("PING", time_usec=7, seq=3)), "PING")
    assert ping == {"time_usec": 7, "seq": 3, "target_system": 255, "target_component": 190}
    assert not fields(b.tick(GCS.named("PING", time_usec=7, seq=3, target_system=255, target_component=1)), "PING")
    [ack] = fields(b.tick(GCS.named("SET_MODE", target_system=2, custom_mode=1003)), "COMMAND_ACK")
    assert (ack["command"], ack["result"]) == (176, 3)
    [entry] = fields(b.tick(GCS.named("LOG_REQUEST_LIST", end=0xFFFF, **TO)), "LOG_ENTRY")
    assert entry["num_logs"] == 0
    [data] = fields(b.tick(GCS.named("LOG_REQUEST_DATA", id=4, ofs=90, count=90, **TO)), "LOG_DATA")
    assert (data["id"], data["ofs"], data["count"]) == (4, 90, 0)


def test_file_transfer_is_refused_in_its_own_words() -> None:
    b = bench()
    for op, answer, error in ((4, NAK, NOT_FOUND), (3, NAK, NOT_FOUND), (2, ACK, 0), (8, NAK, 9), (99, NAK, 7)):
        payload = bytearray(251)
        payload[0:2], payload[3] = (41).to_bytes(2, "little"), op
        out = b.tick(GCS.named("FILE_TRANSFER_PROTOCOL", payload=list(payload), **TO))
        [got] = [bytes(f["payload"]) for f in fields(out, "FILE_TRANSFER_PROTOCOL")]
        assert int.from_bytes(got[:2], "little") == 42 and (got[3], got[5]) == (answer, op)
        assert got[4] == (1 if error else 0) and got[12] == error


def test_a_data_stream_asked_for_raises_stock_rates_and_lowers_none() -> None:
    b = bench()
    house = names(b.tick(n=100)).count("NAV_STATE")
    b.tick(GCS.named("REQUEST_DATA_STREAM", req_message_rate=10, start_stop=1, req_stream_id=10, **TO))
    assert names(b.tick(n=100)).count("ATTITUDE") == 10
    b.tick(GCS.named("REQUEST_DATA_STREAM", req_message_rate=2, start_stop=1, req_stream_id=0, **TO))
    got = names(b.tick(n=100))
    assert got.count("ATTITUDE") == 4 and got.count("SYS_STATUS") == 2 and got.count("NAV_STATE") == house
    b.tick(GCS.named("REQUEST_DATA_STREAM", start_stop=0, req_stream_id=0, **TO))
    assert names(b.tick(n=100)).count("SYS_STATUS") == 1


def test_modes_have_the_names_of_phases() -> None:
    b = bench()
    all_ = fields(b.tick(GCS.named("COMMAND_LONG", command=512, param1=435.0, **TO)), "AVAILABLE_MODES")
    assert [(m["mode_index"], m["custom_mode"], m["mode_name"]) for m in all_] == [
        (1, 1000, "INIT"),
        (2, 1003, "PRECONTACT"),
    ]
    [one] = fields(b.tick(GCS.named("COMMAND_LONG", command=512, param1=435.0, param2=2.0, **TO)), "AVAILABLE_MODES")
    assert one == all_[1] and one["number_modes"] == 2
    [ack] = fields(b.tick(GCS.named("COMMAND_LONG", command=512, param1=435.0, param2=3.0, **TO)), "COMMAND_ACK")
    assert ack["result"] == 2
    out = b.tick(n=200)
    assert {f["custom_mode"] for n in ("CURRENT_MODE", "HEARTBEAT") for f in fields(out, n)} == {1003}


def test_what_health_and_tracks_are_made_of_goes_down() -> None:
    b = bench()
    before = b.tick(n=100)
    [s] = fields(before, "SYS_STATUS")
    assert not s["onboard_control_sensors_present"] & 0xC  # neither magnetometer nor static pressure so far
    assert fields(before, "GPS_RAW_INT")[0]["fix_type"] == 0
    f = b.node.frame
    for k in range(200):  # readings come, as the decoder would set them
        f.mag_b, f.pressure_pa, f.baro_alt_m, f.gnss_pos_n = (0.2, 0.0, 0.4), 41_000.0, 7010.0, PLACES[0]
        f.gnss_vel_n = (0.0, 195.0, 0.0)
        out = b.tick()
        f.updated |= UPD_MAG | UPD_BARO | UPD_GNSS
        b.node.telemetry.ctx.see(f)
        before += out if k > 100 else b""
    [gps] = fields(before, "GPS_RAW_INT")[-1:]
    lat, lon, alt = to_geodetic(PLACES[0], Origin())
    assert (gps["lat"] * 1e-7, gps["lon"] * 1e-7, gps["alt"] * 1e-3) == pytest.approx((lat, lon, alt), abs=1e-3)
    assert (gps["fix_type"], gps["vel"], gps["cog"]) == (3, 19500, 9000)
    [s] = fields(before, "SYS_STATUS")[-1:]
    assert s["onboard_control_sensors_health"] & 0x1000000C == 0x1000000C
    [imu] = fields(before, "HIGHRES_IMU")[-1:]
    assert imu["abs_pressure"] == pytest.approx(410.0) and imu["fields_updated"] == 0xBFF
    [p] = fields(before, "SCALED_PRESSURE")[-1:]
    assert p["press_abs"] == pytest.approx(410.0) and math.isnan(p["press_diff"])
    [t] = fields(before, "SYSTEM_TIME")[-1:]
    assert t["time_unix_usec"] == 1_700_000_000_000_000 + t["time_boot_ms"] * 1000
    [home] = fields(before, "HOME_POSITION")[-1:]
    assert home["latitude"] == round(Origin().lat_deg * 1e7) and math.isnan(home["q"][0])
    assert {e["landed_state"] for e in fields(before, "EXTENDED_SYS_STATE")} == {2}
    assert "FUEL_STATUS" not in names(before)  # this one has no tanks


def test_a_failure_goes_to_the_plant_and_its_answer_back_to_who_asked() -> None:
    b = bench()
    ask = GCS.named("COMMAND_LONG", command=420, param1=8.0, param2=1.0, confirmation=1, **TO)
    reply = b.node.step([b.plant.at(0)], None, [ask])
    [order] = fields(reply, "COMMAND_LONG")
    assert (order["target_system"], order["target_component"], order["command"], order["param1"]) == (2, 190, 420, 8.0)
    assert not fields(b"".join(b.node.after()), "COMMAND_ACK") and not b.app.commands_seen
    plant = wire.Sender(2, 190)
    text = plant.named("STATUSTEXT", severity=4, text="no such probe", id=5)
    ack = plant.named("COMMAND_ACK", command=420, result=2, result_param2=5, target_system=2, target_component=1)
    assert names(b.node.step([b.plant.at(1, text, ack)])) == ["HIL_ACTUATOR_CONTROLS"]
    down = b"".join(b.node.after())
    [got] = fields(down, "COMMAND_ACK")
    assert (got["command"], got["result"], got["target_system"], got["target_component"]) == (420, 2, 255, 190)
    assert "no such probe" in [t["text"] for t in fields(down, "STATUSTEXT")]


def test_hardware_takes_no_failures_and_strangers_no_command() -> None:
    b = bench()
    b.node.services.simulated = False
    [ack] = b.command(420, 8.0, 1.0)
    assert ack["result"] == 2 and b.node.last_text == "this aircraft flies hardware"
    out = b.tick(wire.Sender(77, 1).named("COMMAND_LONG", command=31010, param1=3.0, **TO))
    [ack] = fields(out, "COMMAND_ACK")
    assert ack["result"] == 2 and b.node.last_text == "system 77 is no operator"
    assert not b.app.commands_seen and b.node.services.strangers == 1


def test_the_interval_in_force_is_told() -> None:
    b = bench()
    for ident, interval in ((30, 250_000), (999, 0), (284, 0)):
        out = b.tick(GCS.named("COMMAND_LONG", command=510, param1=float(ident), **TO))
        assert [f["interval_us"] for f in fields(out, "MESSAGE_INTERVAL")] == [interval]
    b.command(511, 30.0, -1.0)
    [told] = fields(b.tick(GCS.named("COMMAND_LONG", command=510, param1=30.0, **TO)), "MESSAGE_INTERVAL")
    assert told["interval_us"] == -1
    assert "HOME_POSITION" in names(b.tick(GCS.named("COMMAND_LONG", command=410, **TO)))
