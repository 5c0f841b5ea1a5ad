"""The plant on the link: datagrams, radio, truth log, UDP lockstep and real time, and how a run ends."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flightsw.icd.codec import FlightCodec
from flightsw.icd.link import plant_command_port, plant_port
from flightsw.icd.tlog import read
from flightsw.types import UPD_PEER, ActuatorCmd, NavState, SensorFrame
from sim_plant.__main__ import app
from sim_plant.accounts import accounts
from sim_plant.couplings.radio import FIXES, Radio
from sim_plant.loops import PeerLostError, StoppedError, UdpPlant
from sim_plant.scenario import load_scenario
from sim_plant.server import PlantServer

SHORT = {"meta.duration_s": 1.0}


class FakeFlight:
    """Stands for one flightsw: decodes, answers with the trim command, transmits its state at 20 Hz."""

    def __init__(self, server: PlantServer, i: int) -> None:
        v = server.world.members[i]
        self.codec = FlightCodec(v.ac, v.cfg.sysid)
        self.frame = SensorFrame()
        self.cmd = server.world.trim_cmd(i)
        self.heard: list[int] = []
        self.commands: list[float] = []

    def answer(self, datagram: bytes) -> bytes:
        self.codec.decode(datagram, self.frame)
        f, t = self.frame, self.frame.t_us
        if f.updated & UPD_PEER:
            self.heard.append(t - f.peer.t_us)
        self.commands += [c.params[0] for c in f.commands]
        c = self.cmd
        out = self.codec.actuators(ActuatorCmd(t, c.aileron, c.elevator, c.rudder, c.throttle))
        if t % 50000 == 0:
            nav = NavState(t_us=t, valid=True, pos_n=(10.0, 20.0, -7000.0), vel_n=(195.0, 0.0, 0.0))
            out += self.codec.peer(nav)
        return out


def in_process(over: dict[str, Any], run_dir: Path | None = None) -> tuple[PlantServer, list[FakeFlight], list[bytes]]:
    s = PlantServer(load_scenario("refueling", SHORT | over), 1, run_dir)
    peers = [FakeFlight(s, i) for i in range(2)]
    sent = []
    while not s.done:
        out = s.begin_tick()
        sent += out
        s.end_tick([p.answer(d) for p, d in zip(peers, out, strict=True)])
    s.close()
    return s, peers, sent


def test_radio_relays_late_and_in_order() -> None:
    _, (tanker, receiver), _ = in_process({})
    assert len(receiver.heard) == 19 and set(receiver.heard) == {50000}
    assert len(tanker.heard) == 19


def test_radio_latency_and_link_loss_events() -> None:
    event = {"t_s": 0.5, "kind": "link_loss", "target": "tanker"}
    _, (tanker, receiver), _ = in_process({"link.radio_latency_ms": 120.0, "event": [event]})
    assert set(receiver.heard) == {120000}
    # a dead radio neither sends nor receives: what was on its way to the tanker at 0.5 s is lost too
    assert len(receiver.heard) == 10 and len(tanker.heard) == 8


def test_radio_loss_is_random_and_seeded() -> None:
    def heard(seed: int) -> list[bytes]:
        r = Radio(["a", "b"], seed, 50.0, 0.3, 100)
        out = []
        for k in range(1000):
            r.send(0, k, [k.to_bytes(4, "big")])
            out += r.receive(1, k)
        return out

    assert heard(1) == heard(1) != heard(2)
    assert 620 < len(heard(1)) < 740


def test_fixes_on_the_air_change_nobody_else_s_losses() -> None:
    def heard(fixes: bool) -> list[bytes]:
        r = Radio(["a", "b"], 1, 50.0, 0.3, 100)
        out = []
        for k in range(400):
            r.send(0, k, [b"s%d" % k])
            if fixes and k % 10 == 0:
                r.send(0, k, [b"f%d" % k], kind=FIXES)
            out += r.receive(1, k)
        return out

    both, alone = heard(True), heard(False)
    fixes = [int(p[1:]) for p in both if p[:1] == b"f"]
    assert [p for p in both if p[:1] == b"s"] == alone
    assert 18 < len(fixes) < 38  # of 40, lost by their own draw
    assert any((b"s%d" % k in alone) != (k in fixes) for k in range(0, 390, 10))


def test_same_seed_gives_the_same_datagrams(tmp_path: Path) -> None:
    a, b = in_process({}, tmp_path / "a")[2], in_process({}, tmp_path / "b")[2]
    assert a == b
    logs = [(tmp_path / d / "truth.tlog").read_bytes() for d in "ab"]
    assert logs[0] == logs[1]
    rows = list(read(tmp_path / "a" / "truth.tlog"))
    assert [r[0] for r in rows] == [t * 50000 for t in range(20) for _ in (0, 1)]
    assert load_scenario(str(tmp_path / "a" / "scenario.toml")).meta.duration_s == 1.0


def test_begin_tick_repeats_and_stale_replies_are_refused() -> None:
    s = PlantServer(load_scenario("refueling", SHORT), 1)
    peer = FakeFlight(s, 0)
    zero = peer.answer(s.begin_tick()[0])
    s.end_tick([zero, None])
    first = s.begin_tick()
    assert s.begin_tick() is first
    assert not s.accept(0, zero) and s.rejected == [0, 0]  # tick 0 is repeated until answered: so may be its answer
    old = peer.answer(first[0])
    assert not s.accept(0, b"rubbish")
    assert s.accept(0, old) and not s.accept(0, old)  # duplicate
    s.end_tick()
    s.begin_tick()
    assert not s.accept(0, old)  # late
    assert s.accept(0, old, exact=False)  # real time takes it
    assert s.rejected == [3, 0]


def test_truth_never_travels_to_flightsw() -> None:
    _, peers, sent = in_process({})
    assert b"".join(sent).find((53020).to_bytes(3, "little")) < 0
    assert all(p.codec.count.unknown == 0 for p in peers)


def free_offset() -> int:
    """A port offset at which both plant ports and the plant's command port are free now."""
    while True:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as a,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as b,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as c,
        ):
            a.bind(("127.0.0.1", 0))
            offset = a.getsockname()[1] - plant_port(1)
            try:
                b.bind(("127.0.0.1", plant_port(2, offset)))
                c.bind(("127.0.0.1", plant_command_port(offset)))
            except (OSError, OverflowError):
                continue
            if 0 <= offset <= 40000:
                return int(offset)


