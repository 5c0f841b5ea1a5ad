"""The board in a network namespace of its own: other addresses, a cable that can be pulled, a network that delays, loses and
reorders. Needs root and `ip netns`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.hil.proxy import Proxy
from tests.sil.launch import TIMEOUT_S, sil, start, summary, wait_for

HERE, THERE = "10.203.77.1", "10.203.77.2"
SECONDS = 3.0
LOGS = ("truth.tlog", "link_receiver.tlog", "tlm.tlog")


def ip(*words: str) -> int:
    return subprocess.run(["ip", *words], capture_output=True, check=False).returncode


def why_not() -> str:
    """What is missing for a namespace; "" nothing."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "network namespaces need the command ip"
    probe = f"wkf-probe-{os.getpid()}"
    if ip("netns", "add", probe):
        return "this system makes no network namespaces"
    ip("netns", "del", probe)
    return ""


MISSING = why_not()
pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)


class Board:
    """A namespace with one cable to this machine."""

    def __init__(self) -> None:
        self.name = f"wkf-{os.getpid()}"
        self.cable = f"wkf{os.getpid() % 100000}"
        self.processes: list[subprocess.Popen[bytes]] = []
        assert not ip("netns", "add", self.name)
        assert not ip("link", "add", self.cable, "type", "veth", "peer", "name", "eth0", "netns", self.name)
        for words in (
            ("addr", "add", f"{HERE}/30", "dev", self.cable),
            ("link", "set", self.cable, "up"),
            ("-n", self.name, "addr", "add", f"{THERE}/30", "dev", "eth0"),
            ("-n", self.name, "link", "set", "eth0", "up"),
            ("-n", self.name, "link", "set", "lo", "up"),
        ):
            assert not ip(*words), words

    def start(self, run: Path, offset: int, *args: str) -> subprocess.Popen[bytes]:
        """flightsw of the receiver, from what was handed over."""
        config = run / "board_receiver" / "flight_receiver.toml"
        assert wait_for(config.is_file)
        argv = [sys.executable, "-m", "flightsw", "--config", str(config), "--run-dir", str(run), "--unsigned"]
        argv += ["--port-offset", str(offset), *args]
        p = subprocess.Popen(["ip", "netns", "exec", self.name, *argv], stdout=subprocess.DEVNULL)
        self.processes.append(p)
        return p

    def close(self) -> None:
        for p in self.processes:
            if p.poll() is None:
                p.kill()
            p.wait()
        ip("link", "del", self.cable)
        ip("netns", "del", self.name)


@pytest.fixture
def there() -> Iterator[Board]:
    b = Board()
    yield b
    b.close()


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("local") / "run"
    ended = sil("run", "refueling", "--seed", 3, "--duration", SECONDS, "--no-rrd", "--in-process", "--out", run)
    assert ended.code == 0, ended.text
    return run


def common(run: Path, offset: int) -> tuple[object, ...]:
    return (
        "run",
        "refueling",
        "--seed",
        3,
        "--duration",
        SECONDS,
        "--no-rrd",
        "--unsigned",
        "--port-offset",
        offset,
        "--out",
        run,
    )


@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_same_bytes_over_a_network(kind: str, there: Board, tmp_path: Path, port_offset: int, local: Path) -> None:
    run, words = tmp_path / "run", tmp_path / "words.txt"
    launcher = start(*common(run, port_offset), "--external", f"receiver={kind}:{THERE}", out=words)
    far = there.start(run, port_offset)
    assert launcher.wait(TIMEOUT_S) == 0, words.read_text()
    assert far.wait(30.0) == 0
    for name in LOGS:  # telemetry has found its way back too
        assert (run / name).read_bytes() == (local / name).read_bytes(), name


def test_delay_jitter_loss_and_reordering_cost_lockstep_time_only(
    there: Board, tmp_path: Path, port_offset: int, local: Path
) -> None:
    run, words = tmp_path / "run", tmp_path / "words.txt"
    with Proxy((THERE, 4900), 0.004, 0.004, 0.02) as proxy:
        at = f"receiver=udp:127.0.0.1:{proxy.port}"
        launcher = start(*common(run, port_offset), "--external", at, "--here", HERE, out=words)
        far = there.start(run, port_offset, "--link", f"udp:{THERE}:4900")
        assert launcher.wait(TIMEOUT_S) == 0, words.read_text()
        assert far.wait(30.0) == 0
        assert proxy.lost > 2
    assert (run / "truth.tlog").read_bytes() == (local / "truth.tlog").read_bytes()
    assert summary(run)["plant.ticks_sent_again.receiver"] > 0


def test_a_pulled_cable_in_real_time(there: Board, tmp_path: Path, port_offset: int) -> None:
    run, words = tmp_path / "run", tmp_path / "words.txt"
    args = ("--realtime", "--set", "plant.clock.silence=fly", "--set", "plant.clock.peer_timeout_s=0.5")
    launcher = start(
        *common(run, port_offset), "--duration", 6.0, "--external", f"receiver=udp:{THERE}", *args, out=words
    )
    far = there.start(run, port_offset, "--realtime")
    assert wait_for(lambda: (run / "truth.tlog").exists() and (run / "truth.tlog").stat().st_size > 8000)
    ip("link", "set", there.cable, "down")
    time.sleep(1.5)
    ip("link", "set", there.cable, "up")
    assert launcher.wait(TIMEOUT_S) == 0, words.read_text()
    assert far.wait(30.0) == 0
    got = summary(run)
    assert got["plant.silent_times.receiver"] >= 1 and got["plant.replies_lost.receiver"] > 20


def test_an_open_address_asks_for_a_key(there: Board, tmp_path: Path) -> None:
    ended = sil("run", "refueling", "--external", f"receiver=udp:{THERE}", "--out", tmp_path / "run")
    assert ended.code == 2 and "others can reach it" in ended.text, ended.text
