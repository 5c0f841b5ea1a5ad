"""`ground live`: both aircraft on one screen, from telemetry on the operator's port. Without a terminal, a line a
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
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from ground.airdata import alarm_words, fdi_words, wake_words
from ground.merge import SequenceGaps
from ground.packets import AIRCRAFT, NAMES, decode, health_words, packet_id, packet_time_us, phase_name, split

STALE_S = 2.0  # [s] wall time without data after which the stream counts as stopped
REFRESH_S = 0.25  # [s]


class Vehicle:
    """Newest packets of one aircraft."""

    def __init__(self, sysid: int, now: float) -> None:
        self.sysid = sysid
        self.packets: dict[str, bytes] = {}
        self.count = 0
        self.rate = 0.0  # [1/s] wall time
        self.t_us = 0
        self.heard = now
        self.text = ""
        self.alarm = ""  # the last air-data alarm and its time, kept on the screen after it is over
        self.alarm_us = 0
        self._mark = (now, 0)

    def take(self, packet: bytes, now: float) -> None:
        """Keep a packet."""
        name = NAMES[packet_id(packet)]
        self.packets[name] = packet
        self.count += 1
        self.heard = now
        t_us = packet_time_us(packet)
        if t_us is not None:
            self.t_us = t_us
        if name == "STATUSTEXT":
            self.text = decode(packet)["text"]
        elif name == "FDI_STATUS":  # now, not when the screen is drawn: an alarm may last one sample
            words = alarm_words(decode(packet))
            if words:
                self.alarm, self.alarm_us = words, self.t_us

    def tick(self, now: float) -> None:
        """Update the message rate about once a second."""
        since, count = self._mark
        if now - since >= 1.0:
            self.rate = (self.count - count) / (now - since)
            self._mark = (now, self.count)

    def get(self, name: str) -> dict[str, Any] | None:
        """Decoded newest packet of a message, None if there was none."""
        packet = self.packets.get(name)
        return decode(packet) if packet else None


def wind_words(wind: list[float], sigma: list[float]) -> str:
    """Wind as speed, direction it blows from, vertical part and uncertainty."""
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    return f"{speed:.1f} m/s from {source:03.0f}, down {wind[2]:+.1f} (3 sigma {3 * max(sigma):.1f})"


def describe(v: Vehicle, now: float) -> dict[str, str]:
    """What the screen says about one aircraft: label -> text, in order."""
    out: dict[str, str] = {}
    silent = now - v.heard
    mission, nav, rel = v.get("MISSION_STATUS"), v.get("NAV_STATE"), v.get("RELATIVE_STATE")
    place, health = v.get("LOCAL_POSITION_NED"), v.get("HEALTH_STATUS")
    if silent > STALE_S:
        out["data"] = f"no data for {silent:.0f} s"
    if mission:
        out["phase"] = f"{phase_name(mission['phase'])} for {mission['phase_time']:.0f} s  {mission['reason']}"
    out["time"] = f"{v.t_us * 1e-6:.1f} s"
    if nav:
        out["speed"] = f"{nav['V']:.1f} m/s" if nav["valid"] else "navigation not valid"
        out["bank"] = f"{math.degrees(nav['phi']):+.1f} deg"
        out["wind"] = wind_words(nav["wind"], nav["wind_sigma"])
    if place:
        out["altitude"] = f"{-place['z']:.0f} m"
    if rel:
        error = [p - c for p, c in zip(rel["pos"], rel["cmd_pos"], strict=True)]
        out["position"] = " ".join(f"{p:+.2f}" for p in rel["pos"]) + " m (tanker axes)"
        out["error"] = " ".join(f"{e:+.2f}" for e in error) + " m (estimated)"
        if not rel["valid"]:
            out["error"] += "  not valid"
    fdi, wake = v.get("FDI_STATUS"), v.get("WAKE_POSITION")
    if fdi:
        out["air data"] = fdi_words(fdi)
        if v.alarm and not fdi["alarm"]:
            out["air data"] += f"; last alarm {(v.t_us - v.alarm_us) * 1e-6:.0f} s ago: {v.alarm}"
    if wake:
        out["in wake"] = wake_words(wake)
    if health:
        out["health"] = health_words(health["failed"])
    out["messages"] = f"{v.rate:.0f} /s"
    if v.text:
        out["text"] = v.text
    return out


class Monitor:
    """All aircraft heard, and what was wrong on the way."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.vehicles: dict[int, Vehicle] = {}
        self.gaps = SequenceGaps()
        self.junk = 0
        self.started = clock()

    def take(self, datagram: bytes) -> None:
        """Account for one datagram; rubbish is counted."""
        now = self.clock()
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
            return [f"no data for {now - self.started:.0f} s"]
        out = []
        for sysid, v in sorted(self.vehicles.items()):
            v.tick(now)
            parts = [f"{k} {t}" for k, t in describe(v, now).items()]
            out.append(f"{AIRCRAFT.get(sysid, f'sysid {sysid}')}: " + "; ".join(parts))
        return out

    def screen(self) -> Group:
        """The rich picture."""
        now = self.clock()
        panels: list[Any] = []
        for sysid, v in sorted(self.vehicles.items()):
            v.tick(now)
            grid = Table.grid(padding=(0, 2))
            grid.add_column(style="dim", min_width=9)
            grid.add_column()
            for key, text in describe(v, now).items():
                bad = key == "data" or (key == "health" and text != "ok") or "not valid" in text
                bad = bad or (key == "air data" and ("ALARM" in text or "EXCLUDED" in text))
                grid.add_row(key, Text(text, style="bold red" if bad else ""))
            panels.append(Panel(grid, title=f"{AIRCRAFT.get(sysid, 'aircraft')} (sysid {sysid})", title_align="left"))
        if not panels:
            panels.append(Text(f"no data for {now - self.started:.0f} s", style="bold red"))
        lost = sum(self.gaps.dropped.values())
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


def watch(sock: socket.socket, for_s: float | None = None) -> int:
    """Show what arrives on the (non-blocking) socket until Ctrl-C or for `for_s` [s]; returns the exit code."""
    monitor = Monitor()
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