class Thread:
    """A FakeFlight on its UDP port until told to shut down or to die."""

    def __init__(self, server: PlantServer, i: int, offset: int, twist: Callable[[int, bytes], list[bytes]]) -> None:
        self.peer = FakeFlight(server, i)
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.bind(("127.0.0.1", plant_port(server.sysids[i], offset)))
        self.sock.settimeout(0.2)
        self.twist, self.count, self.stop = twist, 0, False
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        while not self.stop:
            try:
                data, addr = self.sock.recvfrom(65535)
            except TimeoutError:
                continue
            for d in self.twist(self.count, self.peer.answer(data)):
                self.sock.sendto(d, addr)
            self.count += 1

    def close(self) -> None:
        self.stop = True
        self.thread.join()
        self.sock.close()


def over_udp(over: dict[str, Any], twist: Callable[[int, bytes], list[bytes]]) -> tuple[PlantServer, UdpPlant, float]:
    s = PlantServer(load_scenario("refueling", SHORT | over), 1)
    offset = free_offset()
    u = UdpPlant(s, offset, lambda *_: None, lambda text: None)
    peers = [Thread(s, 0, offset, lambda k, d: [d]), Thread(s, 1, offset, twist)]
    began = time.monotonic()
    try:
        if s.scenario.clock.mode == "realtime":
            u.realtime()
        else:
            u.lockstep()
    finally:
        wall = time.monotonic() - began
        u.finish()
        for p in peers:
            p.close()
    return s, u, wall


def test_lockstep_over_udp_equals_in_process() -> None:
    """Rubbish, duplicated and late replies on the way do not change the run."""
    keep = [b""]

    def dirty(k: int, d: bytes) -> list[bytes]:
        old, keep[0] = keep[0], d
        return [b"\x00rubbish", old, d, d] if k % 3 == 0 and old else [d]

    s, _, _ = over_udp({}, dirty)
    ref, _, _ = in_process({})
    assert s.tick == 100
    assert [s.world.truth(i) for i in (0, 1)] == [ref.world.truth(i) for i in (0, 1)]
    assert s.rejected[1] > 60


def test_a_silent_peer_ends_the_run_and_is_named() -> None:
    with pytest.raises(
        PeerLostError, match=r"peer silent for 0\.\d s; plant is at tick 40 .*receiver \(sysid 2.*last answered tick 39"
    ):
        over_udp({"clock.peer_timeout_s": 0.3}, lambda k, d: [d] if k < 40 else [])


