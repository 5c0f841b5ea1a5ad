"""Fixed errors and faults of the twin-jet's sensors that the campaign `jing_sensors` flies."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from hil_scripts.studies.jing.sensor_flight import WHO
from sim_plant.failures.script import Event

DEG = math.pi / 180.0
SLOPE_M = 20.0  # [m] off the slope that is harm


@dataclass(frozen=True)
class Fixed:
    """An error that lasts from the start."""

    events: tuple[Event, ...]


def _bias(sensor: str, value: tuple[float, ...], channel: str = "") -> Fixed:
    return Fixed((Event(0.0, "bias", WHO, sensor=sensor, value=value, channel=channel),))


FIXED = {
    f"{name}_{sign}": make(s)
    for name, make in {
        "accel_along": lambda s: _bias("imu", (0.0, 0.0, 0.0, 0.5 * s, 0.0, 0.0)),
        "accel_up": lambda s: _bias("imu", (0.0, 0.0, 0.0, 0.0, 0.0, -0.5 * s)),
        "vane": lambda s: _bias("air", (1.5 * DEG * s,), "alpha"),
        "airspeed": lambda s: Fixed((Event(0.0, "scale", WHO, sensor="air", value=(1.0 + 0.02 * s,), channel="V"),)),
        "climb": lambda s: _bias("gnss", (0.0, 0.0, 0.0, 0.0, 0.0, -1.0 * s)),
        "baro": lambda s: _bias("baro", (20.0 * s,)),
    }.items()
    for sign, s in (("plus", 1.0), ("minus", -1.0))
}


@dataclass(frozen=True)
class Fault:
    """A fault that begins in flight."""

    made: Event

    def event(self, t_s: float) -> Event:
        """The fault, beginning at t_s [s]."""
        return replace(self.made, t_s=t_s)


def _faults() -> dict[str, Fault]:
    out: dict[str, Fault] = {}
    sensors = {
        "imu": ("imu", ""), "attitude": ("att", ""), "gnss": ("gnss", ""), "baro": ("baro", ""), "radio": ("radalt", ""),
        "airspeed": ("air", "V"), "vane": ("air", "alpha"),
    }  # fmt: skip
    for name, (sensor, channel) in sensors.items():
        for word, kind in (("lost", "off"), ("stuck", "stuck"), ("frozen", "frozen")):
            out[f"{name}_{word}"] = Fault(Event(0.0, kind, WHO, sensor=sensor, channel=channel))
    for name, sensor, value, channel in (
        ("accel_up_drift", "imu", (0.0, 0.0, 0.0, 0.0, 0.0, -0.02), ""),
        ("accel_along_drift", "imu", (0.0, 0.0, 0.0, 0.02, 0.0, 0.0), ""),
        ("gyro_drift", "imu", (0.0, 5e-4, 0.0, 0.0, 0.0, 0.0), ""),
        ("pitch_drift", "att", (0.0, 0.05 * DEG, 0.0), ""),
        ("climb_drift", "gnss", (0.0, 0.0, 0.0, 0.0, 0.0, -0.05), ""),
        ("ground_speed_drift", "gnss", (0.0, 0.0, 0.0, 0.1, 0.0, 0.0), ""),
        ("baro_drift", "baro", (1.0,), ""),
        ("radio_drift", "radalt", (-1.0,), ""),
        ("airspeed_drift", "air", (0.2,), "V"),
        ("vane_drift", "air", (0.05 * DEG,), "alpha"),
    ):
        out[name] = Fault(Event(0.0, "drift", WHO, sensor=sensor, value=value, channel=channel))
    return out


FAULTS = _faults()
