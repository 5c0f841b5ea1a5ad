"""Time stamps: one bad one costs its own message only, whatever it says; the plant's time may start again."""

from __future__ import annotations

import dataclasses
import struct

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.icd import wire
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.icd.stamps import AGREE, AHEAD_US, JUMP_US, LIMIT_US, STALE_US, Frames, Samples, boot_ms, from_boot_ms
from flightsw.missions.base import Report
from flightsw.process.config import AppConfig, FlightConfig, LinkConfig
from flightsw.process.node import Node
from flightsw.terms import Laws
from flightsw.types import (
    UPD_AIR,
    UPD_ATT,
    UPD_BOOM,
    UPD_FIX,
    UPD_GNSS,
    UPD_IMU,
    UPD_RADAR,
    UPD_REL,
    UPD_TACAN,
    ActuatorCmd,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Snapshot,
    Timing,
    Vec3,
)

PERIOD = 10_000  # [us]
ALL = UPD_IMU | UPD_ATT | UPD_GNSS | UPD_AIR | UPD_REL | UPD_BOOM | UPD_TACAN | UPD_RADAR
FIELDS = {  # message -> field of SensorFrame with its stamp
    "HIL_SENSOR": "t_us",
    "HIL_GPS": "gnss_t_us",
    "ATTITUDE_QUATERNION": "att_t_us",
    "AIR_DATA": "air_t_us",
    "REL_NAV": "rel_t_us",
    "BOOM_STATE": "boom_t_us",
    "TACAN": "tacan_t_us",
    "CREW_RADAR": "radar_t_us",
    "FOLLOW_TARGET": "peer",
    "WIND_COV": "wind",
    "RAW_FIX": "fix",
}
LINK = ("FOLLOW_TARGET", "WIND_COV", "RAW_FIX")  # of the other aircraft