def test_rubbish_is_no_sign_of_life() -> None:
    with pytest.raises(PeerLostError, match=r"receiver.*datagrams rejected"):
        over_udp({"clock.peer_timeout_s": 0.3}, lambda k, d: [d] if k < 40 else [b"x"] * 5)


def test_nobody_at_start_up_is_named() -> None:
    with pytest.raises(PeerLostError, match=r"no answer at start-up.*receiver.*never answered"):
        over_udp({"clock.startup_timeout_s": 0.5}, lambda k, d: [])


def test_the_first_tick_may_take_as_long_as_the_start() -> None:
    """flightsw is patient until its second tick; so is the plant."""

    def slow(k: int, d: bytes) -> list[bytes]:
        if k == 1:
            time.sleep(0.6)
        return [d]

    s, _, _ = over_udp({"clock.peer_timeout_s": 0.3, "meta.duration_s": 0.2}, slow)
    assert s.done


def test_asked_to_stop_it_ends_between_two_ticks(tmp_path: Path) -> None:
    s = PlantServer(load_scenario("refueling", {**SHORT, "clock.startup_timeout_s": 60.0}), 1, tmp_path)
    asked = iter([False, False, True])
    u = UdpPlant(s, free_offset(), lambda *_: None, lambda text: None, lambda: next(asked))
    with pytest.raises(StoppedError):
        u.lockstep()
    u.finish()
    s.close()
    assert s.tick == 0 and len(list(read(tmp_path / "truth.tlog"))) == 2


def test_accounts_tell_what_was_lost() -> None:
    s, u, _ = over_udp({"clock.mode": "realtime"}, lambda k, d: [d, b"rubbish"] if k % 10 else [])
    a = accounts(s, u)
    assert a["missed_ticks.receiver"] == u.missed[1] >= 9
    assert a["rejected_datagrams.receiver"] >= 50 > a["rejected_datagrams.tanker"] == 0
    assert a["late_ticks"] == u.late_ticks and a["overrun_datagrams"] == a["unsent_datagrams"] == 0
    assert set(accounts(s)) == set(a)  # the same keys without sockets


def test_real_time_keeps_the_pace_and_ends() -> None:
    """Wall time cannot be shorter than simulated time; a late reply is used, a missing one counted."""
    s, u, wall = over_udp({"clock.mode": "realtime"}, lambda k, d: [d] if k % 10 else [])
    assert s.done
    assert wall > 0.97
    assert u.missed[1] >= 9


def _cli(*args: str) -> subprocess.Popen[str]:
    env = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "sim_plant", *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    )


@pytest.fixture
def signals() -> Iterator[None]:
    """The command sets handlers of its own: put back those of the test run."""
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    yield
    for n, handler in before.items():
        signal.signal(n, handler)


@pytest.mark.parametrize(
    ("args", "code", "text"),
    [
        (("--scenario", "nowhere"), 2, "available"),
        (("--set", "noise.scal=1"), 2, "noise.scal: unknown key"),
        (("--set", "noise.scale"), 2, "expected key=value"),
        (("--run-dir", "/proc/nowhere"), 2, "/proc/nowhere"),
        (("--set", "aircraft.tanker.start.V_mps=20"), 2, "no trim at airspeed 20"),
        (("--set", "clock.startup_timeout_s=0.3", "--port-offset", str(free_offset())), 3, "tanker (sysid 1"),
    ],
)
def test_command_line_errors_name_the_thing(args: tuple[str, ...], code: int, text: str, signals: None) -> None:
    got = CliRunner().invoke(app, list(args))
    assert got.exit_code == code, got.output
    assert text in got.stderr and len(got.stderr.strip().splitlines()) == 1
    assert json.loads(got.stdout.strip().splitlines()[-1])["done"] is True


def test_a_signal_ends_the_run_cleanly(tmp_path: Path) -> None:
    p = _cli("--run-dir", str(tmp_path), "--port-offset", str(free_offset()))
    assert p.stdout is not None
    assert json.loads(p.stdout.readline())["tick"] == 0
    p.send_signal(signal.SIGTERM)
    out, err = p.communicate(timeout=30)
    assert p.returncode == 143
    assert "stopped by SIGTERM" in err
    assert json.loads(out.strip().splitlines()[-1])["outcome"] == "stopped"
    assert len(list(read(tmp_path / "truth.tlog"))) == 2
