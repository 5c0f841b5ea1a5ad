"""`ground live`: all aircraft on one screen, from telemetry on the operator's port. Without a terminal, a line a
second.

Only the newest packet of each kind is kept; it is decoded when the screen is drawn.
"""

from __future__ import annotations

import math
import select
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from flightsw.icd.signing import REASONS, Signing
from flightsw.icd.texts import Joiner
from ground.link.merge import SequenceGaps
from ground.link.packets import NAMES, Fields, decode, health_words, packet_id, packet_time_us, phase_name, split
from ground.views import registry
from ground.views.base import NOT_CURRENT, NOT_VALID
from ground.views.registry import usual_names

STALE_S = 2.0  # [s] wall time without data after which the stream counts as stopped
OLD_S = 3.0  # [s] the aircraft's time: a message whose own sample is older than that no longer says how things are
REFRESH_S = 0.25  # [s]


@cache
def own_time() -> frozenset[str]:
    """Messages stamped with their own sample, which may be long past; all others with the tick they were sent in."""
    return frozenset(name for view in registry.views().values() for name in view.own_time)


@cache
def alarms() -> dict[str, Callable[[Fields], str]]:
    """Message -> words of an alarm in it."""
    return {name: words for view in registry.views().values() for name, words in view.alarms.items()}


@dataclass(frozen=True)
class Line:
    """A line of the screen; bad: in red."""

    label: str
    text: str
    bad: bool = False


class Vehicle:
    """Newest packets of one aircraft: what a view is told of it (ground.views.base.Heard)."""

    def __init__(self, sysid: int, now: float) -> None:
        self.sysid = sysid
        self.packets: dict[str, bytes] = {}
        self._at_us: dict[str, int] = {}  # when they were heard, of those without a stamp of their own
        self.count = 0
        self.rate = 0.0  # [1/s] wall time
        self.t_us = 0
        self.heard = now
        self.text = ""
        self._joiner = Joiner()
        self._alarms: dict[str, tuple[str, int]] = {}  # the last of each message, kept on the screen after it is over
        self._mark = (now, 0)

    def take(self, packet: bytes, now: float) -> None:
        """Keep a packet."""
        name = NAMES[packet_id(packet)]
        self.packets[name] = packet
        self.count += 1
        self.heard = now
        t_us = packet_time_us(packet)
        if t_us is None:
            self._at_us[name] = self.t_us
        elif t_us > self.t_us or name not in own_time():
            self.t_us = t_us
        if name == "STATUSTEXT":
            f = decode(packet)
            self.text = self._joiner.take(packet[5], packet[6], f["text"], f["id"], f["chunk_seq"]) or self.text
        elif name in alarms():  # now, not when the screen is drawn: an alarm may last one sample
            words = alarms()[name](decode(packet))
            if words:
                self._alarms[name] = words, self.t_us

    def tick(self, now: float) -> None:
        """Update the message rate about once a second."""
        since, count = self._mark
        if now - since >= 1.0:
            self.rate = (self.count - count) / (now - since)
            self._mark = (now, self.count)

    def alarm(self, name: str) -> tuple[str, int] | None:
        """Words and time [us] of the last alarm in a message, None if there was none."""
        return self._alarms.get(name)

    def get(self, name: str) -> Fields | None:
        """Decoded newest packet of a message, None if there was none."""
        packet = self.packets.get(name)
        return decode(packet) if packet else None

    def age_s(self, name: str) -> float:
        """How far the newest sample of a message lies behind the newest of all [s]; infinite if there was none."""
        packet = self.packets.get(name)
        if packet is None:
            return math.inf
        t_us = packet_time_us(packet)
        return (self.t_us - (self._at_us[name] if t_us is None else t_us)) * 1e-6


def wind_words(wind: list[float], sigma: list[float]) -> str:
    """Wind as speed, direction it blows from, vertical part and uncertainty."""
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    return f"{speed:.1f} m/s from {source:03.0f}, down {wind[2]:+.1f} (3 sigma {3 * max(sigma):.1f})"


