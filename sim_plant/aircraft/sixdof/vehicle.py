"""One aircraft of the world: its arrays, its sensors, its start."""

from __future__ import annotations

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError
from flightsw.types import SensorFrame
from sim_plant.actuators import CommandPath, Values
from sim_plant.aircraft.sixdof.params import parameter_vector, perturb
from sim_plant.kernels import layout as n
from sim_plant.scenario import AircraftCfg, Scenario
from sim_plant.sensors.base import Sensor, View
from sim_plant.sensors.suite import build_sensors, tacan_sensors
from sim_plant.wind.vortex import NK
from sim_plant.wind.wake import airframe_points, source_vector


class Vehicle:
    """Flat float64 arrays of one aircraft (layout.py), and what turns them into sensor frames."""

    def __init__(
        self, index: int, cfg: AircraftCfg, ac: Aircraft, leader: Aircraft | None, sc: Scenario, seed: int
    ) -> None:
        self.index, self.cfg, self.ac = index, cfg, ac
        self.par = perturb(parameter_vector(ac), cfg.aero_error_frac, seed, cfg.name)
        self.s = np.zeros(n.NS)
        self.c = np.zeros(n.NC)
        self.wind = np.zeros(n.NW)  # effective wind
        self.free = np.zeros(3)  # wind without wake
        self.obs = np.zeros(n.NO)
        self.rel = np.zeros(n.NR)
        self.scratch = np.zeros((4, n.NS))
        self.work = np.zeros(n.N_RIGID)
        self.probes = np.array([p.position_m for p in ac.probe]).reshape(-1, 3)
        self.probe_wake = np.zeros((len(self.probes), 3))
        self.points, self.weight, self.n_span, self.n_frame = airframe_points(ac, self.probes)
        w = sc.wind.wake
        self.wake_source = (
            source_vector(ac, w.core_wing_m, w.core_tail_m, w.nu_m2ps, w.tail_lift_frac)
            if w.source == cfg.name
            else np.zeros(NK)
        )
        self.geo = np.zeros(7)
        if leader is not None and leader.boom is not None and ac.receptacle is not None:
            self.geo[0:3], self.geo[3:6] = leader.boom.pivot_m, ac.receptacle.position_m
            self.geo[6] = leader.boom.length_retracted_m
        has_boom = bool(cfg.boom_to) or any(a.boom_to == cfg.name for a in sc.aircraft)
        self.sensors: list[Sensor] = build_sensors(
            cfg.name,
            sc.suite(cfg.name),
            sc.noise,
            sc.clock.base_rate_hz,
            seed,
            len(self.probes),
            bool(cfg.rel_nav_to),
            has_boom,
        )
        if cfg.tacan_to:
            radar = sc.traffic.y_sigma_m if cfg.tacan_to == sc.traffic_name else -1.0
            self.sensors += tacan_sensors(cfg.name, sc.suite(cfg.name), sc.noise, sc.clock.base_rate_hz, seed, radar)
        self.view = View(len(self.probes))
        self.frame = SensorFrame()
        self.path: CommandPath  # set once trimmed
        self.trim: Values
        fuel = cfg.fuel_kg if cfg.fuel_kg >= 0.0 else ac.mass.default_fuel_kg
        most = min(ac.mass.fuel_capacity_kg, ac.mass.max_kg - ac.mass.empty_kg)
        if fuel > most:
            raise ConfigError(
                f"aircraft.{cfg.name}.fuel_kg = {fuel:g}: allowed by {cfg.file!r}: up to {most:g} kg of tanks and mass"
            )
        self.s[n.S_FUEL] = fuel
