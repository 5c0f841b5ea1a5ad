"""Air data of N probes: airspeed, alpha and beta of the local flow at each probe."""

from __future__ import annotations

from typing import Any

from flightsw.types import UPD_AIR, SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.sensors.base import Sensor, View

Reading = tuple[int, tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class AirSensor(Sensor):
    """Probe i reads the wind at its own place, wake and w x r included. Error row: V, alpha, beta of probe 0, of
    probe 1, ..."""

    group, bit = "air", UPD_AIR

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.off_mask = 0  # probes switched off by a fault
        self.stuck_mask = 0

    def sample(self, view: View, e: list[float]) -> Reading:
        o, m = view.o, 3 * view.probes
        v = tuple([o[n.O_PROBE + j] + e[j] for j in range(0, m, 3)])
        a = tuple([o[n.O_PROBE + j] + e[j] for j in range(1, m, 3)])
        b = tuple([o[n.O_PROBE + j] + e[j] for j in range(2, m, 3)])
        if self.stuck_mask and self._last is not None:
            held = [self.stuck_mask >> i & 1 for i in range(view.probes)]
            v, a, b = (tuple(old if h else x for x, old, h in zip(new, prev, held, strict=True)) for new, prev in
                       ((v, self._last[1]), (a, self._last[2]), (b, self._last[3])))  # fmt: skip
        return ((1 << view.probes) - 1) & ~self.off_mask, v, a, b

    def fill(self, frame: SensorFrame, t_us: int, value: Reading) -> None:
        frame.air_mask, frame.air_V, frame.air_alpha, frame.air_beta = value
        frame.air_t_us = t_us

    def refresh(self) -> None:
        """As the base class; single-probe faults count as well."""
        super().refresh()
        self.faulty = self.faulty or self.off_mask != 0 or self.stuck_mask != 0
