"""Simulated time in lockstep: held to a speed, paused, stepped, by option, command and key; the bytes do not know."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from flightsw.icd.link import UdpLink, plant_command_port
from flightsw.icd.wire import Counters, split, table
from flightsw.types import ACCEPTED, DENIED
from hil_scripts.launch.pacekeys import PaceKeys
from sim_plant.pace import CMD_PACE, PAUSE, RESUME, SPEED, STEP, Pace
from tests.hil.board import fly
from tests.sil.launch import TIMEOUT_S, sil, start, wait_for


class Wall:
    """A wall clock that moves when slept on."""

    def __init__(self) -> None:
        self.t, self.slept = 100.0, 0.0

    def now(self) -> float:
        return self.t

    def sleep(self, s: float) -> None:
        self.t += s
        self.slept += s


def flown(pace: Pace, most: int) -> int:
    """Ticks that may be flown before it holds, up to `most`."""
    n = 0
    while n < most and not pace.hold():
        n += 1
    return n


def test_speed_pause_step_and_resume() -> None:
    w = Wall()
    p = Pace(100, w.now, w.sleep)
    assert flown(p, 1000) == 1000 and w.slept == 0.0
    assert p.order((SPEED, 2.0)) == (ACCEPTED, "")
    assert flown(p, 400) == 400 and w.slept == pytest.approx(2.0, abs=0.01)
    assert p.order((PAUSE, 0.0)) == (ACCEPTED, "") and flown(p, 10) == 0 and p.words == "paused"
    assert p.order((STEP, 3.0)) == (ACCEPTED, "") and flown(p, 10) == 3
    assert p.order((STEP, 0.0)) == (ACCEPTED, "") and flown(p, 10) == 1
    assert p.order((RESUME, 0.0)) == (ACCEPTED, "") and flown(p, 10) == 10 and p.words == "held to 2 x"
    w.t += 60.0  # nobody could keep up
    before = w.slept
    flown(p, 100)
    assert w.slept - before == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("params", "why"),
    [
        ((7.0, 0.0), "pace 7: allowed"), ((STEP, 1.5), "step 1.5: allowed"), ((STEP, -1.0), "step -1: allowed"),
        ((SPEED, float("nan")), "speed nan: allowed"), ((SPEED, -1.0), "speed -1: allowed"), ((float("nan"), 0.0), "pace nan"),
    ],
)  # fmt: skip
def test_refused(params: tuple[float, float], why: str) -> None:
    result, said = Pace(100).order(params)
    assert result == DENIED and said.startswith(why)


def test_keys_become_commands(port_offset: int) -> None:
    plant = UdpLink(plant_command_port(port_offset), "plant of the test")
    ours, theirs = os.openpty()
    with PaceKeys(2, port_offset, 0.0, theirs) as keys:
        os.write(ours, b"psrx+-")
        seen: list[bytes] = []
        for _ in range(50):
            keys.poll()
            if (heard := plant.recv(0.2)) is not None:
                seen.append(heard[0])
            if len(seen) == 5:
                break
    got = [
        (spec.to_dict(v)["command"], spec.to_dict(v)["param1"], spec.to_dict(v)["param2"])
        for d in seen
        for spec, v, *_ in split(d, table(("COMMAND_LONG",)), Counters())
    ]
    assert got == [(CMD_PACE, *o) for o in ((PAUSE, 0.0), (STEP, 1.0), (RESUME, 0.0), (SPEED, 2.0), (SPEED, 1.0))]
    plant.close()
    os.close(ours)
    os.close(theirs)


def test_paused_stepped_and_resumed_by_command(tmp_path: Path, port_offset: int) -> None:
    """Longer than any process bears silence; the truth is that of a run flat out."""
    from ground.link.command import send
    from ground.link.pace import pace

    run, words = tmp_path / "run", tmp_path / "words.txt"
    common = ("run", "refueling", "--seed", 3, "--duration", 3.0, "--no-rrd")
    launcher = start(*common, "--port-offset", port_offset, "--out", run, "--speed", 2.0, out=words)
    assert wait_for(lambda: (run / "truth.tlog").exists())
    answer = None
    for _ in range(20):
        answer = send(pace("pause", None, None), port_offset)
        if answer.result == 0:
            break
    assert answer is not None and answer.result == 0, answer
    time.sleep(4.0)
    assert launcher.poll() is None
    assert send(pace("step", 10.0, None), port_offset).result == 0
    assert send(pace("pace", -1.0, None), port_offset).result == DENIED
    assert send(pace("pace", 0.0, None), port_offset).result == 0
    assert send(pace("resume", None, None), port_offset).result == 0
    assert launcher.wait(TIMEOUT_S) == 0, words.read_text()
    local = tmp_path / "local"
    assert sil(*common, "--in-process", "--out", local).code == 0
    assert (run / "truth.tlog").read_bytes() == (local / "truth.tlog").read_bytes()
    assert (run / "link_receiver.tlog").read_bytes() == (local / "link_receiver.tlog").read_bytes()


def test_an_external_aircraft_at_a_speed(tmp_path: Path, port_offset: int) -> None:
    began = time.monotonic()
    f = fly(tmp_path / "run", port_offset, "tcp:127.0.0.1", 2.0, (), "--speed", "1")
    assert f.launcher.code == 0, f.launcher.text
    assert time.monotonic() - began > 1.9


@pytest.mark.parametrize("other", ["--realtime", "--in-process"])
def test_speed_belongs_to_lockstep(other: str, tmp_path: Path) -> None:
    ended = sil("run", "refueling", "--speed", "2", other, "--out", tmp_path / "run")
    assert ended.code == 2 and "--speed: allowed in lockstep" in ended.text
