"""The UDP ports of a run (plan in flightsw/icd/link.py) and a check that nobody else holds them."""

from __future__ import annotations

import errno
import socket
from collections.abc import Collection, Iterable

from flightsw.icd.link import GROUND_PORT, WATCH_PORT, plant_command_port, plant_port, telemetry_port

HOST = "127.0.0.1"


class PortBusyError(OSError):
    """A port the run needs is held by another program; the text names port and purpose."""


def needed(names: dict[int, str], offset: int, watched: bool = False, external: Collection[str] = ()) -> dict[int, str]:
    """Port -> purpose for the aircraft {sysid: name}; `watched`: of a run that is drawn as it flies;
    `external`: names of those whose ports are another computer's."""
    out = {GROUND_PORT + offset: "ground telemetry", plant_command_port(offset): "commands to the plant"}
    if watched:
        out[WATCH_PORT + offset] = "live picture"
    for sysid, name in names.items():
        if name in external:
            continue
        out[plant_port(sysid, offset)] = f"plant link of {name}"
        out[telemetry_port(sysid, offset)] = f"telemetry of {name}"
    return out


def check_free(ports: dict[int, str]) -> None:
    """Bind and release every port. Raises PortBusyError naming the first one taken or out of range."""
    for port, purpose in ports.items():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
            try:
                s.bind((HOST, port))
            except OverflowError:
                text = f"UDP port {port} ({purpose}) is out of range: lower --port-offset"
                raise PortBusyError(text) from None
            except OSError as e:
                if e.errno != errno.EADDRINUSE:
                    raise
                raise PortBusyError(
                    f"UDP port {port} ({purpose}) is in use by another program; stop it, or pass --port-offset N"
                ) from None


def free_offset(names: dict[int, str], candidates: Iterable[int]) -> int:
    """First of `candidates` with all ports free. Raises PortBusyError if none is."""
    for offset in candidates:
        try:
            check_free(needed(names, offset))
        except PortBusyError:
            continue
        return offset
    raise PortBusyError("no free block of UDP ports found")
