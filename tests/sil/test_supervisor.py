"""Process supervision with stand-in programs: deaths are seen and named, nothing is left over."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from hil_scripts.launch.procs import StopFlag, Supervisor, describe_exit

FAKE = str(Path(__file__).with_name("fake_program.py"))
FOREVER = "1000000"


def argv(manner: str = "plain", lines: str = FOREVER, code: str = "0") -> list[str]:
    return [sys.executable, FAKE, manner, lines, code]


def wait_for(condition: Any, seconds: float = 20.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_death_is_seen_with_exit_code_and_last_words(tmp_path: Path) -> None:
    messages: list[dict[str, Any]] = []
    with Supervisor(tmp_path) as sup:
        child = sup.start("short", argv(lines="3", code="7"), messages.append)
        other = sup.start("long", argv())
        assert sup.wait([child], 20.0)
        (ended,) = sup.newly_ended()
        assert ended is child and describe_exit(child.popen.returncode) == "exit code 7"
        assert list(child.tail) == ["last words"]
        assert [m["tick"] for m in messages] == [0, 1, 2]
        assert sup.newly_ended() == []
        assert sup.running() == [other]
    assert not alive(other.pid)
    assert (tmp_path / "short.stderr.txt").read_text() == "last words"
    assert not (tmp_path / "long.stderr.txt").exists()


def test_kill_is_described_by_its_signal() -> None:
    with Supervisor() as sup:
        child = sup.start("victim", argv())
        os.kill(child.pid, signal.SIGKILL)
        assert sup.wait([child], 20.0)
        assert describe_exit(child.popen.returncode) == "killed by SIGKILL"


def test_a_program_deaf_to_sigterm_is_killed() -> None:
    with Supervisor() as sup:
        ready: list[dict[str, Any]] = []
        deaf = sup.start("deaf", argv("deaf"), ready.append)
        while not ready:
            sup.pump(0.05)
        assert sup.stop() == ["deaf"]
        assert not alive(deaf.pid)


def test_the_recorder_is_stopped_after_the_others() -> None:
    order: list[str] = []
    with Supervisor() as sup:
        recorder, first = sup.start("recorder", argv()), sup.start("first", argv())
        original = sup.signal

        def spy(which: Any, signum: int) -> None:
            order.extend(c.name for c in which)
            original(which, signum)

        sup.signal = spy  # type: ignore[method-assign]
        sup.stop(last=[recorder])
        assert order[0] == first.name and order[-1] == recorder.name


def test_rubbish_on_stdout_is_kept_as_words_not_as_status() -> None:
    messages: list[dict[str, Any]] = []
    with Supervisor() as sup:
        code = "print('{not json'); print('[1]'); print('plain'); print('{\"t\": 1}')"
        child = sup.start("odd", [sys.executable, "-c", code], messages.append)
        sup.wait([child], 20.0)
        sup.newly_ended()
        assert messages == [{"t": 1}]
        assert list(child.tail) == ["{not json", "[1]", "plain"]


def test_children_die_with_a_launcher_that_is_killed_outright(tmp_path: Path) -> None:
    script = (
        "import sys, time\nfrom hil_scripts.launch.procs import Supervisor\n"
        f"sup = Supervisor()\nprint(sup.start('a', {argv()!r}).pid, flush=True)\ntime.sleep(600)\n"
    )
    launcher = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert launcher.stdout is not None
    pid = int(launcher.stdout.readline())
    assert alive(pid)
    launcher.kill()
    launcher.wait()
    launcher.stdout.close()
    assert wait_for(lambda: not alive(pid)), "orphan left"


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_stop_flag_collects_signals_and_restores_handlers(signum: signal.Signals) -> None:
    before = signal.getsignal(signum)
    with StopFlag() as stop:
        assert not stop
        signal.raise_signal(signum)
        assert stop and stop.signum == signum and not stop.hurry
        signal.raise_signal(signum)
        assert stop.hurry
    assert signal.getsignal(signum) is before
