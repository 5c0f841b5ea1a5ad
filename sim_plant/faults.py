"""Scripted events turned into tick-by-tick actions on sensors, surfaces and links."""

from __future__ import annotations

from dataclasses import dataclass, field

from flightsw.strict import ConfigError
from sim_plant.scenario import Event, Scenario
from sim_plant.sensors.airdata import AirSensor
from sim_plant.sensors.base import Sensor

SURFACES = ("aileron", "elevator", "rudder")


@dataclass(slots=True)
class Outage:
    """Faults of one aircraft that are not in a sensor."""

    jam: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # 1 = surface frozen
    link_down: bool = False  # its radio neither transmits nor receives


def _row(e: Event, s: Sensor, at: str) -> list[float]:
    """Error row of a bias or spike event. Raises ConfigError if the number of values does not fit the sensor."""
    width, start = s.columns, 0
    if e.index >= 0 and isinstance(s, AirSensor):
        width, start = 3, 3 * e.index
    if len(e.value) not in (1, width) or start + width > s.columns:
        raise ConfigError(f"{at}.value: {s.key} takes 1 or {width} values, got {len(e.value)} (index {e.index})")
    row = [0.0] * s.columns
    row[start : start + width] = list(e.value) * (width if len(e.value) == 1 else 1)
    return row


class FaultPlan:
    """Starts and ends faults at their ticks. `sensors`: per aircraft name, its sensors by group."""

    def __init__(self, sc: Scenario, sensors: dict[str, dict[str, Sensor]], rate_hz: int) -> None:
        self.outage = {a.name: Outage() for a in sc.aircraft}
        self._sensors = sensors
        self._active: list[Event] = []
        self._plan: dict[int, list[tuple[bool, Event]]] = {}
        self._rows: dict[int, list[float]] = {}
        for i, e in enumerate(sc.event):
            if e.kind == "command":
                continue
            if e.sensor:
                if e.sensor not in sensors[e.target]:
                    raise ConfigError(
                        f"event[{i}].sensor = {e.sensor!r}: {e.target} carries {', '.join(sensors[e.target])}"
                    )
                if e.kind in ("bias", "spike"):
                    self._rows[id(e)] = _row(e, sensors[e.target][e.sensor], f"event[{i}]")
            start = round(e.t_s * rate_hz)
            self._plan.setdefault(start, []).append((True, e))
            if e.for_s > 0.0 and e.kind != "spike":
                self._plan.setdefault(start + max(1, round(e.for_s * rate_hz)), []).append((False, e))

    def step(self, k: int) -> None:
        """Apply what starts or ends at tick k."""
        todo = self._plan.get(k)
        if todo is None:
            return
        for begin, e in todo:
            if e.kind == "spike":
                s = self._sensors[e.target][e.sensor]
                s.spike = self._rows[id(e)]
                s.refresh()
            elif begin:
                self._active.append(e)
            else:
                self._active = [a for a in self._active if a is not e]
            self._apply(e)

    def _apply(self, e: Event) -> None:
        """Recompute the fault fields that event `e` touches from all active events."""
        mine = [a for a in self._active if a.target == e.target]
        out = self.outage[e.target]
        out.link_down = any(a.kind == "link_loss" for a in mine)
        out.jam = [1.0 if any(a.kind == "jam" and a.surface == s for a in mine) else 0.0 for s in SURFACES]
        if not e.sensor:
            return
        s = self._sensors[e.target][e.sensor]
        here = [a for a in mine if a.sensor == e.sensor]
        single = isinstance(s, AirSensor)
        s.dropped = any(a.kind == "dropout" and not (single and a.index >= 0) for a in here)
        s.stuck = any(a.kind == "stuck" and not (single and a.index >= 0) for a in here)
        rows = [self._rows[id(a)] for a in here if a.kind == "bias"]
        s.offset = [sum(c) for c in zip(*rows, strict=True)] if rows else None
        if isinstance(s, AirSensor):
            s.off_mask = sum({1 << a.index for a in here if a.kind == "dropout" and a.index >= 0})
            s.stuck_mask = sum({1 << a.index for a in here if a.kind == "stuck" and a.index >= 0})
        s.refresh()
