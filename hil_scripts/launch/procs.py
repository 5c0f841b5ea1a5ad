"""Process supervision for the launcher: start, watch, read, stop; no orphan whatever happens.

Everything runs in the main thread on one selector. That is deliberate: PR_SET_PDEATHSIG fires on the death of the
*thread* that forked the child, and a fork from a threaded program may deadlock in the child.
"""

from __future__ import annotations

import ctypes
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

from hil_scripts.launch import forked

PR_SET_PDEATHSIG = 1  # linux/prctl.h
TAIL_LINES = 12  # stderr lines kept for the report of a death
TERM_GRACE_S = 2.0  # [s] between SIGTERM and SIGKILL
CATCH_UP = 100  # times the pipes are looked through for the last words of those that ended

# one core per process: BLAS threads would fight the other programs for the cores and change summation order
SINGLE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}

_libc = ctypes.CDLL(None, use_errno=True) if sys.platform == "linux" else None


class StopFlag:
    """Context manager: SIGINT, SIGTERM and SIGHUP set `signum` instead of interrupting whatever runs.

    A second signal sets `hurry`: waiting for children is cut short.
    """

    SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __init__(self) -> None:
        self.signum = 0
        self.hurry = False
        self._old: dict[int, Any] = {}

    def __enter__(self) -> StopFlag:
        for s in self.SIGNALS:
            self._old[s] = signal.signal(s, self._on_signal)
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        for s, old in self._old.items():
            signal.signal(s, old)

    def text(self, sim_s: float) -> str:
        """Which signal ended a run, and at what simulated time [s]."""
        return f"stopped by {signal.Signals(self.signum).name} at t = {sim_s:.1f} s"

    def _on_signal(self, signum: int, _frame: FrameType | None) -> None:
        self.hurry = self.signum != 0
        self.signum = self.signum or signum

    def __bool__(self) -> bool:
        return self.signum != 0


@dataclass
class Child:
    """One supervised process."""

    name: str
    popen: subprocess.Popen[bytes] | forked.Forked
    on_message: Callable[[dict[str, Any]], None]
    log: FileIO | None = None
    tail: deque[str] = field(default_factory=lambda: deque(maxlen=TAIL_LINES))
    partial: dict[str, bytes] = field(default_factory=lambda: {"out": b"", "err": b""})

    @property
    def pid(self) -> int:
        """Process id, also the id of its process group."""
        return self.popen.pid

    def feed(self, stream: str, data: bytes) -> None:
        """Take raw bytes of stdout (`out`) or stderr (`err`). JSON lines go to `on_message`, the rest to the tail."""
        if stream == "err" and self.log is not None:
            try:
                self.log.write(data)
            except OSError:  # a full disk must not keep us from stopping the children
                self.close_log()
        *lines, self.partial[stream] = (self.partial[stream] + data).split(b"\n")
        for raw in lines:
            self._line(stream, raw.decode("utf-8", "replace").rstrip())

    def close_log(self) -> None:
        """Close the file of its stderr, and remove it if it is empty. Neither can fail: the disk may be full, the folder gone."""
        log, self.log = self.log, None
        if log is not None:
            log.close()
            try:
                if Path(log.name).stat().st_size == 0:
                    Path(log.name).unlink()
            except OSError:
                pass

    def flush(self) -> None:
        """Treat an unfinished last line as complete; called when the process has ended."""
        for stream, rest in self.partial.items():
            if rest.strip():
                self._line(stream, rest.decode("utf-8", "replace").rstrip())
            self.partial[stream] = b""

    def _line(self, stream: str, line: str) -> None:
        if stream == "out" and line.startswith("{"):
            try:
                msg = json.loads(line)
            except ValueError:
                msg = None
            if isinstance(msg, dict):
                self.on_message(msg)
                return
        if line.strip():
            self.tail.append(line)


def describe_exit(code: int) -> str:
    """`exit code 3` or `killed by SIGKILL` from a Popen return code."""
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"


