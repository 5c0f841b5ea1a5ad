"""Programs of a test as forks of one prepared process: a new interpreter imports and loads kernels for seconds of time.

A worker of the tests has a second thread and may not fork itself; the launcher in a process of its own may, and forks its
programs as it does for a user. The prepared process is started when first asked for and ends with the worker.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import setproctitle

CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload([f"{__name__}_ready"])
Call = Callable[[], Any]


class Forked:
    """`python -m module args`, started; its words go to the file `out`, those on stderr to `err` if there is one.

    call: what is called in place of the module's `main`, first: what is called before. Both by name: functions of a module.
    """

    def __init__(
        self,
        module: str,
        *args: object,
        out: Path,
        err: Path | None = None,
        call: Call | None = None,
        first: Call | None = None,
    ) -> None:
        argv = [module, *(str(a) for a in args)]
        here = (dict(os.environ), str(Path.cwd()))
        self.process = CONTEXT.Process(target=_child, args=(argv, *here, out, err, call, first), daemon=True)
        for path in (out, err):
            if path is not None:
                path.touch()
        self.process.start()
        assert self.process.pid is not None
        self.pid = self.process.pid

    def poll(self) -> int | None:
        """Exit code, -N for signal N, None while it runs."""
        return self.process.exitcode

    def wait(self, seconds: float | None = None) -> int:
        """Exit code. Raises subprocess.TimeoutExpired."""
        self.process.join(seconds)
        code = self.process.exitcode
        if code is None:
            raise subprocess.TimeoutExpired(self.process.name, seconds or 0.0)
        return code

    def send_signal(self, signum: int) -> None:
        """To the program, if it has not ended."""
        if self.poll() is None:
            os.kill(self.pid, signum)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


def _child(
    argv: list[str], env: dict[str, str], cwd: str, out: Path, err: Path | None, call: Call | None, first: Call | None
) -> None:
    module, *args = argv
    setproctitle.setproctitle(" ".join([sys.executable, "-m", module, *args]))
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    for number, path in ((1, out), (2, err or out)):
        where = os.open(path, os.O_WRONLY | os.O_APPEND)
        os.dup2(where, number)
        os.close(where)
    sys.stdout = open(1, "w", encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)  # noqa: SIM115
    sys.argv = argv
    if first is not None:
        first()
    (call or importlib.import_module(module).main)()
