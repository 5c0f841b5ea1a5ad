"""Air-to-air TACAN of the tanker, the receiver's position by data link, and what the crew reads off the radar at the start.

Bearing and position come with every range, or at a rate of their own: a set's bearing is there all the time, and a data link
sends when it does. Their noise is then correlated, since what comes often is wrong in much the same way each time.
"""

from __future__ import annotations

import math
from typing import Any

from flightsw.strict import ConfigError
from flightsw.types import UPD_BEARING, UPD_POSITION, UPD_RADAR, UPD_TACAN, SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.rng import generator
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.config import Radar, Tacan
from sim_plant.sensors.rows import NoiseRows

Reply = tuple[float | None, float | None, tuple[float, float] | None]


class TacanSensor(Sensor):
    """Reply (range [m], bearing [rad] clockwise from the nose, other's own position north, east [m]); None: not answered, or the
    set has none. Error row: range."""

    group, bit = "tacan", UPD_TACAN

    def __init__(self, name: str, cfg: Tacan, base_hz: int, noise: NoiseRows, seed: int) -> None:
        key = f"sensors.{name}.tacan"
        super().__init__(key, 1.0 / cfg.interval_s, cfg.latency_ms, base_hz, noise, 1)
        if cfg.latency_ms >= 1e3 * cfg.interval_s:
            raise ConfigError(f"{key}.latency_ms = {cfg.latency_ms:g}: allowed: below interval_s")
        self.cfg = cfg
        self.first, self.every = round(cfg.first_s * base_hz), 1  # its samples count from the first on
        self._bearing = generator(seed, f"{name}.tacan.bearing")
        self._link = generator(seed, f"{name}.tacan.link")
        self._bearing_bias = cfg.bearing_bias_std_deg * float(
            generator(seed, f"{name}.tacan.bearing.bias").standard_normal()
        )
        self._link_bias = cfg.link_bias_std_m * generator(seed, f"{name}.tacan.link.bias").standard_normal(2)
        self._dropout = generator(seed, f"{name}.tacan.dropout")

    def step(self, k: int, t_us: int, view: View, frame: SensorFrame) -> None:
        """As any sensor, from `first_s` on."""
        super().step(k - self.first if k >= self.first else 1, t_us, view, frame)

    def sample(self, view: View, e: list[float]) -> Reply:
        c, s, at = self.cfg, view.s, view.target
        if c.dropout > 0.0 and self._dropout.random() < c.dropout:
            return None, None, None
        dn, de = at[0] - s[n.S_P], at[1] - s[n.S_P + 1]
        flat = math.hypot(dn, de)
        # the other aircraft is lower by the fall of the earth over that distance
        drop = c.earth_radius_m * (1.0 - math.cos(flat / c.earth_radius_m))
        distance = math.hypot(flat, at[2] - s[n.S_P + 2] + drop) + e[0]
        bearing = None
        if c.bearing_std_deg > 0.0 and c.bearing_dt_s == 0.0:
            a = math.atan2(de, dn) - view.o[n.O_EULER]
            a += math.radians(c.bearing_std_deg * float(self._bearing.standard_normal()) + self._bearing_bias)
            bearing = math.remainder(a, 2.0 * math.pi)
        link = None
        if c.link_std_m > 0.0 and c.link_dt_s == 0.0:
            north, east = (c.link_std_m * self._link.standard_normal(2) + self._link_bias).tolist()
            link = at[0] + north, at[1] + east
        return max(distance, 0.0), bearing, link

    def fill(self, frame: SensorFrame, t_us: int, value: Reply) -> None:
        frame.tacan_range_m, frame.tacan_bearing, frame.tacan_link = value
        frame.tacan_t_us = t_us


def _rate(key: str, dt_s: float, base_hz: int) -> float:
    """Rate [Hz] of a period. Raises ConfigError unless it is a whole number of ticks."""
    ticks = dt_s * base_hz
    if round(ticks) < 1 or abs(ticks - round(ticks)) > 1e-6 * ticks:
        raise ConfigError(f"{key} = {dt_s:g}: allowed: 0, or a whole number of ticks of 1/{base_hz} s")
    return 1.0 / dt_s


class BearingSensor(Sensor):
    """Bearing [rad] clockwise from the nose at a rate of its own. Error row: bearing. Of the set: off or stuck, it is too."""

    group, bit = "bearing", UPD_BEARING

    def __init__(self, name: str, cfg: Tacan, base_hz: int, noise: NoiseRows, of: TacanSensor) -> None:
        key = f"sensors.{name}.tacan.bearing_dt_s"
        super().__init__(key, _rate(key, cfg.bearing_dt_s, base_hz), cfg.latency_ms, base_hz, noise, 1)
        self.of = of

    def sample(self, view: View, e: list[float]) -> float | None:
        if self.of.dropped:
            return None
        if self.of.stuck and self.newest() is not None:
            return float(self.newest())
        dn, de = view.target[0] - view.s[n.S_P], view.target[1] - view.s[n.S_P + 1]
        return math.remainder(math.atan2(de, dn) - view.o[n.O_EULER] + e[0], 2.0 * math.pi)

    def fill(self, frame: SensorFrame, t_us: int, value: float) -> None:
        frame.bearing_t_us, frame.bearing = t_us, value


class PositionSensor(Sensor):
    """The other's own position (north, east) [m] as its data link sends it. Error row: the same."""

    group, bit = "position", UPD_POSITION

    def __init__(self, name: str, cfg: Tacan, base_hz: int, noise: NoiseRows, seed: int) -> None:
        key = f"sensors.{name}.tacan.link_dt_s"
        super().__init__(key, _rate(key, cfg.link_dt_s, base_hz), cfg.link_latency_ms, base_hz, noise, 2)
        self.loss, self._lost = cfg.link_loss, generator(seed, f"{name}.position.loss")

    def sample(self, view: View, e: list[float]) -> tuple[float, float] | None:
        if self._lost.random() < self.loss:
            return None
        return view.target[0] + e[0], view.target[1] + e[1]

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float, float]) -> None:
        frame.position_t_us, frame.position = t_us, value


class RadarSensor(Sensor):
    """One reading (lateral position, its sigma [m]). `where` gives the true one; the error is drawn once."""

    group, bit = "radar", UPD_RADAR

    def __init__(self, name: str, cfg: Radar, base_hz: int, seed: int, sigma_m: float) -> None:
        super().__init__(f"sensors.{name}.radar", float(base_hz), 0.0, base_hz, None, 0)  # called every tick
        self.at, self.sigma = round(cfg.at_s * base_hz), sigma_m
        self.error = sigma_m * float(generator(seed, f"{name}.radar").standard_normal())

    def step(self, k: int, t_us: int, view: View, frame: SensorFrame) -> None:
        """One sample in the whole run."""
        if k == self.at:
            super().step(0, t_us, view, frame)

    def sample(self, view: View, e: list[float]) -> Any:
        return view.lateral_m + (0.0 if view.lateral_read else self.error), self.sigma

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float, float]) -> None:
        (frame.radar_y_m, frame.radar_sigma_m), frame.radar_t_us = value, t_us
