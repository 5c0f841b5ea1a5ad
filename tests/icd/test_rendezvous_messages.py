"""TACAN, radar reading and rendezvous telemetry through the wire."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.icd import wire
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.icd.wire import Counters, Sender
from flightsw.missions.rendezvous.reports import CLOUD_PART, CLOUD_PARTS, REPORTS, RendezvousState
from flightsw.types import (
    UPD_BEARING,
    UPD_IMU,
    UPD_POSITION,
    UPD_RADAR,
    UPD_TACAN,
    NavState,
    SensorFrame,
)
from ground.link.packets import decode, split

TANKER = load_aircraft("kc135r")


def sent(t_us: int, **fields: object) -> bytes:
    f = SensorFrame(t_us=t_us, updated=UPD_IMU | UPD_TACAN, acc_b=(0.0, 0.0, -9.8), tacan_t_us=t_us - 20_000, **fields)
    return PlantCodec(TANKER, 1).sensors(f)


def heard(*datagrams: bytes) -> tuple[FlightCodec, SensorFrame]:
    codec, f = FlightCodec(TANKER, 1), SensorFrame()
    for d in datagrams:
        codec.decode(d, f)
    return codec, f


@pytest.mark.parametrize(("distance", "bearing"), [(55_560.25, None), (55_560.25, -1.25), (None, None), (0.0, 0.0)])
def test_reply_comes_through_with_what_it_carries(distance: float | None, bearing: float | None) -> None:
    _, f = heard(sent(50_000, tacan_range_m=distance, tacan_bearing=bearing))
    assert f.updated & UPD_TACAN and f.tacan_t_us == 30_000
    assert f.tacan_range_m == distance and f.tacan_bearing == bearing


def test_position_sent_with_a_reply_comes_through() -> None:
    _, f = heard(sent(50_000, tacan_range_m=4e4, tacan_link=(1250.5, -48_000.25)))
    assert f.tacan_link == (1250.5, -48_000.25)
    _, f = heard(sent(50_000, tacan_range_m=4e4))
    assert f.tacan_link is None
    codec, f = heard(sent(50_000, tacan_range_m=4e4, tacan_link=(math.nan, 0.0)))
    assert not f.updated & UPD_TACAN and codec.count.non_finite == 1


def alone(t_us: int, bits: int, **fields: object) -> bytes:
    return PlantCodec(TANKER, 1).sensors(
        SensorFrame(t_us=t_us, updated=UPD_IMU | bits, acc_b=(0.0, 0.0, -9.8), **fields)
    )


def test_bearing_and_position_by_themselves_leave_the_last_reply_as_it_is() -> None:
    codec, f = heard(sent(50_000, tacan_range_m=4e4, tacan_bearing=0.5, tacan_link=(1.0, 2.0)))
    both = UPD_BEARING | UPD_POSITION
    codec.decode(
        alone(60_000, both, bearing_t_us=60_000, bearing=-0.25, position_t_us=10_000, position=(1250.5, -4.0)), f
    )
    assert f.updated == UPD_IMU | both
    assert (f.bearing_t_us, f.bearing, f.position_t_us, f.position) == (60_000, -0.25, 10_000, (1250.5, -4.0))
    assert (f.tacan_t_us, f.tacan_range_m, f.tacan_bearing, f.tacan_link) == (30_000, 4e4, 0.5, (1.0, 2.0))
    assert codec.count == Counters()  # older than the bearing, in an order of its own


def test_positions_out_of_order_and_rubbish_by_itself_are_dropped_and_counted() -> None:
    codec, f = heard(
        alone(60_000, UPD_POSITION, position_t_us=40_000, position=(1.0, 1.0)),
        alone(70_000, UPD_POSITION, position_t_us=30_000, position=(2.0, 2.0)),
    )
    assert not f.updated & UPD_POSITION and f.position == (1.0, 1.0) and codec.count.out_of_order == 1
    codec.decode(alone(80_000, UPD_POSITION, position_t_us=80_000, position=(math.nan, 2.0)), f)
    codec.decode(alone(90_000, UPD_BEARING, bearing_t_us=90_000, bearing=math.inf), f)
    assert not f.updated & (UPD_POSITION | UPD_BEARING) and codec.count.non_finite == 2
    codec.decode(alone(100_000, UPD_BEARING, bearing_t_us=900_000, bearing=0.1), f)
    assert not f.updated & UPD_BEARING and codec.count.ahead == 1


def test_reading_of_the_radar_comes_through() -> None:
    f = SensorFrame(t_us=10_000, updated=UPD_RADAR, radar_t_us=10_000, radar_y_m=-1234.5, radar_sigma_m=1852.0)
    _, got = heard(PlantCodec(TANKER, 1).sensors(f))
    assert got.updated == UPD_RADAR and (got.radar_t_us, got.radar_y_m, got.radar_sigma_m) == (10_000, -1234.5, 1852.0)


def test_rubbish_and_old_replies_are_dropped_and_counted() -> None:
    good, late = sent(50_000, tacan_range_m=4e4), sent(40_000, tacan_range_m=5e4)
    codec, f = heard(good, late)
    assert f.tacan_range_m == 4e4 and not f.updated & UPD_TACAN and codec.count.out_of_order == 1
    for v in (math.nan, math.inf, -5.0):
        codec, f = heard(sent(50_000, tacan_range_m=v))
        assert not f.updated & UPD_TACAN and codec.count.non_finite == 1
    bad = SensorFrame(t_us=10_000, updated=UPD_RADAR, radar_t_us=10_000, radar_sigma_m=0.0)
    codec, f = heard(PlantCodec(TANKER, 1).sensors(bad))
    assert not f.updated & UPD_RADAR and codec.count.non_finite == 1


def state(n: int) -> RendezvousState:
    w = np.arange(1.0, n + 1.0)
    w /= w.sum()
    return RendezvousState(
        t_us=2_000_000, valid=True, mean=(3e4, -203.0, 500.0, 0.5), cov=tuple(float(k) for k in range(10)),
        own=(1e3, -17e3, 0.1), bank=0.2, bank_cmd=0.25, speed_cmd=204.0, time_to_go_s=33.0, turn_time_s=140.0,
        miss=(10.0, -20.0), radii=(8e3, 7e3), final_psi=math.pi, estimator=4, law=3, phase=1, range_m=4e4,
        range_age_s=2.5, nis=1.5, alarm=True, updates=7, refused=1, frame=(1.0, 2.0, 0.5), fix_us=1_500_000,
        weights=tuple(w.tolist()), xs=tuple(float(i) for i in range(n)), ys=tuple(-float(i) for i in range(n)),
    )  # fmt: skip


def sent_as(name: str, r: object) -> bytes:
    """Packets of a record by the report of a message."""
    own = next(x for x in REPORTS if x.message == name)
    send = Sender(1, 1)
    return b"".join(send.pack(wire.BY_NAME[name], *row) for row in own.packets(r))


def test_state_carries_estimate_and_plan() -> None:
    r = state(3)
    [(packet, fault)] = list(split(sent_as("RENDEZVOUS_STATE", r)))
    d = decode(packet)
    assert fault == "" and d["est"] == pytest.approx(r.mean) and d["cov"] == pytest.approx(r.cov)
    assert (
        d["own"] == pytest.approx(r.own)
        and d["miss"] == pytest.approx(r.miss)
        and d["radius"] == pytest.approx(r.radii)
    )
    assert (d["estimator"], d["law"], d["phase"], d["alarm"], d["valid"], d["limited"]) == (4, 3, 1, 1, 1, 0)
    assert (d["updates"], d["refused"], d["time_to_go"]) == (7, 1, 33.0)


@pytest.mark.parametrize("n", [1, 15, 16, 17, 57, 64, 101])
def test_cloud_is_cut_into_parts_and_keeps_the_heaviest(n: int) -> None:
    packets = list(split(sent_as("RENDEZVOUS_CLOUD", state(n))))
    kept = min(n, CLOUD_PART * CLOUD_PARTS)
    parts = [decode(p) for p, fault in packets if fault == ""]
    assert len(parts) == len(packets) == -(-kept // CLOUD_PART) and [p["part"] for p in parts] == list(
        range(len(parts))
    )
    assert all(p["parts"] == len(parts) and p["time_usec"] == 1_500_000 for p in parts)
    xs = [x for p in parts for x in p["x"][: p["count"]]]
    assert xs == [float(i) for i in range(n - kept, n)]  # weights grow with the index
    assert [x for p in parts for x in p["y"][: p["count"]]] == [-x for x in xs]
    if n <= kept:
        assert sum(x for p in parts for x in p["weight"]) == pytest.approx(1.0, abs=1e-6)


def test_nothing_is_sent_of_what_is_not_there() -> None:
    for name in ("RENDEZVOUS_STATE", "RENDEZVOUS_CLOUD"):
        assert sent_as(name, None) == sent_as(name, NavState()) == b""
    assert sent_as("RENDEZVOUS_STATE", state(0)) and not sent_as("RENDEZVOUS_CLOUD", state(0))


def test_ids_of_the_messages_are_fixed() -> None:
    want = {"TACAN": 53003, "CREW_RADAR": 53004, "RENDEZVOUS_STATE": 53019, "RENDEZVOUS_CLOUD": 53021}
    assert {n: wire.BY_NAME[n].id for n in want} == want
