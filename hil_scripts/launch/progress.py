"""What the user watches during a run: simulated time, speed and phase.

On a terminal one live line (redrawn from the launcher's own loop: no drawing thread, see procs.py); elsewhere a plain
line every few seconds.
"""

from __future__ import annotations

import time
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

REDRAW_S = 0.2  # [s]
PLAIN_EVERY_S = 15.0  # [s]


class Board:
    """Collects status of plant and ground; draws. Also the source of the run's measured speed."""

    def __init__(self, console: Console, duration_s: float, names: dict[int, str]) -> None:
        self.sim_s = 0.0
        self.tick = 0
        self.lost = ""
        self._names = names
        self._console = console
        self._duration_s = duration_s
        self._phases: dict[str, str] = {}
        self._lines: dict[str, str] = {}
        self._first: tuple[float, float] | None = None
        self._last: tuple[float, float] = (0.0, 0.0)
        self._drawn = 0.0
        self._plain = time.monotonic()
        self._progress = Progress(
            TextColumn("{task.fields[sim]}"),
            BarColumn(bar_width=30),
            TextColumn("{task.fields[speed]}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[phase]}", markup=False),
            console=console,
            auto_refresh=False,
            transient=True,
        )
        self._task = self._progress.add_task("fly", total=duration_s, sim="starting", speed="", phase="")

    def __enter__(self) -> Board:
        if self._console.is_terminal:
            self._progress.start()
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        if self._console.is_terminal:
            self._progress.stop()

    @property
    def speed(self) -> float:
        """Simulated seconds per wall second from the first to the last tick reported; 0 before two reports."""
        if self._first is None or self._last[1] <= self._first[1]:
            return 0.0
        return (self._last[0] - self._first[0]) / (self._last[1] - self._first[1])

    def on_plant(self, msg: dict[str, Any]) -> None:
        """Status line of sim-plant: {"t": simulated seconds, "tick": n}, at the end perhaps "lost": which aircraft, when."""
        self.lost = str(msg.get("lost", self.lost))
        self._lines = {str(k): str(v) for k, v in msg.get("lines", {}).items()}
        if isinstance(msg.get("t"), (int, float)):
            self.advance(float(msg["t"]), int(msg.get("tick", self.tick)))

    def advance(self, sim_s: float, tick: int) -> None:
        """Note that simulated time `sim_s` has been reached now."""
        self.sim_s, self.tick = sim_s, tick
        now = time.monotonic()
        if sim_s > 0.0:
            self._first = self._first or (sim_s, now)
            if sim_s > self._last[0]:
                self._last = (sim_s, now)

    def on_ground(self, msg: dict[str, Any]) -> None:
        """Status line of ground record: {"phase": {sysid: name}}."""
        phase = msg.get("phase")
        if isinstance(phase, dict):
            self._phases = {str(k): str(v) for k, v in phase.items()}

    def draw(self) -> None:
        """Redraw if it is time to."""
        now = time.monotonic()
        if now - self._drawn < REDRAW_S:
            return
        self._drawn = now
        phase = "  ".join(f"{self._name(k)}: {v.lower()}" for k, v in sorted(self._phases.items()))
        phase += "".join(f"  line to {k}: {v}" for k, v in self._lines.items())
        sim = f"{self.sim_s:7.1f} / {self._duration_s:.0f} s" if self.tick else "starting"
        speed = f"{self.speed:5.1f} x real time" if self.speed else ""
        if self._console.is_terminal:
            self._progress.update(self._task, completed=self.sim_s, sim=sim, speed=speed, phase=phase)
            self._progress.refresh()
        elif now - self._plain > PLAIN_EVERY_S:
            self._plain = now
            self._console.print(f"{sim}  {speed}  {phase}")

    def _name(self, sysid: str) -> str:
        return self._names.get(int(sysid), sysid) if sysid.isdigit() else sysid
