"""The programs that show a live picture: Rerun's native viewer, or its server of pages and data for a browser. Both listen on
loopback and keep no more than a limit of memory. The server is a child that ends with us; a native viewer stays open.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

HOST = "127.0.0.1"
GRPC_PORT, WEB_PORT = 9876, 9090  # Rerun's usual ones
SERVER_MEMORY = "512MB"  # kept for pages opened later
VIEWER_MEMORY = "1GB"
NICE = 10  # the flight goes first
READY_S = 60.0  # [s] a server has to begin listening
PR_SET_PDEATHSIG = 1  # linux/prctl.h


class ViewerError(OSError):
    """No viewer; the text says what is missing."""


def viewer() -> Path:
    """The native viewer binary of the installed rerun-sdk (its Python wrapper would outlive a kill). Raises ViewerError if there
    is none."""
    spec = importlib.util.find_spec("rerun_cli")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        path = Path(folder) / "rerun"
        if path.exists():
            return path
    raise ViewerError("no rerun viewer: install rerun-sdk (make env)")


def listening(port: int) -> bool:
    """Whether somebody listens on a TCP port of this machine."""
    with socket.socket() as s:
        s.settimeout(0.2)
        return s.connect_ex((HOST, port)) == 0


def free_port(wanted: int) -> int:
    """A TCP port nobody holds: the wanted one if it is free."""
    for port in (wanted, 0):
        with socket.socket() as s:
            s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                s.bind((HOST, port))
            except OSError:
                continue
            return int(s.getsockname()[1])
    raise ViewerError("no free TCP port")


def _bound_to_us() -> None:
    """In the child: end with the parent, whatever ends that one; hear no Ctrl-C of the terminal."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)


@dataclass
class Viewer:
    """Where a picture is sent. `url`: for SDKs; `page`: for a browser, "" for the native viewer, `web`: its
    port; `own`: started here."""

    port: int
    page: str = ""
    web: int = 0
    command: tuple[str, ...] = ()
    own: subprocess.Popen[bytes] | None = None
    starts: int = 0

    @property
    def url(self) -> str:
        """Address of its data."""
        return f"rerun+http://{HOST}:{self.port}/proxy"

    @property
    def there(self) -> bool:
        """Whether it takes connections."""
        return (self.own is None or self.own.poll() is None) and listening(self.port)

    def start(self, binding: bool = True) -> None:
        """Start its program; `binding`: it ends with us. Raises ViewerError if it cannot be."""
        self.starts += 1
        try:
            self.own = subprocess.Popen(
                self.command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                process_group=0,
                preexec_fn=_bound_to_us if binding else None,
            )
        except OSError as e:
            raise ViewerError(f"{self.command[0]}: cannot be started: {e.strerror}") from None

    def begin(self) -> None:
        """Start its program and wait until data and page can be had. Raises ViewerError if it ends before or takes too long."""
        self.start()
        assert self.own is not None
        end = time.monotonic() + READY_S
        while not (self.there and (not self.web or listening(self.web))):
            if self.own.poll() is not None or time.monotonic() > end:
                raise ViewerError(f"{self.command[0]}: not ready within {READY_S:g} s")
            time.sleep(0.05)

    def stop(self) -> None:
        """End what was started here."""
        if self.own is not None and self.own.poll() is None:
            self.own.terminate()
            try:
                self.own.wait(2.0)
            except subprocess.TimeoutExpired:
                self.own.kill()
                self.own.wait()


def in_browser(
    web_port: int = WEB_PORT,
    grpc_port: int = GRPC_PORT,
    memory: str = SERVER_MEMORY,
    recording: str = "",
    theme: str = "",
) -> Viewer:
    """A server of page and data, of a recording's if one is named; ports that are taken are replaced by free ones."""
    web, data = free_port(web_port), free_port(grpc_port)
    command: tuple[str, ...] = (
        str(viewer()),
        "--serve-web",
        "--bind",
        HOST,
        "--port",
        str(data),
        "--web-viewer-port",
        str(web),
    )
    command += ("--server-memory-limit", memory, "--hide-welcome-screen")
    command += (recording,) if recording else ()
    out = Viewer(data, web=web, command=command)
    out.page = (
        f"http://{HOST}:{web}/?url={quote(out.url, safe='')}&hide_welcome_screen=1{f'&theme={theme}' if theme else ''}"
    )
    return out


def native(grpc_port: int = GRPC_PORT, memory: str = VIEWER_MEMORY) -> Viewer:
    """The native viewer: one that is open already, else one that is started. Raises ViewerError without a display."""
    out = Viewer(grpc_port)
    if listening(grpc_port):
        return out
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerError(
            "no display for the native viewer: use --web, or open one and tell its port with --viewer-port"
        )
    command = (str(viewer()), "--bind", HOST, "--port", str(grpc_port), "--memory-limit", memory)
    out.command = (*command, "--hide-welcome-screen", "--expect-data-soon")
    return out
