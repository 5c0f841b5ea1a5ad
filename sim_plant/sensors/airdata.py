"""Air data of N probes: airspeed, alpha and beta of the local flow at each probe."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from flightsw.types import UPD_AIR, SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.sensors.bank_kernel import PLAIN
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.faulty import Delay, Flicker

Reading = tuple[int, tuple[float, ...], tuple[float, ...], tuple[float, ...]]
ORDER = ("scale", "delayed", "stuck", "intermittent", "off")  # in which faults of one reading act


@dataclass(slots=True)
class Cells:
    """A fault of some columns of the reading row (V, alpha, beta of probe 0, of probe 1, ...).

    `probes` > 0: mask of whole probes that are lost together (intermittent, off); 0: the columns are lost one by one, as NaN.
    """

    kind: str  # one of ORDER
    columns: list[int]
    probes: int = 0
    factors: list[float] = field(default_factory=list)  # scale: one per column
    delay: Delay | None = None
    flicker: Flicker | None = None
    held: list[float] | None = None  # stuck: the values before its first sample

    def act(self, row: list[float], mask: int, last: list[float] | None, frozen: bool) -> int:
        """Change `row` in place; returns the mask of valid probes. `last`: the sample before; `frozen`: the row is
        that itself, so that faults can only take from it."""
        if frozen and self.kind not in ("intermittent", "off"):
            return mask
        if self.kind == "scale":
            for c, f in zip(self.columns, self.factors, strict=True):
                row[c] *= f
        elif self.kind == "delayed" and self.delay is not None:
            for c, x in zip(self.columns, self.delay.push([row[c] for c in self.columns]), strict=True):
                row[c] = x
        elif self.kind == "stuck":
            if self.held is None:
                now = [row[c] for c in self.columns]
                old = [last[c] for c in self.columns] if last is not None else now
                self.held = [b if math.isnan(a) else a for a, b in zip(old, now, strict=True)]
            for c, x in zip(self.columns, self.held, strict=True):
                row[c] = x
        elif self.flicker is None or self.flicker.lost():
            if self.probes:
                return mask & ~self.probes
            for c in self.columns:
                row[c] = math.nan
        return mask


class AirSensor(Sensor):
    """Probe i reads the wind at its own place, wake and w x r included. Error row: V, alpha, beta of probe 0, of
    probe 1, ... A channel that is off reads NaN; a probe that is off loses its bit in the mask."""

    group, bit, form = "air", UPD_AIR, PLAIN

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.cells: list[Cells] = []  # in the order of ORDER
        self.names: list[str] = []  # of the probes

    def sample(self, view: View, e: list[float]) -> Reading:
        o, m = view.o, 3 * view.probes
        v = tuple([o[n.O_PROBE + j] + e[j] for j in range(0, m, 3)])
        a = tuple([o[n.O_PROBE + j] + e[j] for j in range(1, m, 3)])
        b = tuple([o[n.O_PROBE + j] + e[j] for j in range(2, m, 3)])
        return (1 << view.probes) - 1, v, a, b

    def made(self, row: tuple[float, ...], view: View) -> Reading:
        return (1 << view.probes) - 1, row[0::3], row[1::3], row[2::3]

    def fill(self, frame: SensorFrame, t_us: int, value: Reading) -> None:
        frame.air_mask, frame.air_V, frame.air_alpha, frame.air_beta = value
        frame.air_t_us = t_us

    def alter(self, value: Reading, frozen: bool) -> Reading | None:
        """Faults of single probes and channels, then those of the whole group."""
        if self.cells:
            mask, row, before = value[0], _row(value), self.newest()
            last = _row(before) if before is not None else None
            for c in self.cells:
                mask = c.act(row, mask, last, frozen)
            value = (mask, tuple(row[0::3]), tuple(row[1::3]), tuple(row[2::3]))
        return super().alter(value, frozen)

    def impaired(self) -> bool:
        """As the base class; single-probe faults count as well."""
        return super().impaired() or bool(self.cells)


def _row(value: Reading) -> list[float]:
    """V, alpha, beta of probe 0, of probe 1, ..."""
    return [x for probe in zip(*value[1:], strict=True) for x in probe]