class App:
    """Keeps what it was given."""

    commands: frozenset[int] = frozenset()
    reports: tuple[Report, ...] = ()
    sends_relative = True
    laws: Laws = ()
    phases = ()
    fuel_capacity_kg = 0.0
    records = ()

    def __init__(self) -> None:
        self.seen: list[SensorFrame] = []

    def route(self) -> tuple[Vec3, ...]:
        return ()

    def tick(self, frame: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        assert dt_s >= 0.0
        self.seen.append(
            dataclasses.replace(frame, peer=dataclasses.replace(frame.peer), fix=dataclasses.replace(frame.fix))
        )
        nav = NavState(t_us=frame.t_us, valid=True, V=195.0, reason="")
        cmd = ActuatorCmd(frame.t_us)
        snap = Snapshot(frame.t_us, 0, frame, nav, GuidanceCmd(), cmd, Health(), Timing())
        return cmd, snap


class Flight:
    """A node and a plant that sends every group with every tick."""

    def __init__(self, realtime: bool = False, start_us: int = 0) -> None:
        self.app = App()
        cfg = FlightConfig(
            AppConfig("receiver", "receiver", "learjet24", 2), link=LinkConfig(peer_sysid=1, broadcast_peer=True)
        )
        self.node = Node(cfg, self.app, realtime=realtime)
        self.plant = PlantCodec(load_aircraft("learjet24"), 2)
        self.peer = wire.Sender(1, 1)
        self.start_us = start_us

    def at(self, k: int, bad: str = "", stamp: int = 0) -> bytes:
        """Datagram of tick k; message `bad` carries `stamp` [us] (as its own type holds it) instead of its own."""
        t = self.start_us + k * PERIOD
        f = SensorFrame(
            t_us=t, updated=ALL, gyro_b=(0.0, 1e-3 * (k % 7), 0.0), acc_b=(0.0, 0.0, -9.81), gnss_t_us=t, air_t_us=t,
            air_mask=1, air_V=(195.0,), air_alpha=(0.0,), air_beta=(0.0,), att_t_us=t, rel_t_us=t, rel_valid=True,
            boom_t_us=t, tacan_t_us=t, tacan_range_m=1e4, radar_t_us=t, radar_sigma_m=1.0,
        )  # fmt: skip
        if bad in FIELDS and bad not in LINK:
            setattr(f, FIELDS[bad], stamp)
        ms = stamp // 1000 if bad == "FOLLOW_TARGET" else t // 1000
        peer = self.peer.named("FOLLOW_TARGET", timestamp=ms, attitude_q=(1.0, 0.0, 0.0, 0.0), est_capabilities=15)
        peer += self.peer.named("WIND_COV", time_usec=stamp if bad == "WIND_COV" else t, wind_x=float(k))
        peer += self.peer.named("RAW_FIX", time_usec=stamp if bad == "RAW_FIX" else t, vel=(float(k), 0.0, 0.0))
        return self.plant.sensors(f, [peer])

    def fly(self, datagram: bytes) -> bytes:
        """One call, as the loop makes it; what comes of it is sound."""
        out = self.node.handle([datagram], 0.01 if self.node.realtime else None)
        for d in (out.reply, *out.telemetry):
            wire.frames(d)
        assert self.node.telemetry.failed == 0
        return out.reply

    def echo(self, reply: bytes) -> int:
        [p] = wire.split(reply, wire.table(["HIL_ACTUATOR_CONTROLS"]), wire.Counters())
        return int(p[1][0])


EDGES = [0, 1, AHEAD_US, JUMP_US, JUMP_US + 1, 2**31, 2**32, 2**32 * 1000, LIMIT_US, 2**63, 2**64 - 1]
STAMPS = st.one_of(
    st.sampled_from(EDGES),
    st.integers(0, 2**64 - 1),
    st.integers(0, 10**7),
    st.integers(-3, 3).map(lambda n: 200_000 + n * PERIOD),
    st.integers(-(10**5), 10**5).map(lambda n: 200_000 + n),
)


@pytest.mark.parametrize("realtime", [False, True])
@settings(deadline=None, max_examples=100)
@given(st.sampled_from(sorted(FIELDS)), STAMPS)
def test_a_single_bad_stamp_leaves_the_next_sample_of_its_kind_usable(realtime: bool, bad: str, stamp: int) -> None:
    assume((bad, stamp) != ("HIL_SENSOR", 21 * PERIOD))  # a frame stamped as the next one counts as that one
    f = Flight(realtime)
    for k in range(20):
        f.fly(f.at(k))
    f.fly(f.at(20, bad, stamp))
    reply = f.fly(f.at(21))
    assert f.echo(reply) == 21 * PERIOD  # answered, and the answer is the one the plant waits for
    got = f.app.seen[-1]
    assert got.gyro_b == pytest.approx((0.0, 0.0, 0.0))  # 21 % 7: the inertial sample is that of tick 21
    for name, field in FIELDS.items():
        if name != "HIL_SENSOR" and name not in LINK:
            assert getattr(got, field) == 21 * PERIOD, name
    assert got.updated & ALL == ALL
    assert (got.peer.t_us, got.peer.wind_n[0], got.peer.wind_valid) == (21 * PERIOD, 21.0, True)
    assert (got.fix.t_us, got.fix.vel_n[0]) == (21 * PERIOD, 21.0) and got.updated & UPD_FIX
    times = [s.t_us for s in f.app.seen]
    assert times == sorted(times) and times[-1] <= 21 * PERIOD + JUMP_US
    for k in range(22, 40):  # and time is the plant's again
        f.fly(f.at(k))
    assert f.app.seen[-1].t_us == 39 * PERIOD


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(sorted(set(FIELDS) - {"HIL_SENSOR"})), STAMPS)
def test_a_bad_first_stamp_of_a_sensor_is_no_worse(bad: str, stamp: int) -> None:
    f = Flight()
    f.fly(f.at(0, bad, stamp))
    f.fly(f.at(1))
    got = f.app.seen[-1]
    assert got.updated & ALL == ALL and got.peer.t_us == PERIOD and got.t_us == PERIOD


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.sampled_from(sorted(FIELDS)), STAMPS), max_size=12))
def test_no_sequence_of_stamps_raises_and_onboard_time_never_runs_back(bad: list[tuple[str, int]]) -> None:
    f = Flight()
    f.fly(f.at(0))
    for k, (name, stamp) in enumerate(bad, 1):
        f.fly(f.at(k, name, stamp))
    for k in range(len(bad) + 1, len(bad) + 30):  # whatever it was, it is over
        f.fly(f.at(k))
    times = [s.t_us for s in f.app.seen]
    assert times == sorted(times)
    assert f.echo(f.fly(f.at(len(bad) + 30))) == (len(bad) + 30) * PERIOD
    assert f.app.seen[-1].updated & ALL == ALL