class Supervisor:
    """Starts children in their own process groups and sees every one of them to its end.

    Use as a context manager: leaving the block stops what still runs. `log_dir` receives one `<name>.stderr.txt` per
    child that wrote to stderr.
    """

    def __init__(self, log_dir: Path | None = None) -> None:
        self.children: list[Child] = []
        self._log_dir = log_dir
        self._sel = selectors.DefaultSelector()
        self._reported: set[int] = set()

    def __enter__(self) -> Supervisor:
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self.stop()
        self._sel.close()
        for c in self.children:
            if c.log is not None:
                c.close_log()

    def start(
        self,
        name: str,
        argv: Sequence[str],
        on_message: Callable[[dict[str, Any]], None] = lambda _m: None,
        env: dict[str, str] | None = None,
    ) -> Child:
        """Start `argv` as `name`; JSON objects on its stdout go to `on_message`. Raises OSError if it cannot start.

        A module of ours (`python -m module ...`) is a fork of this process where that can be: same program, no second start.
        """
        parent = os.getpid()

        def bind_life_to_parent() -> None:
            if _libc is not None:
                _libc.prctl(PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
                if os.getppid() != parent:  # the launcher died between fork and prctl
                    os._exit(1)

        env = {**os.environ, **SINGLE_THREAD, "PYTHONUNBUFFERED": "1", **(env or {})}
        popen: subprocess.Popen[bytes] | forked.Forked
        if argv[:2] == [sys.executable, "-m"] and forked.possible():
            popen = forked.start(argv[2], argv[3:], env, bind_life_to_parent)
        else:
            popen = subprocess.Popen(
                list(argv),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                env=env,
                process_group=0,
                preexec_fn=bind_life_to_parent,
            )
        child = Child(name, popen, on_message)
        self.children.append(child)
        if self._log_dir is not None:
            child.log = open(self._log_dir / f"{name}.stderr.txt", "wb", buffering=0)  # noqa: SIM115
        for stream, pipe in (("out", popen.stdout), ("err", popen.stderr)):
            assert pipe is not None
            os.set_blocking(pipe.fileno(), False)
            self._sel.register(pipe, selectors.EVENT_READ, (child, stream))
        return child

    def pump(self, timeout_s: float) -> None:
        """Read what the children wrote, waiting at most `timeout_s` for the first byte."""
        if not self._sel.get_map():
            time.sleep(timeout_s)
            return
        for key, _ in self._sel.select(timeout_s):
            child, stream = key.data
            try:
                data = os.read(key.fd, 65536)
            except BlockingIOError:
                continue
            if data:
                child.feed(stream, data)
            else:
                self._sel.unregister(key.fileobj)

    def _catch_up(self) -> None:
        """Read what is in the pipes now: all that those have said who have ended (bounded, should others go on talking)."""
        for _ in range(CATCH_UP):
            if not self._sel.get_map() or not self._sel.select(0.0):
                return
            self.pump(0.0)

    def settle(self, duration_s: float) -> None:
        """Pump for the whole of `duration_s`."""
        end = time.monotonic() + duration_s
        while (left := end - time.monotonic()) > 0:
            self.pump(min(left, 0.05))

    def newly_ended(self) -> list[Child]:
        """Children that ended since the last call, their output read to the last line."""
        out = [c for c in self.children if c.pid not in self._reported and c.popen.poll() is not None]
        if out:
            self._catch_up()
            for c in out:
                c.flush()
                self._reported.add(c.pid)
        return out

    def running(self) -> list[Child]:
        """Children still alive."""
        return [c for c in self.children if c.popen.poll() is None]

    def wait(self, which: Sequence[Child], timeout_s: float, stop: StopFlag | None = None) -> bool:
        """Pump until all of `which` have ended; False when `timeout_s` passed or a second stop signal came first."""
        end = time.monotonic() + timeout_s
        while any(c.popen.poll() is None for c in which):
            if time.monotonic() > end or (stop is not None and stop.hurry):
                return False
            self.pump(0.05)
        self._catch_up()
        return True

    def signal(self, which: Sequence[Child], signum: int) -> None:
        """Send `signum` to the process groups of those of `which` that still run."""
        for c in which:
            if c.popen.poll() is None:
                try:
                    os.killpg(c.pid, signum)
                except ProcessLookupError:
                    continue

    def stop(self, last: Sequence[Child] = (), stop: StopFlag | None = None) -> list[str]:
        """End everything: SIGTERM, then SIGKILL after a grace; `last` (the recorder) is asked only after the others.

        Returns the names of children that had to be killed.
        """
        killed: list[str] = []
        first = [c for c in self.children if c not in last]
        for group in (first, list(last)):
            self.signal(group, signal.SIGTERM)
            if not self.wait(group, TERM_GRACE_S, stop):
                killed += [c.name for c in group if c.popen.poll() is None]
                self.signal(group, signal.SIGKILL)
                self.wait(group, TERM_GRACE_S)
        self.newly_ended()
        return killed
