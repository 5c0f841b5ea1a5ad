"""An aircraft with equations of its own in the plant's world: what the world asks of it, and what it has in common with the
others: sensors, faults, command path.

To add one: its record (flightsw/aircraft), a subclass of Craft, and its class in crafts.CRAFTS.
"""

from __future__ import annotations

import math
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

Mean = tuple[float, float]  # wind [m/s] north, east


class Craft:
    """Base: flight in a vertical plane along a fixed heading. Subclasses keep `view.s`, `view.o` (layout.py, what its sensors and
    the truth read) and `wind` [NW] up to date.

    `trim`: the command that holds the start (aileron, elevator, rudder [rad], throttle, latch, flap [rad]). `free` [3]: wind of
    the common air mass at it [m/s, NED], put there by the world before every `observe` and held over the tick; what a model's own
    table brings comes on top. Its cross component acts by sideslip: side force carries the plane of flight along (`side_*`).
    """

    table: ClassVar[type]  # dataclass of [aircraft.plant]
    carries: ClassVar[tuple[str, ...]] = ("imu", "baro", "gnss", "att")  # sensor groups besides the air-data probes
    surfaces: ClassVar[tuple[str, ...]] = ("elevator",)  # those that can jam
    index = 0  # nobody's follower

    def __init__(self, cfg: AircraftCfg, ac: Airframe, sc: Scenario, seed: int, trim: Values, mean: Mean) -> None:
        """mean: wind of the common air mass at the start [m/s], north and east."""
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
        self.free = np.array([*mean, 0.0])
        self.frame = SensorFrame()
        link = sc.link
        self.path = CommandPath(seed, cfg.name, link.actuator_delay_ticks, link.actuator_jitter_ticks, trim)
        self.psi = math.radians(cfg.start.psi_deg)
        self.ahead = math.cos(self.psi), math.sin(self.psi)
        self.side_m, self.side_mps = 0.0, self.along(self.free)[1]  # to the right; it starts without sideslip

    def along(self, v: np.ndarray) -> tuple[float, float, float]:
        """A vector [3] NED as components ahead, to the right, down."""
        (c, e), (north, east, down) = self.ahead, v.tolist()
        return c * north + e * east, c * east - e * north, down

    def level(self, ahead: float, right: float) -> tuple[float, float]:
        """The way back: north and east of components ahead and to the right."""
        c, e = self.ahead
        if right == 0.0:  # keeps the sign of a zero
            return c * ahead, e * ahead
        return c * ahead - e * right, e * ahead + c * right

    def attitude(self, pitch: float, rate: float, forward: float, up: float) -> None:
        """Attitude, rates and velocity over the ground into the view: pitch [rad], its rate [rad/s], forward and up [m/s]."""
        s = self.view.s
        ch, cp = math.cos(0.5 * self.psi), math.cos(0.5 * pitch)
        sh, sp = math.sin(0.5 * self.psi), math.sin(0.5 * pitch)
        s[n.S_Q : n.S_Q + 4] = ch * cp, -sh * sp, ch * sp, sh * cp
        s[n.S_W : n.S_W + 3] = 0.0, rate, 0.0
        s[n.S_V : n.S_V + 3] = *self.level(forward, self.side_mps), -up
        self.view.o[n.O_EULER : n.O_EULER + 3] = self.psi, pitch, 0.0

    def flow(self, airspeed: float, alpha: float, slope: float) -> float:
        """Airspeed, incidence and sideslip into the view, at all probes those of the centre of gravity; returns the side
        acceleration [m/s^2]. airspeed [m/s], alpha [rad]: in the plane; slope: side force per mass at it [m/s^2 per rad]."""
        o, across = self.view.o, self.side_mps - self.along(self.free)[1]
        V = math.hypot(airspeed, across)
        beta = math.asin(across / V)
        o[n.O_V], o[n.O_ALPHA], o[n.O_BETA] = V, alpha, beta
        for i in range(len(self.probes)):
            o[n.O_PROBE + 3 * i : n.O_PROBE + 3 * i + 3] = V, alpha, beta
        self._side_tau = airspeed / -slope if slope else math.inf  # [s] the cross wind takes it along
        return slope * beta + 0.0  # no minus zero

    def carry(self) -> None:
        """Sideways motion over the tick, cross wind held: exact for the time constant of `flow`."""
        cross = self.along(self.free)[1]
        if self.side_mps == cross == 0.0:
            return
        before = self.side_mps
        self.side_mps += (cross - before) * -math.expm1(-self.dt_s / self._side_tau)
        self.side_m += 0.5 * (before + self.side_mps) * self.dt_s

    @property
    def height_m(self) -> float:
        """Height [m] now."""
        raise NotImplementedError

    def observe(self) -> None:
        """Bring view and wind to the present tick."""
        raise NotImplementedError

    def advance(self, jam: list[float]) -> None:
        """Fly one tick with `path.current` in force; jam [3]: 1 = aileron (or flap), elevator, rudder frozen."""
        raise NotImplementedError


def plant_table(cls: type[Craft], cfg: AircraftCfg) -> Any:
    """[aircraft.plant] of an aircraft as the dataclass of its model. Raises ConfigError naming the key."""
    return convert(cfg.plant, cls.table, f"aircraft.{cfg.name}.plant")
