"""An aircraft with equations of its own in the plant's world: what the world asks of it, and what it has in common with the
others: sensors, faults, command path.

To add one: its record (flightsw/aircraft), a subclass of Craft, and its class in crafts.CRAFTS.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from flightsw.aircraft import Airframe
from flightsw.strict import convert
from flightsw.types import SensorFrame
from sim_plant.actuators import CommandPath, Values
from sim_plant.kernels import layout as n
from sim_plant.scenario import AircraftCfg, Scenario
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.suite import build_sensors


class Craft:
    """Base. Subclasses keep `view.s`, `view.o` (layout.py, what its sensors and the truth read) and `wind` [NW] up to date.

    `trim`: the command that holds the start (aileron, elevator, rudder [rad], throttle, latch, flap [rad]).
    """

    table: ClassVar[type]  # dataclass of [aircraft.plant]
    carries: ClassVar[tuple[str, ...]] = ("imu", "baro", "gnss", "att")  # sensor groups besides the air-data probes
    index = 0  # nobody's follower

    def __init__(self, cfg: AircraftCfg, ac: Airframe, sc: Scenario, seed: int, trim: Values) -> None:
        self.cfg, self.ac, self.trim = cfg, ac, trim
        base_hz = sc.clock.base_rate_hz
        self.dt_s = 1.0 / base_hz
        self.probes = np.array([p.position_m for p in ac.probe]).reshape(-1, 3)
        count = len(self.probes)
        suite = sc.suite(cfg.name)
        self.sensors: list[Sensor] = build_sensors(
            cfg.name, suite, sc.noise, base_hz, seed, count, False, False, self.carries
        )
        self.view = View(count)
        self.view.s, self.view.o, self.view.rel = [0.0] * n.NS, [0.0] * n.NO, [0.0] * n.NR
        self.wind = np.zeros(n.NW)
        self.frame = SensorFrame()
        link = sc.link
        self.path = CommandPath(seed, cfg.name, link.actuator_delay_ticks, link.actuator_jitter_ticks, trim)

    def observe(self) -> None:
        """Bring view and wind to the present tick."""
        raise NotImplementedError

    def advance(self, jam: list[float]) -> None:
        """Fly one tick with `path.current` in force; jam [3]: 1 = aileron (or flap), elevator, rudder frozen."""
        raise NotImplementedError


def plant_table(cls: type[Craft], cfg: AircraftCfg) -> Any:
    """[aircraft.plant] of an aircraft as the dataclass of its model. Raises ConfigError naming the key."""
    return convert(cfg.plant, cls.table, f"aircraft.{cfg.name}.plant")
