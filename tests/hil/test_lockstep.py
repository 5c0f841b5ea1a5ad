"""Lockstep over every kind of line, with the real processes: the bytes of a run do not know where its aircraft are flown."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from flightsw.icd.lines import SERIAL, TCP, UDP
from tests.hil.board import Flown, fly
from tests.hil.ptys import PtyLine
from tests.sil.launch import sil, start, summary

SECONDS = 3.0
# what is torn is sent again after a while: on a busy machine that adds up to more than the usual patience
PATIENT = tuple(
    w for k in ("plant.clock", "tanker.link", "receiver.link") for w in ("--set", f"{k}.peer_timeout_s=30.0")
)
LOGS = ("truth.tlog", "link_receiver.tlog", "link_tanker.tlog", "tlm.tlog")


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Logs of the run in which everything is on this machine."""
    run = tmp_path_factory.mktemp("local") / "run"
    ended = sil("run", "refueling", "--seed", 3, "--duration", SECONDS, "--no-rrd", "--in-process", "--out", run)
    assert ended.code == 0, ended.text
    return {name: (run / name).read_bytes() for name in LOGS}


def same(flown: Flown, local: dict[str, bytes]) -> None:
    assert flown.launcher.code == 0, flown.launcher.text
    assert flown.board.code == 0, flown.board.text
    for name, data in local.items():
        assert (flown.run / name).read_bytes() == data, name


@pytest.mark.parametrize("kind", [UDP, TCP])
def test_network(kind: str, tmp_path: Path, port_offset: int, local: dict[str, bytes]) -> None:
    flown = fly(tmp_path / "run", port_offset, "" if kind == UDP else f"{TCP}:127.0.0.1", SECONDS)
    same(flown, local)
    assert f"awaited at {kind}:127.0.0.1:{4561 + port_offset} for at most 180 s" in flown.launcher.text
    assert "take there:" in flown.launcher.text and "start there: flightsw --config" in flown.launcher.text


def test_serial(tmp_path: Path, port_offset: int, local: dict[str, bytes]) -> None:
    with PtyLine() as line:
        flown = fly(
            tmp_path / "run", port_offset, f"{SERIAL}:{line.a}:921600", SECONDS, ("--link", f"{SERIAL}:{line.b}:921600")
        )
    same(flown, local)
    counted = summary(flown.run)
    assert counted["plant.noise_bytes.receiver"] == counted["plant.torn_datagrams.receiver"] == 0


def noisy(seed: int, every: int, flip: int) -> Callable[[int, bytes], bytes]:
    """Rubbish between what is sent, also where it looks like the begin of a packet, and bits that arrive the other way round."""
    draw = random.Random(seed)
    counts = [0, 0]

    def bend(way: int, data: bytes) -> bytes:
        counts[way] += 1
        count = counts[way]
        if count % flip == 0:
            at = draw.randrange(len(data))
            data = data[:at] + bytes((data[at] ^ 1 << draw.randrange(8),)) + data[at + 1 :]
        if count % every == 0:
            data = draw.choice((b"\xfd\xff\x00", b"\x00", b"\xfe\x09")) + draw.randbytes(draw.randrange(40)) + data
        return data

    return bend


def test_noise_is_counted_and_costs_nothing_but_time(tmp_path: Path, port_offset: int, local: dict[str, bytes]) -> None:
    with PtyLine(noisy(7, every=5, flip=23)) as line:
        flown = fly(
            *(
                tmp_path / "run",
                port_offset,
                f"{SERIAL}:{line.a}:921600",
                SECONDS,
                ("--link", f"{SERIAL}:{line.b}:921600"),
            ),
            *PATIENT,
        )
    same(flown, local)
    counted = summary(flown.run)
    assert counted["plant.noise_bytes.receiver"] > 200
    assert counted["plant.torn_datagrams.receiver"] > 0
    said = re.search(r"(\d+) bytes of noise, (\d+) torn datagrams", flown.board.text)
    assert said and int(said[1]) > 200 and int(said[2]) > 0, flown.board.text


def test_nobody_there_is_said_and_ends(tmp_path: Path, port_offset: int) -> None:
    out = tmp_path / "words.txt"
    wait = [w for o in ("plant.clock", "receiver.link", "tanker.link") for w in ("--set", f"{o}.startup_timeout_s=1.0")]
    ended = start(
        *("run", "refueling", "--duration", 1.0, "--no-rrd", "--port-offset", port_offset, "--out", tmp_path / "run"),
        *("--external", f"receiver=tcp:127.0.0.1:{4700 + port_offset}", *wait),
        out=out,
    )
    assert ended.wait(60.0) == 3, out.read_text()
    assert re.search(r"no answer at start-up for \d+\.\d s", out.read_text()), (
        out.read_text()
    )  # a busy machine looks later
    assert f"receiver (sysid 2, tcp:127.0.0.1:{4700 + port_offset}): never answered" in out.read_text()


@pytest.mark.parametrize(
    ("args", "why"),
    [
        (("--external", "glider"), "no such aircraft; allowed: tanker, receiver"),
        (("--external", "receiver=pigeon:3"), "allowed: udp:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD"),
        (("--external", "receiver=serial:/dev/ttyX:1"), "baud 1: allowed: 9600 to 4000000"),
        (("--external", "receiver=tcp:127.0.0.1:70000"), "port 70000: allowed: 1 to 65535"),
        (("--external", "receiver", "--external", "receiver"), "receiver is named twice"),
        (("--external", "receiver", "--in-process"), "exclude each other"),
        (("--here", "10.1.2.3"), "allowed with --external"),
        (("--external", "receiver", "--here", "here"), "allowed: an address in numbers"),
        (("--external", "receiver", "--here", "10.1.2.3"), "others can reach it"),
    ],
)
def test_what_cannot_be_is_refused_by_name(args: tuple[str, ...], why: str, tmp_path: Path) -> None:
    ended = sil("run", "refueling", "--out", tmp_path / "run", *args)
    assert ended.code == 2 and why in ended.text, ended.text
    assert not (tmp_path / "run").exists()
