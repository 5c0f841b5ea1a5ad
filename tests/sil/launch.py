"""How tests start the launcher: called in this process, or as a user would, in a process of its own with a bounded wait."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from hil_scripts import sil as launcher
from tests.forks import Forked

TIMEOUT_S = 240.0  # generous: a cold machine compiles kernels first


@dataclass(frozen=True)
class Ended:
    """A finished launcher: exit code and everything it printed."""

    code: int
    text: str


def sil(*args: object, cwd: Path | None = None) -> Ended:
    """Call `sil ARGS` here: no new interpreter, nothing imported twice. Runs of several processes start them all the same."""
    with contextlib.chdir(cwd or Path.cwd()):
        r = CliRunner().invoke(launcher.app, [str(a) for a in args], env={"COLUMNS": "200"})
    if r.exception is not None and not isinstance(r.exception, SystemExit):
        raise r.exception
    return Ended(r.exit_code, r.output)


def start(*args: object, out: Path, first: Callable[[], object] | None = None) -> Forked:
    """Start `sil ARGS`, after a call of `first`; its words go to the file `out`."""
    with pytest.MonkeyPatch.context() as m:
        m.setenv("COLUMNS", "200")
        return Forked("hil_scripts.sil", *args, out=out, first=first)


def apart(*args: object, out: Path, first: Callable[[], object] | None = None) -> Ended:
    """`sil ARGS` in a process of its own, to its end: whose runs of several processes fork them, as a user's do."""
    code = start(*args, out=out, first=first).wait(TIMEOUT_S)
    return Ended(code, out.read_text())


def wait_for(condition: Callable[[], bool], seconds: float = TIMEOUT_S) -> bool:
    """Poll until `condition()` or the time is over."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return False


def summary(run: Path) -> dict[str, Any]:
    """summary.json of a run folder."""
    return dict(json.loads((run / "summary.json").read_text()))


def processes(run: Path) -> dict[int, str]:
    """pid -> command line of every living process that names the run folder, launchers and zombies left out."""
    found = {}
    for p in Path("/proc").iterdir():
        if not p.name.isdigit():
            continue
        try:
            args = (p / "cmdline").read_bytes().split(b"\0")
            state = (p / "stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        line = b" ".join(args).decode("utf-8", "replace")
        if str(run) in line and "hil_scripts.sil" not in line and state != "Z":
            found[int(p.name)] = line
    return found