def test_refused_stamps_are_counted_on_the_wire_and_told_once_a_second() -> None:
    f = Flight()
    f.fly(f.at(0))
    for k in range(1, 6):
        f.fly(f.at(k, "AIR_DATA", 2**63))
    f.fly(f.at(6, "HIL_GPS", 6 * PERIOD + AHEAD_US + 1))
    f.fly(f.at(7, "REL_NAV", 6 * PERIOD))  # not newer than its last one
    assert (f.node.count.ahead, f.node.count.out_of_order, f.node.count.untimely) == (6, 1, 7)
    said, rejected = [], 0
    for k in range(8, 210):
        for d in f.node.handle([f.at(k)]).telemetry:
            for spec, v, *_ in wire.split(d, wire.SPECS, wire.Counters()):
                row = spec.to_dict(v)
                if spec.name == "STATUSTEXT":
                    said.append(row["text"])
                if spec.name == "HEALTH_STATUS":
                    rejected = row["rejected"]
    assert said == ["6 packets refused for their time stamp"] and rejected == 7


# --- frames ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("realtime", [False, True])
@pytest.mark.parametrize("gap_s", [0.5, 3.0, 7200.0])
def test_a_gap_is_believed_once_frames_agree(realtime: bool, gap_s: float) -> None:
    """Datagrams lost for a while: the same clock goes on far ahead."""
    f = Flight(realtime)
    for k in range(20):
        f.fly(f.at(k))
    jump = round(gap_s * 100)
    for k in range(20 + jump, 20 + jump + AGREE):
        f.fly(f.at(k))
    assert f.app.seen[-1].t_us == (19 + jump + AGREE) * PERIOD and f.node.frames.offset == 0
    assert f.app.seen[-1].updated & ALL == ALL
    assert f.node.count.ahead == AGREE


@pytest.mark.parametrize("realtime", [False, True])
def test_a_restarted_plant_is_believed_and_onboard_time_goes_on(realtime: bool) -> None:
    f = Flight(realtime)
    for k in range(500, 520):
        f.fly(f.at(k))
    before = f.app.seen[-1].t_us
    for k in range(AGREE + 10):
        reply = f.fly(f.at(k))
    got = f.app.seen[-1]
    assert f.echo(reply) == (AGREE + 9) * PERIOD  # the plant's time
    assert got.t_us > before and got.updated & ALL == ALL
    # every stamp in onboard time, the data link's too; and sent in the plant's
    assert got.air_t_us == got.att_t_us == got.peer.t_us == got.t_us and got.peer.wind_valid
    sent = wire.split(f.node.codec.peer(NavState(t_us=got.t_us, valid=True)), wire.SPECS, wire.Counters())
    assert [p[0].to_dict(p[1])[n] for p, n in zip(sent, ("timestamp", "time_usec"), strict=True)] == [
        (AGREE + 9) * PERIOD // 1000,
        (AGREE + 9) * PERIOD,
    ]


def test_a_bad_first_frame_does_not_end_the_run() -> None:
    """A stranger's frame an hour ahead comes before the plant's tick 0, which the plant repeats until it is answered."""
    f = Flight()
    f.fly(f.at(360_000))
    replies = [f.fly(f.at(0)) for _ in range(AGREE)]
    assert replies[:-1] == [b""] * (AGREE - 1) and f.echo(replies[-1]) == 0
    for k in range(1, 5):
        assert f.echo(f.fly(f.at(k))) == k * PERIOD
    assert f.app.seen[-1].updated & ALL == ALL


