"""The small UAV in the plant's world: alexis.py behind the house's sensors, faults and command path.

Flight along a fixed heading. Throttle 0 to 1 is thrust per mass from none to twice that of level flight. Two of these in one
scenario meet the same wind at the same time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from flightsw.aircraft import Alexis as Record
from flightsw.strict import ConfigError, Range
from sim_plant.alexis import Alexis, AlexisParams, AlexisSensors, AlexisServo
from sim_plant.alexis_wind import AlexisWind
from sim_plant.craft import Craft, plant_table
from sim_plant.kernels import layout as n
from sim_plant.kernels.alexis import A_T0, A_TSET, F_VUP, F_VX
from sim_plant.kernels.atmosphere import isa
from sim_plant.scenario import AircraftCfg, Scenario

PERFECT = AlexisSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # errors are those of the scenario's sensors
TRIM = (0.0, 0.0, 0.0, 0.5, False, 0.0)
DOWN, TAIL = 0, 1


@dataclass(frozen=True)
class AlexisTable:
    """[aircraft.plant] with model = "alexis". Factors multiply forces and moments as a whole; `ticks`: integration steps per
    base tick; wind: Dryden turbulence and discrete gusts along this flight."""

    linear: bool = False
    lift_factor: Annotated[float, Range(0.1, 3.0)] = 1.0
    moment_factor: Annotated[float, Range(0.1, 3.0)] = 1.0
    ticks: Annotated[int, Range(1, 100)] = 4
    servo: AlexisServo = field(default_factory=AlexisServo)
    wind: AlexisWind = field(default_factory=lambda: AlexisWind(0.0, 0.0))


class AlexisCraft(Craft):
    """One ALEXIS. Its start must be at the trim airspeed of its file."""

    table = AlexisTable

    def __init__(self, cfg: AircraftCfg, ac: Record, sc: Scenario, seed: int) -> None:
        """Raises ConfigError for another airspeed at the start, or a table the model does not take."""
        super().__init__(cfg, ac, sc, seed, TRIM)
        t: AlexisTable = plant_table(AlexisCraft, cfg)
        north, east, down = cfg.start.pos_n_m
        p = AlexisParams(
            linear=t.linear, aircraft=ac, height_m=-down, lift_factor=t.lift_factor, moment_factor=t.moment_factor, servo=t.servo,
            sensors=PERFECT,
        )  # fmt: skip
        if cfg.start.V_mps != p.V_mps:
            raise ConfigError(
                f"aircraft.{cfg.name}.start.V_mps = {cfg.start.V_mps}: allowed: {p.V_mps:g}, the model's trim"
            )
        ticks = round(sc.meta.duration_s * sc.clock.base_rate_hz) + 1
        self.flight = Alexis(p, t.wind, seed, ticks * self.dt_s, self.dt_s, t.ticks)
        psi = math.radians(cfg.start.psi_deg)
        self._psi, self._ahead = psi, (math.cos(psi), math.sin(psi))
        self._at = [north, east]
        self._throttle = [0.0, 0.0]  # setting in force and last
        self.mass_kg = ac.mass.kg

    def observe(self) -> None:
        a, s, o = self.flight, self.view.s, self.view.o
        vx, vup = float(a.f[F_VX]), float(a.f[F_VUP])
        rate, alpha, airspeed, pitch, height = (float(x) for x in a.reading[:5])
        down, tail = (float(x) for x in a.air)
        ch, cp, sh, sp = (
            math.cos(0.5 * self._psi),
            math.cos(0.5 * pitch),
            math.sin(0.5 * self._psi),
            math.sin(0.5 * pitch),
        )
        s[n.S_Q : n.S_Q + 4] = ch * cp, -sh * sp, ch * sp, sh * cp
        s[n.S_W : n.S_W + 3] = 0.0, rate, 0.0
        c, e = self._ahead
        s[n.S_V : n.S_V + 3] = c * vx, e * vx, -vup
        s[n.S_P : n.S_P + 3] = self._at[0], self._at[1], -height
        push = float(a.a[A_T0] + a.a[A_TSET] * a.command[1])
        s[n.S_T] = push * self.mass_kg
        elevator, flap = a.surfaces
        s[n.S_SURF : n.S_SURF + 3] = flap, elevator, 0.0
        fx, fz = a.specific_force
        o[0:3] = fx, 0.0, fz
        o[n.O_V], o[n.O_ALPHA], o[n.O_MASS] = airspeed, alpha, self.mass_kg
        o[n.O_PRESS] = isa(height)[1]
        o[n.O_AVAIL] = 2.0 * float(a.a[A_T0]) * self.mass_kg
        o[n.O_EULER : n.O_EULER + 3] = self._psi, pitch, 0.0
        for i in range(len(self.probes)):  # short body: the flow at every probe is that at the centre of gravity
            o[n.O_PROBE + 3 * i : n.O_PROBE + 3 * i + 3] = airspeed, alpha, 0.0
        self.wind[:3] = c * tail, e * tail, down

    def advance(self, jam: list[float]) -> None:
        a = self.flight
        _, elevator, _, throttle, _, flap = self.path.current
        setting = (2.0 * throttle - 1.0) * a.a[A_T0] / a.a[A_TSET]
        a.freeze(elevator=jam[1] > 0.5, flap=jam[0] > 0.5)
        before = float(a.f[F_VX])
        a.command[:] = elevator, setting, flap
        a.step(a.command)
        d = 0.5 * (before + float(a.f[F_VX])) * self.dt_s
        self._at[0] += self._ahead[0] * d
        self._at[1] += self._ahead[1] * d
