"""Keys of the terminal while a run flies in lockstep: p pauses, r resumes, s flies one tick, + and - change the speed."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Any

from flightsw.icd.link import UdpLink, plant_command_port
from flightsw.icd.scaling import COMP_PLANT
from flightsw.icd.signing import OPEN, STATION, Security
from flightsw.icd.wire import Sender
from hil_scripts.launch.ports import HOST
from sim_plant.pace import CMD_PACE, PAUSE, RESUME, SPEED, STEP

STATION_IDS = (255, 191)  # system and component of the launcher
HELP = "keys: p pause, s one tick, r resume, + faster, - slower"


def own_terminal() -> int | None:
    """The terminal on stdin, if there is one and this process is in front of it: one in the background may not touch it."""
    try:
        fd = sys.stdin.fileno()
        return fd if os.isatty(fd) and os.tcgetpgrp(fd) == os.getpgrp() else None
    except (AttributeError, OSError, ValueError):
        return None


class PaceKeys:
    """Context manager: reads single keys of `fd` and sends what they mean to the plant; without a terminal it does nothing."""

    def __init__(
        self, sysid: int, port_offset: int, speed: float, fd: int | None = None, security: Security = OPEN
    ) -> None:
        self._fd = own_terminal() if fd is None else fd
        self._sysid, self._to, self._speed = sysid, (HOST, plant_command_port(port_offset)), speed
        self._security = security
        self._old: Any = None
        self._link: UdpLink | None = None
        self._sender = Sender(*STATION_IDS)

    @property
    def plant_args(self) -> list[str]:
        """Options of sim-plant."""
        return ["--speed", str(self._speed)] if self._speed else []

    @property
    def on(self) -> bool:
        """Whether there is a terminal."""
        return self._fd is not None

    def __enter__(self) -> PaceKeys:
        if self._fd is not None:
            self._old = termios.tcgetattr(self._fd)
            tty.setcbreak(self._fd)
            self._link = UdpLink(0, "keys of the launcher", security=self._security, ident=STATION)
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        if self._fd is not None and self._link is not None:
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._old)
            self._link.close()

    def poll(self) -> None:
        """Act on the keys that have been pressed."""
        while self._fd is not None and select.select([self._fd], [], [], 0.0)[0]:
            pressed = os.read(self._fd, 64)
            if not pressed:
                return
            for key in pressed.decode("ascii", "replace"):
                self._act(key.lower())

    def _act(self, key: str) -> None:
        if key in "+-":
            self._speed = max(0.125, min((self._speed or 1.0) * (2.0 if key == "+" else 0.5), 1000.0))
        orders = {
            "p": (PAUSE, 0.0),
            "r": (RESUME, 0.0),
            "s": (STEP, 1.0),
            "+": (SPEED, self._speed),
            "-": (SPEED, self._speed),
        }
        if key in orders and self._link is not None:
            what, number = orders[key]
            fields = {"param1": float(what), "param2": number}
            self._link.send(
                self._sender.named(
                    "COMMAND_LONG", target_system=self._sysid, target_component=COMP_PLANT, command=CMD_PACE, **fields
                ),
                self._to,
            )
