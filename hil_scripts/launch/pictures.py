"""Pictures of scenarios for the pages: each is flown in one process and shown at the moment that matters, in both themes."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from hil_scripts.launch import inproc, screen
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import make_folder, resolve, write_meta

THEMES = {"": [], "-light": ["--light"]}  # ending of the file's name -> options of `ground screenshot`
SIZE = "1600x900"


class PictureError(RuntimeError):
    """A picture could not be made; the text is what `ground screenshot` says."""


def make(
    names: Sequence[str], out: Path, themes: Sequence[str], duration_s: float | None, stop: StopFlag
) -> Iterator[Path]:
    """Fly scenarios and picture them into a folder; each file as it is there. `themes`: keys of `THEMES`. Raises PictureError,
    and what flying a scenario raises."""
    out.mkdir(parents=True, exist_ok=True)
    for name in names:
        with tempfile.TemporaryDirectory(prefix="wakefield-") as tmp:
            plan = resolve(name, None, [], duration_s)
            run = make_folder(plan, Path(tmp) / name)
            write_meta(run, plan, mode="in-process")
            inproc.fly(plan, run, screen.console(quiet=True), stop)
            for ending in themes:
                if stop:
                    return
                path = out / f"{name}{ending}.png"
                command = [sys.executable, "-m", "ground", "screenshot", str(run), "--out", str(path), "--size", SIZE]
                done = subprocess.run([*command, *THEMES[ending]], capture_output=True, text=True, check=False)
                if done.returncode:
                    raise PictureError(f"{name}: {done.stderr.strip() or done.stdout.strip()}")
                yield path