def test_a_strangers_frame_in_lockstep_does_not_lock_the_plant_out() -> None:
    f = Flight()
    for k in range(20):
        f.fly(f.at(k))
    f.fly(f.at(26))
    for k in range(20, 40):
        assert f.echo(f.fly(f.at(k))) == k * PERIOD
    assert [s.t_us // PERIOD for s in f.app.seen[20:]] == [26] * 7 + list(range(26, 40))


def test_realtime_without_frames_time_goes_on_for_a_while_only() -> None:
    """Ages grow until everything is called lost; a plant that was held up then finds the aircraft no further on than that."""
    f = Flight(realtime=True)
    for k in range(20):
        f.fly(f.at(k))
    for _ in range(500):
        f.node.handle([], 0.01)
    assert f.node.t_us == 19 * PERIOD + 600_000
    for k in range(20, 81):
        f.fly(f.at(k))
    assert f.app.seen[-1].t_us == 80 * PERIOD


@settings(deadline=None, max_examples=200)
@given(st.lists(st.one_of(st.integers(0, 2**64 - 1), st.integers(0, 2 * 10**6)), max_size=60))
def test_frames_whatever_comes(stamps: list[int]) -> None:
    frames, now = Frames(wire.Counters()), -1
    for t in stamps:
        if t != frames.raw and frames.take(t, now):
            assert frames.raw == t < LIMIT_US
            now = max(now, t + frames.offset)
        assert now < 2 * LIMIT_US


def test_samples_of_one_kind_do_not_touch_another() -> None:
    s = Samples(wire.Counters())
    assert s.take(1, 100, 100) and s.take(2, 50, 100)
    assert not s.take(1, 100, 200) and not s.take(1, 60, 200) and s.take(2, 60, 200)
    assert s.take(1, 200 + AHEAD_US, 200) and not s.take(1, 200, 210) and s.take(1, 210, 210)
    assert not s.take(3, 200 + AHEAD_US + 1, 200)
    assert s.take(3, 10**8 - STALE_US, 10**8) and not s.take(4, 10**8 - STALE_US - 1, 10**8)
    assert dataclasses.asdict(s.count) | {"ahead": 1, "stale": 1, "out_of_order": 3} == dataclasses.asdict(s.count)


# --- after 49.7 days --------------------------------------------------------------------------------------------------


@given(st.integers(0, LIMIT_US - 1), st.integers(-20 * 86400 * 1000, 20 * 86400 * 1000))
def test_boot_time_is_read_back_across_its_end(t_us: int, apart_ms: int) -> None:
    then = t_us // 1000 * 1000 + apart_ms * 1000
    assert from_boot_ms(boot_ms(then), t_us) == then


def test_a_flight_goes_on_across_the_end_of_boot_time() -> None:
    f = Flight(start_us=2**32 * 1000 - 50 * PERIOD)
    for k in range(200):
        f.fly(f.at(k))
    assert f.node.count == wire.Counters() and f.app.seen[-1].att_t_us == f.start_us + 199 * PERIOD
    packet = f.node.telemetry.time(2**32 * 1000 + 5_000)
    assert wire.SPECS[2].to_dict(wire.split(packet, wire.SPECS, wire.Counters())[0][1])["time_boot_ms"] == 5
    with pytest.raises(struct.error):  # what it was before
        wire.Sender(1, 1).named("SYSTEM_TIME", time_boot_ms=2**32 + 5)


def test_the_real_application_survives_a_peer_stamped_ahead() -> None:
    """FOLLOW_TARGET a second ahead used to lock out the tanker's next second; here the next one is taken."""
    f = Flight()
    codec = FlightCodec(load_aircraft("learjet24"), 2, peer_sysid=1)
    got = SensorFrame()
    for k in (0, 1, 2):
        codec.decode(f.at(k, "FOLLOW_TARGET" if k == 1 else "", (k + 100) * PERIOD), got)
    assert got.peer.t_us == 2 * PERIOD and codec.count.ahead == 1
