"""A picture of a run without a display: Rerun's headless viewer on a software renderer, driven through its client.

`rerun --screenshot-to` takes its picture after a few frames, loaded or not; here the viewer is asked until the run has
arrived, the time cursor is set, and only then the picture is taken.
"""

from __future__ import annotations

import socket
import subprocess
import time
from pathlib import Path

from rerun.experimental import ViewerClient

from ground.rrd.palette import NAV
from ground.rrd.viewer import in_browser, viewer

MESA = "a software Vulkan driver is needed: apt-get update && apt-get install -y mesa-vulkan-drivers"
START_S, LOAD_S = 30.0, 60.0  # [s] longest waits for the viewer and for the run
PAGE_S, BAR = 240.0, 143  # [s] longest wait for a page that does not change; [px] of the window are not the page
NOTICES_S = 6.0  # [s] the viewer's pop-up notices fade after this


class ScreenshotError(Exception):
    """No picture; the message says what is missing."""


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


def _client(process: subprocess.Popen[str], port: int) -> ViewerClient:
    """Client of the viewer just started. Raises ScreenshotError if the viewer ends or never answers."""
    end = time.monotonic() + START_S
    while time.monotonic() < end:
        if process.poll() is not None:
            words = "\n".join((process.stdout.read() if process.stdout else "").strip().splitlines()[-6:])
            raise ScreenshotError(f"the viewer ended with code {process.returncode}; {MESA}\n{words}")
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
            return client
        except Exception:  # the binding raises plain exceptions of several kinds until the server listens
            time.sleep(0.2)
    raise ScreenshotError(f"the viewer did not answer within {START_S:.0f} s; {MESA}")


def in_page(rrd: Path, out: Path, size: str = "1600x900", dark: bool = False) -> Path:
    """Picture of `rrd` in a browser, whose theme can be chosen, the cursor where its blueprint puts it. Raises
    ScreenshotError."""
    from ground.rrd.chromium import Chromium, missing

    if why := missing():
        raise ScreenshotError(why)
    width, height = _size(size)
    shown = in_browser(0, 0, recording=str(rrd.resolve()), theme="dark" if dark else "light")
    shown.start()
    try:
        end = time.monotonic() + START_S
        while not shown.there and time.monotonic() < end:
            time.sleep(0.2)
        with Chromium((width, height + BAR), dark) as browser:
            browser.open(shown.page)
            browser.settled(PAGE_S, out, NAV)
    except OSError as exc:
        raise ScreenshotError(f"the browser gave no picture: {exc}") from exc
    finally:
        shown.stop()
    return out


def _size(size: str) -> tuple[int, int]:
    """Width and height of "1600x900". Raises ScreenshotError."""
    width, _, height = size.partition("x")
    if not (width.isdigit() and height.isdigit()):
        raise ScreenshotError(f"size {size!r} is not WIDTHxHEIGHT in pixels")
    return int(width), int(height)


def screenshot(rrd: Path, out: Path, size: str = "1600x900", at_s: float | None = None) -> Path:
    """Picture of `rrd` as the embedded blueprint shows it, cursor at `at_s` [s]. Raises ScreenshotError."""
    if not rrd.exists():
        raise ScreenshotError(f"{str(rrd)!r} does not exist: run `ground convert` first")
    _size(size)
    out.unlink(missing_ok=True)
    port = _free_port()
    command = [str(viewer()), "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", size]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        client = _client(process, port)
        client.open(str(rrd.resolve()))
        end = time.monotonic() + LOAD_S
        while client.get_state().loading and time.monotonic() < end:
            time.sleep(0.2)
        if at_s is not None:
            client.set_time("sim_time", duration=at_s, play_state="paused")
        time.sleep(NOTICES_S)
        client.save_screenshot(str(out.resolve()))
    except ScreenshotError:
        raise
    except Exception as exc:
        raise ScreenshotError(f"the viewer gave no picture: {exc}; {MESA}") from exc
    finally:
        process.kill()
        process.wait()
    if not out.exists():
        raise ScreenshotError(f"the viewer wrote nothing to {str(out)!r}")
    return out
