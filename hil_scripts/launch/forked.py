"""One of our programs as a fork of the launcher: it starts with everything imported and its kernels loaded, a second or two of
processor time sooner than a new interpreter.

The child is the program as its command would start it: own process group, streams, arguments, signal handlers and exit code. It
holds no file of the launcher's, and what it may not know of (the plant, for the onboard software) cannot be imported in it.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import importlib.abc
import importlib.machinery
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from io import FileIO
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import setproctitle

STRANGERS = {"flightsw": ("sim_plant", "ground", "hil_scripts")}  # what a program shares no memory or mathematics with
SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Forked:
    """A forked child with the part of subprocess.Popen a supervisor needs."""

    def __init__(self, pid: int, out: int, err: int) -> None:
        self.pid = pid
        self.returncode: Any = None  # as Popen has it
        self.stdout, self.stderr = FileIO(out, "rb"), FileIO(err, "rb")

    def poll(self) -> int | None:
        """Exit code, -N for signal N, or None while it runs."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return None if self.returncode is None else int(self.returncode)


def prepare() -> None:
    """To be called before the environment is changed: where the process's title lies is found by it."""
    setproctitle.getproctitle()


def possible() -> bool:
    """Whether this process may fork: Linux, and no thread that could hold a lock in the child for ever."""
    try:
        return sys.platform == "linux" and len(list(Path("/proc/self/task").iterdir())) == 1
    except OSError:
        return False


def start(module: str, args: Sequence[str], env: dict[str, str], first: Callable[[], None]) -> Forked:
    """Fork and run `python -m module args` in the child with `env` added to the environment; `first` runs in it before all else.

    Raises OSError if there is no process, or no pipe, to be had.
    """
    out_r, out_w = os.pipe()
    err_r, err_w = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        _child(module, args, env, first, out_w, err_w)
    os.close(out_w)
    os.close(err_w)
    try:
        os.setpgid(pid, pid)  # here too: whoever comes second finds it done
    except OSError:
        pass
    return Forked(pid, out_r, err_r)


def _child(
    module: str, args: Sequence[str], env: dict[str, str], first: Callable[[], None], out: int, err: int
) -> NoReturn:
    code = 1
    try:
        os.setpgid(0, 0)
        first()
        for s in SIGNALS:
            signal.signal(s, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        gc.freeze()  # objects of the launcher are never looked at again, nor closed
        _streams(out, err)
        atexit._clear()  # the launcher's
        os.environ.update(env)
        sys.argv = [module, *args]
        _title(module, args)
        forget(STRANGERS.get(module, ()))
        code = _run(module)
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:  # nobody reads it any more
                continue
    except BaseException:
        os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)


def _streams(out: int, err: int) -> None:
    """Standard streams of its own; every other file of the launcher becomes /dev/null under its number: no pipe stays open at
    this end, and an object of the launcher's that goes closes nothing of ours."""
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    os.dup2(out, 1)
    os.dup2(err, 2)
    for number in [int(p.name) for p in Path("/proc/self/fd").iterdir()]:
        if number > 2 and number != null:
            os.dup2(null, number, inheritable=False)
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", buffering=1, closefd=False)  # noqa: SIM115


def _title(module: str, args: Sequence[str]) -> None:
    """What `ps` and `pkill -f` see: the command, not the launcher's."""
    setproctitle.setproctitle(" ".join([sys.executable, "-m", module, *args]))
    setproctitle.setthreadtitle(module)


def _run(module: str) -> int:
    """The program's entry point; its exit code as the interpreter would have it."""
    try:
        importlib.import_module(f"{module}.__main__").main()
    except SystemExit as e:
        if e.code is None or isinstance(e.code, int):
            return e.code or 0
        print(e.code, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    return 0


class _Closed(importlib.abc.MetaPathFinder):
    """Finds nothing of some packages, and says so."""

    def __init__(self, packages: Sequence[str]) -> None:
        self.packages = packages

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """None for others. Raises ImportError for these."""
        if name.partition(".")[0] in self.packages:
            raise ImportError(f"{name} is not for this program")
        return None


def forget(packages: Sequence[str]) -> None:
    """Take packages out of this process: what is imported of them goes, and nothing of them can be imported again."""
    if packages:
        for name in [n for n in sys.modules if n.partition(".")[0] in packages]:
            del sys.modules[name]
        sys.meta_path.insert(0, _Closed(packages))
