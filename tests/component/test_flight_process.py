"""The command `flightsw` over real sockets, with a small application in place of the real one."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from flightsw.icd import tlog
from flightsw.icd.link import UdpLink, plant_port, telemetry_port
from flightsw.icd.signing import PLANT, Security, Signing, read_key, units, write_key
from flightsw.icd.wire import Sender
from flightsw.process.config import load_flight
from flightsw.process.node import Node
from flightsw.process.replay import replay
from tests.forks import Forked

from .flight_fakes import FakeApp, FakePlant, config, fields, fly_fake, names

FLIGHT = """
[app]
name = "receiver"
mission = "receiver"
aircraft = "learjet24"
sysid = 2
[link]
peer_sysid = 1
startup_timeout_s = 20.0
peer_timeout_s = 0.5
[ctrl]
w_pos_m = [0.6, 0.5, 0.4]
[ctrl.schedule]
V_mps = [180.0, 200.0]
"""


class Flight:
    """A running flightsw and the plant's end of its link."""

    def __init__(self, folder: Path, offset: int, *args: str) -> None:
        (folder / "flight.toml").write_text(FLIGHT)
        self.out, self.words = folder / "stdout.txt", folder / "stderr.txt"
        argv = ("--config", folder / "flight.toml", "--run-dir", folder, "--port-offset", offset, *args)
        self.popen = Forked("flightsw.__main__", *argv, out=self.out, err=self.words, call=fly_fake)
        self.plant = FakePlant()
        self.link = UdpLink(0, "plant of the test")
        self.to = ("127.0.0.1", plant_port(2, offset))
        self.ground_to = ("127.0.0.1", telemetry_port(2, offset))
        self.tick = 0

    def start(self) -> bytes:
        """Repeat tick 0 until it is answered; the answer."""
        d = self.plant.at(0)
        for _ in range(100):
            self.link.send(d, self.to)
            got = self.link.recv(0.2)
            if got is not None:
                self.tick = 1
                return got[0]
            assert self.popen.poll() is None, self.err()
        raise AssertionError("flightsw did not answer")

    def fly(self, n: int) -> None:
        """n more ticks in lockstep."""
        for _ in range(n):
            self.link.send(self.plant.at(self.tick), self.to)
            while True:
                got = self.link.recv(5.0)
                assert got is not None, self.err()
                if fields(got[0], "HIL_ACTUATOR_CONTROLS")[0]["time_usec"] == self.tick * 10_000:
                    break
            self.tick += 1

    def wait(self) -> int:
        return self.popen.wait(20)

    def err(self) -> str:
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.wait()
        return self.words.read_text()

    def accounts(self) -> dict[str, float]:
        """Last line of an ended process on stdout."""
        return dict(json.loads(self.out.read_text().splitlines()[-1])["accounts"])

    def close(self) -> None:
        if self.popen.poll() is None:
            self.popen.kill()
            self.popen.wait()
        self.link.close()


@pytest.fixture
def flight(tmp_path: Path, port_offset: int) -> Iterator[Flight]:
    f = Flight(tmp_path, port_offset)
    yield f
    f.close()


def test_lockstep_run_to_the_end_and_replay(flight: Flight, tmp_path: Path) -> None:
    assert names(flight.start()) == ["HIL_ACTUATOR_CONTROLS"]
    flight.fly(100)
    flight.link.send(b"\xfdrubbish" * 50, flight.to)
    flight.fly(100)
    gcs = UdpLink(0, "ground station of the test")
    gcs.send(Sender(255, 190).named("COMMAND_LONG", target_system=2, command=31010, param1=3.0), flight.ground_to)
    acked = False
    for _ in range(50):
        flight.fly(10)
        acked = acked or any("COMMAND_ACK" in names(d) for d, _ in gcs.take())
        if acked:
            break
    gcs.close()
    assert acked  # also to a station that is no configured target
    flight.link.send(flight.plant.codec.shutdown(), flight.to)
    assert flight.wait() == 0
    a = flight.accounts()
    assert a["ticks"] == flight.tick and a["refused_packets"] > 0 and a["slips"] == a["late_max_us"] == 0
    report = replay(tmp_path / "link_receiver.tlog", Node(config(), FakeApp()))
    assert report.ok and report.ticks == flight.tick, report.lines()


def request(message: int, sysid: int = 2) -> bytes:
    """A REQUEST_MESSAGE."""
    return Sender(255, 190).named("COMMAND_LONG", target_system=sysid, command=512, param1=float(message))


FLOOD = [
    b"\xfd" * 60_000,
    bytes(60_000),
    request(30) * 1300,
    request(30) * 45,
    request(148),
    request(9),
    b"\xfd" * 2000,
]


@pytest.mark.parametrize("realtime", [False, True])
def test_a_flood_on_both_links_drops_what_is_too_much_and_not_the_flight(
    realtime: bool, tmp_path: Path, port_offset: int
) -> None:
    """Datagrams of 60 kB and storms of requests from strangers, several of each between any two ticks."""
    f = Flight(tmp_path, port_offset, *(["--realtime"] if realtime else []))
    strangers = [UdpLink(0, "stranger"), UdpLink(0, "another")]
    f.start()
    orders, acks = UdpLink(0, "ground station of the test"), 0
    for k in range(1, 150):
        for s in strangers:
            for d in FLOOD * (3 if k < 60 else 0):
                s.send(d, f.to)
                s.send(d, f.ground_to)
        if realtime:
            f.link.send(f.plant.at(k), f.to)
            f.link.recv(0.02)
        else:
            f.fly(1)
        if k in (70, 110):  # afterwards a station is heard as ever
            orders.send(Sender(255, 190).named("COMMAND_LONG", target_system=2, command=31010, param1=3.0), f.ground_to)
        acks += sum(len([a for a in fields(d, "COMMAND_ACK") if a["command"] == 31010]) for d, _ in orders.take())
    for _ in range(10):
        f.link.send(f.plant.codec.shutdown(), f.to)
    assert f.wait() == 0, f.err()
    for s in (*strangers, orders):
        s.close()
    f.close()
    assert acks >= 1
    said = "".join(
        t["text"]
        for _, link, p in tlog.read(tmp_path / "link_receiver.tlog")
        if link == tlog.GROUND_OUT
        for t in fields(p, "STATUSTEXT")
    )
    assert "packets dropped unread" in said
    report = replay(tmp_path / "link_receiver.tlog", Node(config(), FakeApp(), realtime=realtime))
    assert report.ok and report.ticks > 100, report.lines()


