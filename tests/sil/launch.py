"""How tests start the launcher: called in this process, or as a user would, in a process of its own with a bounded wait."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from hil_scripts import sil as launcher

TIMEOUT_S = 240.0  # generous: a cold machine compiles kernels first


@dataclass(frozen=True)
class Ended:
    """A finished launcher: exit code and everything it printed."""

    code: int
    text: str


def command(*args: object) -> list[str]:
    return [sys.executable, "-m", "hil_scripts.sil", *(str(a) for a in args)]


def sil(*args: object, cwd: Path | None = None) -> Ended:
    """Call `sil ARGS` here: no new interpreter, nothing imported twice. Runs of several processes start them all the same."""
    with contextlib.chdir(cwd or Path.cwd()):
        r = CliRunner().invoke(launcher.app, [str(a) for a in args], env={"COLUMNS": "200"})
    if r.exception is not None and not isinstance(r.exception, SystemExit):
        raise r.exception
    return Ended(r.exit_code, r.output)


def start(*args: object, out: Path) -> subprocess.Popen[bytes]:
    """Start `sil ARGS`; its words go to the file `out`."""
    with out.open("wb") as f:
        return subprocess.Popen(
            command(*args), stdout=f, stderr=subprocess.STDOUT, env={**os.environ, "COLUMNS": "200"}
        )


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
