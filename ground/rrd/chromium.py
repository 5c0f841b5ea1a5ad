"""A headless Chromium with a software renderer, driven through chromedriver by W3C WebDriver: address, script, picture."""

from __future__ import annotations

import base64
import io
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
DRAWN, SAME, PAUSE_S = 150, 0.004, 6.0  # [pixel] of the colour; share of pixels two pictures may differ in; [s]
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--hide-scrollbars", "--no-first-run",
)  # fmt: skip


def missing() -> str:
    """What is not installed, "" if nothing."""
    browser = next((b for b in BROWSERS if shutil.which(b)), None)
    if browser is None:
        return "no Chromium: apt-get install -y chromium chromium-driver"
    return "" if shutil.which("chromedriver") else "no chromedriver: apt-get install -y chromium-driver"


def pixels(png: bytes) -> NDArray[np.int16]:
    """A picture as numbers [height, width, 3]."""
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int16)


def count(picture: NDArray[np.int16], color: tuple[int, int, int]) -> int:
    """Pixels of a colour, or nearly."""
    return int((np.abs(picture - np.array(color)).max(axis=2) < 12).sum())


class Chromium:
    """One window; use as a context manager. `dark`: what pages are told of the user's taste."""

    def __init__(self, size: tuple[int, int] = (1600, 900), dark: bool = True) -> None:
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            self.at = f"http://127.0.0.1:{s.getsockname()[1]}"
        port = self.at.rsplit(":", 1)[1]
        self.driver = subprocess.Popen(
            [str(shutil.which("chromedriver")), f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        args = [*FLAGS, f"--window-size={size[0]},{size[1]}"]
        binary = next(str(shutil.which(b)) for b in BROWSERS if shutil.which(b))
        want = {"browserName": "chrome", "goog:chromeOptions": {"args": args, "binary": binary}}
        end = time.monotonic() + 60.0
        while True:
            try:
                answer = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": want}})
                break
            except (ConnectionError, urllib.error.URLError):
                if time.monotonic() > end or self.driver.poll() is not None:
                    raise
                time.sleep(0.2)
        self.session = f"/session/{answer['sessionId']}"
        taste = {"features": [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]}
        self.cdp("Emulation.setEmulatedMedia", taste)

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        call = urllib.request.Request(self.at + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(call, timeout=300.0) as answer:
            return json.load(answer)["value"]

    def cdp(self, command: str, params: dict[str, Any]) -> Any:
        """A command of Chromium's own protocol."""
        return self._ask("POST", f"{self.session}/goog/cdp/execute", {"cmd": command, "params": params})

    def open(self, address: str) -> None:
        """Go to a page and wait for it to be loaded."""
        self._ask("POST", f"{self.session}/url", {"url": address})

    def run(self, script: str, *args: object) -> Any:
        """The value a script returns."""
        return self._ask("POST", f"{self.session}/execute/sync", {"script": script, "args": list(args)})

    def click(self, css: str) -> None:
        """Click the first element a selector finds."""
        found = self._ask("POST", f"{self.session}/element", {"using": "css selector", "value": css})
        self._ask("POST", f"{self.session}/element/{next(iter(found.values()))}/click", {})

    def picture(self, out: Path | None = None) -> bytes:
        """What is seen, as PNG."""
        png = base64.b64decode(self._ask("GET", f"{self.session}/screenshot"))
        if out is not None:
            out.write_bytes(png)
        return png

    def settled(self, within_s: float, out: Path, color: tuple[int, int, int]) -> None:
        """Picture of a page that draws by itself, once two in a row are nearly equal and a colour is in them. Raises TimeoutError
        (the last picture is left in `out`)."""
        end, before = time.monotonic() + within_s, None
        while True:
            now = pixels(self.picture(out))
            if (
                count(now, color) >= DRAWN
                and before is not None
                and (np.abs(now - before).max(axis=2) > 24).mean() < SAME
            ):
                return
            if time.monotonic() > end:
                raise TimeoutError(f"the page was not drawn within {within_s:.0f} s")
            before = now
            time.sleep(PAUSE_S)

    def __enter__(self) -> Chromium:
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        try:
            self._ask("DELETE", self.session)
        except OSError:
            pass
        finally:
            self.driver.terminate()
            self.driver.wait(10.0)