@pytest.mark.parametrize(("signum", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signal_closes_the_log(flight: Flight, tmp_path: Path, signum: int, code: int) -> None:
    flight.start()
    flight.fly(50)
    flight.popen.send_signal(signum)
    assert flight.wait() == code
    assert "flightsw receiver (sysid 2): stopped by signal" in flight.err()
    assert len({t for t, _, _ in tlog.read(tmp_path / "link_receiver.tlog")}) == 51


def test_silent_plant_ends_the_run_and_says_the_last_tick(flight: Flight, tmp_path: Path) -> None:
    flight.start()
    flight.fly(20)
    assert flight.wait() == 3
    err = flight.err()
    assert "flightsw receiver (sysid 2): plant silent on udp:127.0.0.1:" in err
    assert "last tick here: 20 at t = 0.20 s" in err
    assert len(list(tlog.read(tmp_path / "link_receiver.tlog"))) > 40


def test_realtime_run_answers_late_and_missing_frames_and_replays(tmp_path: Path, port_offset: int) -> None:
    f = Flight(tmp_path, port_offset, "--realtime")
    f.start()
    replies = 0
    for k in range(1, 60):
        if k % 7:
            f.link.send(f.plant.at(k), f.to)
        got = f.link.recv(0.05)
        replies += got is not None
    f.link.send(f.plant.codec.shutdown(), f.to)
    assert f.wait() == 0
    err = f.err()
    assert replies > 50 and "real time at 100 Hz" in err and "slips" in err
    a = f.accounts()
    assert f"{a['ticks']} ticks, {a['slips']} slips" in err and a["late_max_us"] >= a["late_p99_us"] > 0.0
    assert a["exec_max_us"] > 0.0 and a["unsent_datagrams"] == 0
    report = replay(tmp_path / "link_receiver.tlog", Node(config(), FakeApp(), realtime=True))
    assert report.ok and report.ticks > 50, report.lines()
    f.close()


def test_with_a_key_only_who_has_it_is_heard_and_the_others_are_counted(tmp_path: Path, port_offset: int) -> None:
    """The stock library signs the orders and verifies the telemetry; nobody else gets a word in, nor an answer out."""
    from pymavlink.dialects.v20 import common

    write_key(tmp_path / "key")
    key = read_key(tmp_path / "key")
    flight = Flight(tmp_path, port_offset, "--signing-key", str(tmp_path / "key"))
    gcs = UdpLink(0, "ground station of the test")
    try:
        flight.link.send(flight.plant.at(0), flight.to)
        assert flight.link.recv(1.0) is None  # not signed
        flight.link.close()
        flight.link = UdpLink(0, "plant of the test", security=Security(key, time.time), ident=PLANT)
        judge = Signing(key, 9, time.time)
        for _ in range(100):
            flight.link.send(flight.plant.at(0), flight.to)
            got = flight.link.recv(0.2)
            if got is not None:
                break
        assert got is not None and names(judge.check(got[0])) == ["HIL_ACTUATOR_CONTROLS"]
        flight.tick = 1
        mav = common.MAVLink(None, 255, 190)
        mav.robust_parsing = True
        mav.signing.secret_key, mav.signing.link_id, mav.signing.sign_outgoing = key, 7, True
        mav.signing.timestamp = units(time.time())
        order = common.MAVLink_command_long_message(2, 1, 31010, 0, 3.0, 0, 0, 0, 0, 0, 0)
        signed, bare = bytes(order.pack(mav)), Sender(255, 190).named("COMMAND_LONG", target_system=2, command=31010)
        for d in (bare, Signing(bytes(32), 7, time.time).sign(bare), signed, bare, signed):
            gcs.send(d, flight.ground_to)
        heard = []
        for _ in range(25):
            flight.fly(10)
            heard += [d for d, _ in gcs.take()]
        got_back = [m for d in heard for m in mav.parse_buffer(d) or ()]
        assert [m.result for m in got_back if m.get_type() == "COMMAND_ACK"] == [0]
        assert got_back and all(m.get_signed() for m in got_back if not m.get_type().startswith("UNKNOWN"))
        said = {m.text for m in got_back if m.get_type() == "STATUSTEXT"}
        assert any(text.startswith("signing: refused ") for text in said), said
        flight.popen.send_signal(signal.SIGTERM)
        flight.wait()
        assert flight.accounts()["refused_by_signing"] >= 4
        assert not any(p[2] & 1 for _, _, p in tlog.read(tmp_path / "link_receiver.tlog"))  # logs are as without a key
        report = replay(tmp_path / "link_receiver.tlog", Node(load_flight(tmp_path / "flight.toml"), FakeApp()))
        assert report.ok, report.lines()
    finally:
        gcs.close()
        flight.close()
