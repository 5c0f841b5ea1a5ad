"""The twin-jet transport in the plant's world: flight.py behind the house's sensors, faults and command path.

x is along the heading from the frame's origin: the downburst's axis is at its x_m. Throttle 0 to 1 is thrust
from none to that at rest, and the engine gives between idle and its limit of it. start.V_mps is the speed over the ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

from flightsw.aircraft import TwinJet as Record
from flightsw.strict import ConfigError, Range
from sim_plant.aircraft.base import Member
from sim_plant.aircraft.kind import Setup
from sim_plant.aircraft.planar import Planar
from sim_plant.aircraft.twinjet import dynamics as kt
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams, TwinJetSensors
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.wind import microburst_kernel as km
from sim_plant.wind.field import AirMass
from sim_plant.wind.microburst import Microburst
from sim_plant.wind.planar import Gust

PERFECT = TwinJetSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # errors are those of the scenario's sensors
Factor = Annotated[float, Range(0.1, 3.0)]
Sigma = Annotated[float, Range(0.0, 30.0)]
Length = Annotated[float, Range(1.0)]


@dataclass(frozen=True)
class TwinJetTable:
    """[aircraft.plant] with model = "twinjet": lift, drag and pitching moment over those of the model, slope at the start,
    downburst, Dryden turbulence along x and up with its scale lengths, discrete gusts."""

    lift_factor: Factor = 1.0
    drag_factor: Factor = 1.0
    moment_factor: Factor = 1.0
    slope_deg: Annotated[float, Range(0.0, 8.0)] = 3.0
    burst: Microburst = field(default_factory=lambda: Microburst(0.0))
    sigma_u_mps: Sigma = 0.0
    sigma_w_mps: Sigma = 0.0
    L_u_m: Length = 260.0
    L_w_m: Length = 100.0
    gusts: tuple[Gust, ...] = ()


class TwinJetMember(Planar):
    """One twin-jet, from steady flight on the slope."""

    engines = 2
    _power = 1.0

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError for a table the kind does not take."""
        super().__init__(setup)
        ac, t, off = setup.record(Record), setup.table(TwinJetTable), self.cfg.mismatch
        ac = replace(
            ac,
            mass=replace(ac.mass, kg=ac.mass.kg * off.mass),
            inertia=replace(ac.inertia, Iyy_kgm2=ac.inertia.Iyy_kgm2 * off.inertia),
            engine=replace(ac.engine, thrust_N=ac.engine.thrust_N * off.thrust, lag_s=ac.engine.lag_s * off.lag),
        )
        north, east, down = self.cfg.start.pos_n_m
        c, e = self.ahead
        x = c * north + e * east
        self._aside = (north - c * x, east - e * x)
        self._params = TwinJetParams(
            t.lift_factor, t.drag_factor, t.moment_factor, x, -down, self.cfg.start.V_mps, t.slope_deg, PERFECT, ac
        )
        self._own = TwinJetAir(t.burst, t.sigma_u_mps, t.sigma_w_mps, t.L_u_m, t.L_w_m, t.gusts)
        self._travel = tuple(math.radians(v) for v in ac.controls.elevator_deg)
        self._slope = 0.5 * ac.air.rho_kgpm3 * ac.geometry.S_m2 * ac.side.CY_beta / ac.mass.kg  # per airspeed squared

    def start(self, air: AirMass, other: Member | None) -> None:
        along, _, sinking = self.meet(air)
        at = f"aircraft.{self.cfg.name}.start"
        duration = self.ticks * self.dt_s
        try:
            self.flight = TwinJet(self._params, self._own, self.setup.seed, duration, self.dt_s, (along, -sinking))
        except ValueError as problem:
            raise ConfigError(f"{at}: {problem}") from None
        self._full = float(self.flight.a[kt.A_TMAX])
        thrust, elevator = (float(v) for v in self.flight.controls)
        alpha = float(self.flight.truth[4])
        if not (0.0 <= thrust <= self._full and abs(alpha) < self.flight.a[kt.A_PEAK]):
            raise ConfigError(
                f"{at}.V_mps = {self.cfg.start.V_mps:g}: steady flight there takes {thrust * 1e-3:.0f} kN at "
                f"{math.degrees(alpha):.0f} deg; allowed: up to {self._full * 1e-3:.0f} kN, below the stall"
            )
        self.hold((0.0, elevator, 0.0, thrust / self._full, False, 0.0))
        self._elevator = elevator
        self._offset = float(self.flight.m[km.M_Y])
        self.observe()

    @property
    def height_m(self) -> float:
        """Height [m]."""
        return float(self.flight.f[kt.F_H])

    def observe(self) -> None:
        a, s, o = self.flight, self.view.s, self.view.o
        free, cross, sinking = self.along(self.free)
        a.breathe(free, -sinking)
        height, vx, airspeed, alpha, pitch, rate, vup, ax, ah = (float(v) for v in a.reading)
        self.attitude(pitch, rate, vx, vup)
        north, east = self.level(float(a.f[kt.F_X]), self.side_m)
        s[n.S_P : n.S_P + 3] = self._aside[0] + north, self._aside[1] + east, -height
        s[n.S_T] = float(a.f[kt.F_THRUST])
        s[n.S_SURF : n.S_SURF + 3] = 0.0, float(a.controls[1]), 0.0
        up = ah + float(a.a[kt.A_GRAV])
        ct, st = math.cos(pitch), math.sin(pitch)
        aside = self.flow(airspeed, alpha, self._slope * airspeed * airspeed)
        o[0:3] = ax * ct + up * st, aside, ax * st - up * ct
        o[n.O_ACC : n.O_ACC + 3] = *self.level(ax, aside), -ah
        o[n.O_MASS], o[n.O_PRESS] = float(a.a[kt.A_MASS]), isa(height)[1]
        o[n.O_AVAIL] = kt.full_thrust(airspeed, a.a)
        along, rise = float(a.truth[7]), float(a.truth[8])
        self.wind[:3] = *self.level(along, cross), -rise

    def set_power(self, share: list[float]) -> None:
        self._power = sum(share) / self.engines
        self.flight.a[kt.A_TMAX] = self._full * self._power

    def advance(self, jam: list[float]) -> None:
        _, elevator, _, throttle, _, _ = self.path.current
        if jam[1] <= 0.5:
            self._elevator = min(max(elevator, self._travel[0]), self._travel[1])
        a = self.flight
        a.controls[:] = throttle * self._full * self._power, self._elevator
        a.step(a.controls)
        self.carry()
        a.m[km.M_Y] = self._offset - self.side_m  # the downburst stays where it is
