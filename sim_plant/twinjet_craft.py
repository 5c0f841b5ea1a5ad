"""The twin-jet transport in the plant's world: twinjet.py behind the house's sensors, faults and command path.

Flight along a fixed heading, x along it from the frame's origin: the downburst's axis is at its x_m. Throttle 0 to 1 is thrust
from none to that at rest, and the engine gives between idle and its limit of it. start.V_mps is the speed over the ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from flightsw.aircraft import TwinJet as Record
from flightsw.strict import ConfigError, Range
from sim_plant.alexis_wind import Gust
from sim_plant.craft import Craft, plant_table
from sim_plant.kernels import layout as n
from sim_plant.kernels import twinjet as kt
from sim_plant.kernels.atmosphere import isa
from sim_plant.microburst import Microburst
from sim_plant.scenario import AircraftCfg, Scenario
from sim_plant.twinjet import TwinJet, TwinJetAir, TwinJetParams, TwinJetSensors

PERFECT = TwinJetSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # errors are those of the scenario's sensors
NOT_YET = (0.0, 0.0, 0.0, 0.0, False, 0.0)
Factor = Annotated[float, Range(0.1, 3.0)]
Sigma = Annotated[float, Range(0.0, 30.0)]
Length = Annotated[float, Range(1.0)]


@dataclass(frozen=True)
class TwinJetTable:
    """[aircraft.plant] with model = "twinjet": lift and drag over those of the model, slope at the start, downburst,
    Dryden turbulence along x and up with its scale lengths, discrete gusts."""

    lift_factor: Factor = 1.0
    drag_factor: Factor = 1.0
    slope_deg: Annotated[float, Range(0.0, 8.0)] = 3.0
    burst: Microburst = field(default_factory=lambda: Microburst(0.0))
    sigma_u_mps: Sigma = 0.0
    sigma_w_mps: Sigma = 0.0
    L_u_m: Length = 260.0
    L_w_m: Length = 100.0
    gusts: tuple[Gust, ...] = ()


class TwinJetCraft(Craft):
    """One twin-jet, from steady flight on the slope."""

    table = TwinJetTable

    def __init__(self, cfg: AircraftCfg, ac: Record, sc: Scenario, seed: int) -> None:
        """Raises ConfigError for a start without steady flight, or a table the model does not take."""
        super().__init__(cfg, ac, sc, seed, NOT_YET)
        t: TwinJetTable = plant_table(TwinJetCraft, cfg)
        north, east, down = cfg.start.pos_n_m
        psi = math.radians(cfg.start.psi_deg)
        self._psi, self._ahead = psi, (math.cos(psi), math.sin(psi))
        c, e = self._ahead
        x = c * north + e * east
        self._aside = (north - c * x, east - e * x)
        p = TwinJetParams(t.lift_factor, t.drag_factor, x, -down, cfg.start.V_mps, t.slope_deg, PERFECT, ac)
        air = TwinJetAir(t.burst, t.sigma_u_mps, t.sigma_w_mps, t.L_u_m, t.L_w_m, t.gusts)
        ticks = round(sc.meta.duration_s * sc.clock.base_rate_hz) + 1
        try:
            self.flight = TwinJet(p, air, seed, ticks * self.dt_s, self.dt_s)
        except ValueError as problem:
            raise ConfigError(f"aircraft.{cfg.name}.start: {problem}") from None
        self._full = float(self.flight.a[kt.A_TMAX])
        thrust, elevator = (float(v) for v in self.flight.controls)
        alpha = float(self.flight.truth[4])
        if not (0.0 <= thrust <= self._full and abs(alpha) < self.flight.a[kt.A_PEAK]):
            raise ConfigError(
                f"aircraft.{cfg.name}.start.V_mps = {cfg.start.V_mps:g}: steady flight there takes {thrust * 1e-3:.0f} kN at "
                f"{math.degrees(alpha):.0f} deg; allowed: up to {self._full * 1e-3:.0f} kN, below the stall"
            )
        self.trim = (0.0, elevator, 0.0, thrust / self._full, False, 0.0)
        self.path.current = self.trim
        self._elevator = elevator

    def observe(self) -> None:
        a, s, o = self.flight, self.view.s, self.view.o
        height, vx, airspeed, alpha, pitch, rate, vup, ax, ah = (float(v) for v in a.reading)
        c, e = self._ahead
        ch, cp, sh, sp = (
            math.cos(0.5 * self._psi), math.cos(0.5 * pitch), math.sin(0.5 * self._psi), math.sin(0.5 * pitch),
        )  # fmt: skip
        s[n.S_Q : n.S_Q + 4] = ch * cp, -sh * sp, ch * sp, sh * cp
        s[n.S_W : n.S_W + 3] = 0.0, rate, 0.0
        s[n.S_V : n.S_V + 3] = c * vx, e * vx, -vup
        x = float(a.f[kt.F_X])
        s[n.S_P : n.S_P + 3] = self._aside[0] + c * x, self._aside[1] + e * x, -height
        s[n.S_T] = float(a.f[kt.F_THRUST])
        s[n.S_SURF : n.S_SURF + 3] = 0.0, float(a.controls[1]), 0.0
        up = ah + float(a.a[kt.A_GRAV])
        ct, st = math.cos(pitch), math.sin(pitch)
        o[0:3] = ax * ct + up * st, 0.0, ax * st - up * ct
        o[n.O_ACC : n.O_ACC + 3] = c * ax, e * ax, -ah
        o[n.O_V], o[n.O_ALPHA], o[n.O_MASS] = airspeed, alpha, float(a.a[kt.A_MASS])
        o[n.O_PRESS] = isa(height)[1]
        o[n.O_AVAIL] = kt.full_thrust(airspeed, a.a)
        o[n.O_EULER : n.O_EULER + 3] = self._psi, pitch, 0.0
        for i in range(len(self.probes)):  # the probe is told the flow at the centre of gravity
            o[n.O_PROBE + 3 * i : n.O_PROBE + 3 * i + 3] = airspeed, alpha, 0.0
        along, rise = float(a.truth[7]), float(a.truth[8])
        self.wind[:3] = c * along, e * along, -rise

    def advance(self, jam: list[float]) -> None:
        _, elevator, _, throttle, _, _ = self.path.current
        if jam[1] <= 0.5:
            self._elevator = elevator
        a = self.flight
        a.controls[:] = throttle * self._full, self._elevator
        a.step(a.controls)
