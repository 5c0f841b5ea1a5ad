"""Air-to-air TACAN of the tanker, and what its crew reads off the radar once at the start."""

from __future__ import annotations

import math
from typing import Any

from flightsw.strict import ConfigError
from flightsw.types import UPD_RADAR, UPD_TACAN, SensorFrame
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
        if c.bearing_std_deg > 0.0:
            a = math.atan2(de, dn) - view.o[n.O_EULER]
            a += math.radians(c.bearing_std_deg * float(self._bearing.standard_normal()) + self._bearing_bias)
            bearing = math.remainder(a, 2.0 * math.pi)
        link = None
        if c.link_std_m > 0.0:
            north, east = (c.link_std_m * self._link.standard_normal(2) + self._link_bias).tolist()
            link = at[0] + north, at[1] + east
        return max(distance, 0.0), bearing, link

    def fill(self, frame: SensorFrame, t_us: int, value: Reply) -> None:
        frame.tacan_range_m, frame.tacan_bearing, frame.tacan_link = value
        frame.tacan_t_us = t_us


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
