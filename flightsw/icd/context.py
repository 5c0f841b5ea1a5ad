"""What encoders of telemetry need beside the snapshot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flightsw.icd.geo import WireMap
from flightsw.icd.wire import Counters, Sender
from flightsw.types import UPD_BARO, UPD_FUEL, UPD_GNSS, UPD_IMU, UPD_MAG, UPD_RADALT, SensorFrame, Snapshot, Timing

MODE_BASE = 1000  # custom_mode of phase 0: ArduPilot's and PX4's numbers are others


@dataclass(slots=True)
class Context:
    """Sender, map and counters of one aircraft; what it is (`modes`: phase and name, `capacity_kg` of its tanks, `relative`: it
    follows another, `simulated`); when each group of readings came last [us], -1: never."""

    send: Sender
    geo: WireMap
    count: Counters  # of the plant link
    timing: Timing
    late_p999_us: float = 0.0
    dropped: int = 0  # telemetry datagrams not sent
    sent: int = 0
    excess: int = 0  # datagrams and packets of both links dropped unread
    period_us: int = 10_000
    modes: tuple[tuple[int, str], ...] = ()
    capacity_kg: float = 0.0
    relative: bool = False
    simulated: bool = True
    imu_us: int = -1
    mag_us: int = -1
    baro_us: int = -1
    gnss_us: int = -1
    fuel_us: int = -1
    radalt_us: int = -1

    def see(self, f: SensorFrame) -> None:
        """Note which readings came with frame `f`."""
        new, t = f.updated, f.t_us
        if new & UPD_IMU:
            self.imu_us = t
            if new == UPD_IMU:  # as in most ticks
                return
        if new & UPD_MAG:
            self.mag_us = t
        if new & UPD_BARO:
            self.baro_us = t
        if new & UPD_GNSS:
            self.gnss_us = t
        if new & UPD_FUEL:
            self.fuel_us = t
        if new & UPD_RADALT:
            self.radalt_us = t


Encoder = Callable[[Snapshot, Context], bytes]
