"""`ground screenshot`: a picture of a run without a display, by Rerun's own headless mode on a software renderer."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
from pathlib import Path


class ScreenshotError(Exception):
    """No picture; the message says what is missing."""


def viewer() -> Path:
    """The native viewer binary of the installed rerun-sdk. Raises ScreenshotError if there is none."""
    spec = importlib.util.find_spec("rerun_cli")  # the binary itself: its Python wrapper would outlive a kill
    for folder in spec.submodule_search_locations or [] if spec else []:
        path = Path(folder) / "rerun"
        if path.exists():
            return path
    found = shutil.which("rerun")
    if found is None:
        raise ScreenshotError("no rerun viewer: install rerun-sdk (make env)")
    return Path(found)


def screenshot(rrd: Path, out: Path, size: str = "1600x900", timeout_s: float = 120.0) -> Path:
    """Picture of `rrd` as the embedded blueprint shows it. Raises ScreenshotError with the viewer's own words."""
    if not rrd.exists():
        raise ScreenshotError(f"{str(rrd)!r} does not exist: run `ground convert` first")
    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise ScreenshotError(f"size {size!r} is not WIDTHxHEIGHT in pixels")
    out.unlink(missing_ok=True)
    command = [str(viewer()), "--headless", "--window-size", size, "--screenshot-to", str(out), str(rrd)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s)
    except subprocess.TimeoutExpired as exc:
        raise ScreenshotError(f"the viewer gave no picture within {timeout_s:.0f} s") from exc
    if done.returncode != 0 or not out.exists():
        words = "\n".join(done.stderr.strip().splitlines()[-6:])
        hint = "a software Vulkan driver is needed: apt-get update && apt-get install -y mesa-vulkan-drivers"
        raise ScreenshotError(f"the viewer ended with code {done.returncode} and no picture; {hint}\n{words}")
    return out