def describe(v: Vehicle, now: float) -> list[Line]:
    """What the screen says about one aircraft, in order. Nothing is said that is not valid or no longer so."""
    out: list[Line] = []
    silent = now - v.heard
    if silent > STALE_S:
        out.append(Line("data", f"no data for {silent:.0f} s", True))

    def put(label: str, source: str, words: str, bad: bool = False) -> None:
        age = v.age_s(source)
        words = words if age <= OLD_S else f"{NOT_CURRENT} for {age:.0f} s"
        out.append(Line(label, words, bad or any(word in words for word in (NOT_VALID, NOT_CURRENT))))

    if mission := v.get("MISSION_STATUS"):
        words = f"{phase_name(mission['phase'])} for {mission['phase_time']:.0f} s  {mission['reason']}"
        put("phase", "MISSION_STATUS", words)
    out.append(Line("time", f"{v.t_us * 1e-6:.1f} s"))
    nav = v.get("NAV_STATE")
    good = nav is not None and nav["valid"]
    if nav:
        put("speed", "NAV_STATE", f"{nav['V']:.1f} m/s" if good else "navigation not valid")
        put("bank", "NAV_STATE", f"{math.degrees(nav['phi']):+.1f} deg" if good else NOT_VALID)
        put("wind", "NAV_STATE", wind_words(nav["wind"], nav["wind_sigma"]) if good else NOT_VALID)
    if place := v.get("LOCAL_POSITION_NED"):
        put("altitude", "LOCAL_POSITION_NED", f"{-place['z']:.0f} m" if good or nav is None else NOT_VALID)
    for view in registry.views().values():
        for said in view.words(v):
            put(said.label, said.source, said.text, said.bad)
    if health := v.get("HEALTH_STATUS"):
        put("health", "HEALTH_STATUS", health_words(health["failed"]), bool(health["failed"]))
    out.append(Line("messages", f"{v.rate:.0f} /s"))
    if v.text:
        out.append(Line("text", v.text))
    return out


class Monitor:
    """All aircraft heard, and what was wrong on the way."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, signing: Signing | None = None) -> None:
        self.clock, self.signing = clock, signing
        self.vehicles: dict[int, Vehicle] = {}
        self.gaps = SequenceGaps()
        self.junk = 0
        self.started = clock()

    def take(self, datagram: bytes) -> None:
        """Account for one datagram; rubbish is counted."""
        now = self.clock()
        if self.signing is not None:
            datagram = self.signing.check(datagram)
        for packet, fault in split(datagram):
            if fault:
                self.junk += 1
                continue
            sysid = packet[5]
            self.gaps.see(sysid, packet[6], packet[4])
            self.vehicles.setdefault(sysid, Vehicle(sysid, now)).take(packet, now)

    def lines(self) -> list[str]:
        """Plain text, one line per aircraft."""
        now = self.clock()
        if not self.vehicles:
            return [f"no data for {now - self.started:.0f} s", *self.refused()]
        out = self.refused()
        for sysid, v in sorted(self.vehicles.items()):
            v.tick(now)
            parts = [f"{line.label} {line.text}" for line in describe(v, now)]
            out.append(f"{usual_names().get(sysid, f'sysid {sysid}')}: " + "; ".join(parts))
        return out

    def refused(self) -> list[str]:
        """A line about what signing refused, if it refused anything."""
        if self.signing is None or not self.signing.refused.total:
            return []
        counts = zip(REASONS, self.signing.refused.counts(), strict=True)
        return [f"refused: {', '.join(f'{word} {n}' for word, n in counts if n)}"]

    def screen(self) -> Group:
        """The rich picture."""
        now = self.clock()
        panels: list[Any] = []
        for sysid, v in sorted(self.vehicles.items()):
            v.tick(now)
            grid = Table.grid(padding=(0, 2))
            grid.add_column(style="dim", min_width=9)
            grid.add_column()
            for line in describe(v, now):
                grid.add_row(line.label, Text(line.text, style="bold red" if line.bad else ""))
            panels.append(
                Panel(grid, title=f"{usual_names().get(sysid, 'aircraft')} (sysid {sysid})", title_align="left")
            )
        if not panels:
            panels.append(Text(f"no data for {now - self.started:.0f} s", style="bold red"))
        lost = sum(self.gaps.dropped.values())
        panels += [Text(line, style="bold red") for line in self.refused()]
        panels.append(Text(f"lost {lost}   junk {self.junk}   Ctrl-C ends", style="dim"))
        return Group(*panels)


def _pump(sock: socket.socket, monitor: Monitor, wait_s: float) -> None:
    """Take datagrams for `wait_s` [s]."""
    end = time.monotonic() + wait_s
    while (left := end - time.monotonic()) > 0.0:
        if not select.select([sock], [], [], left)[0]:
            return
        try:
            while True:
                monitor.take(sock.recv(65536))
        except BlockingIOError:
            continue
        except OSError:
            continue


def watch(sock: socket.socket, for_s: float | None = None, signing: Signing | None = None) -> int:
    """Show what arrives on the (non-blocking) socket until Ctrl-C or for `for_s` [s]; returns the exit code."""
    monitor = Monitor(signing=signing)
    end = math.inf if for_s is None else time.monotonic() + for_s
    try:
        if sys.stdout.isatty():
            with Live(monitor.screen(), console=Console(), refresh_per_second=4, screen=False) as live:
                while time.monotonic() < end:
                    _pump(sock, monitor, REFRESH_S)
                    live.update(monitor.screen())
        else:
            while time.monotonic() < end:
                _pump(sock, monitor, 1.0)
                print("\n".join(monitor.lines()), flush=True)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        return 1
    return 0 if monitor.vehicles else 1
