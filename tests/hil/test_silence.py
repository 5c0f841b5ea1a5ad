"""Silence with the real processes: time stands still and nothing is lost, or the aircraft flies on by its servo unit and what
comes back is taken up; and how long either is borne."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import read
from tests.hil.board import board, fly
from tests.hil.proxy import Proxy
from tests.sil.launch import TIMEOUT_S, sil, start, summary, wait_for

SHORT = ("--set", "plant.clock.peer_timeout_s=0.5")


def ticks(run: Path) -> int:
    """Bytes of truth so far."""
    path = run / "truth.tlog"
    return path.stat().st_size if path.exists() else 0


def texts(run: Path, sysid: int) -> list[str]:
    """What an aircraft has said so far."""
    return [
        spec.to_dict(values)["text"]
        for _, _, packet in (read(run / "tlm.tlog") if (run / "tlm.tlog").exists() else ())
        for spec, values, who, *_ in wire.split(packet, wire.table(("STATUSTEXT",)), wire.Counters())
        if who == sysid
    ]


@pytest.mark.parametrize("pace", [(), ("--realtime",)])
def test_time_waits_for_a_cut_cable(pace: tuple[str, ...], tmp_path: Path, port_offset: int) -> None:
    run, seconds = tmp_path / "run", 3.0
    to = ("127.0.0.1", 4700 + port_offset)
    wait = ("--set", "plant.clock.silence=wait", *SHORT)
    words = tmp_path / "words.txt"
    with Proxy(to) as proxy:
        launcher = start(
            *(
                "run",
                "refueling",
                "--seed",
                3,
                "--duration",
                seconds,
                "--no-rrd",
                "--port-offset",
                port_offset,
                "--out",
                run,
            ),
            *("--external", f"receiver=udp:127.0.0.1:{proxy.port}", *wait, *pace),
            out=words,
        )
        far = board(run, "receiver", port_offset, "--link", f"udp:{to[0]}:{to[1]}", *pace)
        assert wait_for(lambda: proxy.passed > 100)
        proxy.cut = True
        time.sleep(2.0)
        proxy.cut = False
        assert launcher.wait(TIMEOUT_S) == 0, words.read_text()
        assert far.wait(30.0) == 0
    counted = summary(run)
    assert counted["plant.silent_times.receiver"] == 1
    if not pace:
        local = tmp_path / "local"
        sil("run", "refueling", "--seed", 3, "--duration", seconds, "--no-rrd", "--in-process", "--out", local)
        assert (run / "truth.tlog").read_bytes() == (local / "truth.tlog").read_bytes()


@pytest.mark.parametrize("pace", [("--speed", "2"), ("--realtime",)])
def test_killed_and_started_again(pace: tuple[str, ...], tmp_path: Path, port_offset: int) -> None:
    run, words = tmp_path / "run", tmp_path / "words.txt"
    onboard = [w for w in pace if w == "--realtime"]
    near = [
        w
        for k in ("plant.aircraft.receiver.start.xi_m", "receiver.guid.observation_m")
        for w in ("--set", f"{k}=[-60.0,0,26]")
    ]
    launcher = start(
        *("run", "refueling", "--seed", 3, "--duration", 25.0, "--no-rrd", "--port-offset", port_offset, "--out", run),
        *("--external", "receiver", "--set", "plant.clock.silence=fly", *SHORT, *near, *pace),
        out=words,
    )
    first = board(run, "receiver", port_offset, *onboard)
    assert wait_for(lambda: ticks(run) > 20_000)
    first.send_signal(signal.SIGKILL)
    first.wait(10.0)
    second = board(run, "receiver", port_offset, *onboard)

    def left() -> bool:
        return any(s.startswith("breakaway: begun in flight close to the tanker") for s in texts(run, 2))

    assert wait_for(lambda: left() or launcher.poll() is not None) and left(), texts(run, 2)
    before = ticks(run)
    assert wait_for(lambda: ticks(run) > before + 20_000 or launcher.poll() is not None)  # and flies on
    launcher.send_signal(signal.SIGINT)  # or has flown to the end
    assert launcher.wait(TIMEOUT_S) in (0, 130), words.read_text()
    assert second.wait(30.0) == 0
    assert summary(run)["run.outcome"] in ("completed", "aborted")


def test_silence_has_an_end(tmp_path: Path, port_offset: int) -> None:
    run, words = tmp_path / "run", tmp_path / "words.txt"
    launcher = start(
        *("run", "refueling", "--seed", 3, "--duration", 60.0, "--no-rrd", "--port-offset", port_offset, "--out", run),
        *(
            "--external",
            "receiver",
            "--set",
            "plant.clock.silence=fly",
            "--set",
            "plant.clock.silence_end_s=2.0",
            *SHORT,
        ),
        out=words,
    )
    far = board(run, "receiver", port_offset)
    assert wait_for(lambda: ticks(run) > 5_000)
    far.send_signal(signal.SIGKILL)
    assert launcher.wait(TIMEOUT_S) == 3, words.read_text()
    assert "peer silent for" in words.read_text() and "receiver (sysid 2" in words.read_text()


@pytest.mark.parametrize(
    ("key", "why"),
    [
        ("plant.clock.silence=never", "allowed: end, wait, fly"),
        ("plant.clock.silence_end_s=5.0", "nothing obeys it with clock.silence = 'end'"),
        ("receiver.link.silence_end_s=5.0", "allowed with silence = 'wait'"),
    ],
)
def test_rules_that_cannot_be(key: str, why: str, tmp_path: Path) -> None:
    ended = sil("run", "refueling", "--set", key, "--out", tmp_path / "run")
    assert ended.code == 2 and why in ended.text.replace('"', ""), ended.text


def test_nobody_silent(tmp_path: Path, port_offset: int) -> None:
    """A rule that is not needed costs nothing."""
    flown = fly(tmp_path / "run", port_offset, "", 1.0, (), "--set", "plant.clock.silence=fly")
    assert flown.launcher.code == 0 and summary(flown.run)["plant.silent_times.receiver"] == 0
