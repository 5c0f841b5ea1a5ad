"""The small UAV in the plant's world: flight.py behind the house's sensors, faults and command path.

Throttle 0 to 1 is thrust per mass from none to twice that of level flight. Two of these in one scenario meet the turbulence of
their tables at the same time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from flightsw.aircraft import Alexis as Record
from flightsw.strict import ConfigError, Range
from sim_plant.aircraft.alexis.dynamics import A_T0, A_TSET, F_HEIGHT, F_VUP, F_VX
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams, AlexisSensors, AlexisServo
from sim_plant.aircraft.base import Member
from sim_plant.aircraft.kind import Setup
from sim_plant.aircraft.planar import Planar
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.wind.field import AirMass
from sim_plant.wind.planar import PlanarWind

PERFECT = AlexisSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # errors are those of the scenario's sensors
TRIM = (0.0, 0.0, 0.0, 0.5, False, 0.0)


@dataclass(frozen=True)
class AlexisTable:
    """[aircraft.plant] with model = "alexis". Factors multiply forces and moments as a whole; `ticks`: integration steps per
    base tick; wind: Dryden turbulence and discrete gusts along this flight."""

    linear: bool = False
    lift_factor: Annotated[float, Range(0.1, 3.0)] = 1.0
    moment_factor: Annotated[float, Range(0.1, 3.0)] = 1.0
    stall_deg: Annotated[float | None, Range(1.0, 90.0)] = None  # incidence at which lift no longer grows; None: never
    ticks: Annotated[int, Range(1, 100)] = 4
    servo: AlexisServo = field(default_factory=AlexisServo)
    wind: PlanarWind = field(default_factory=lambda: PlanarWind(0.0, 0.0))


class AlexisMember(Planar):
    """One ALEXIS. Its start must be at the trim airspeed of its file."""

    engines = 1
    _power = 1.0

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError for another airspeed at the start, or a table the kind does not take."""
        super().__init__(setup)
        cfg, ac, t = self.cfg, setup.record(Record), setup.table(AlexisTable)
        north, east, down = cfg.start.pos_n_m
        self._table = t
        self._params = AlexisParams(
            linear=t.linear, aircraft=ac, height_m=-down, lift_factor=t.lift_factor, moment_factor=t.moment_factor,
            stall_deg=t.stall_deg, servo=t.servo, sensors=PERFECT,
        )  # fmt: skip
        if cfg.start.V_mps != self._params.V_mps:
            raise ConfigError(
                f"aircraft.{cfg.name}.start.V_mps = {cfg.start.V_mps}: allowed: {self._params.V_mps:g}, the model's trim"
            )
        self._at = [north, east]
        self.mass_kg = ac.mass.kg
        self._slope = ac.side.beta

    def start(self, air: AirMass, other: Member | None) -> None:
        ahead, _, sinking = self.meet(air)
        t = self._table
        self.flight = Alexis(
            self._params, t.wind, self.setup.seed, self.ticks * self.dt_s, self.dt_s, t.ticks, (sinking, ahead)
        )
        self.hold(TRIM)
        self.observe()

    @property
    def height_m(self) -> float:
        """Height [m]."""
        return float(self.flight.f[F_HEIGHT])

    def observe(self) -> None:
        a, s, o = self.flight, self.view.s, self.view.o
        ahead, cross, sinking = self.along(self.free)
        a.breathe(sinking, ahead)
        vx, vup = float(a.f[F_VX]), float(a.f[F_VUP])
        rate, alpha, airspeed, pitch, height = (float(x) for x in a.reading[:5])
        down, tail = (float(x) for x in a.air)
        self.attitude(pitch, rate, vx, vup)
        s[n.S_P : n.S_P + 3] = self._at[0], self._at[1], -height
        push = float(a.a[A_T0] + a.a[A_TSET] * a.command[1])
        s[n.S_T] = push * self.mass_kg
        elevator, flap = a.surfaces
        s[n.S_SURF : n.S_SURF + 3] = flap, elevator, 0.0
        fx, fz = a.specific_force
        o[0:3] = fx, self.flow(airspeed, alpha, self._slope * (airspeed / a.p.V_mps) ** 2), fz
        o[n.O_MASS], o[n.O_PRESS] = self.mass_kg, isa(height)[1]
        o[n.O_AVAIL] = 2.0 * float(a.a[A_T0]) * self.mass_kg
        self.wind[:3] = *self.level(tail, cross), down

    def set_power(self, share: list[float]) -> None:
        self._power = share[0]

    def advance(self, jam: list[float]) -> None:
        a = self.flight
        _, elevator, _, throttle, _, flap = self.path.current
        setting = (2.0 * throttle * self._power - 1.0) * a.a[A_T0] / a.a[A_TSET]
        a.freeze(elevator=jam[1] > 0.5, flap=jam[0] > 0.5)
        before, aside = float(a.f[F_VX]), self.side_m
        a.command[:] = elevator, setting, flap
        a.step(a.command)
        self.carry()
        d, aside = 0.5 * (before + float(a.f[F_VX])) * self.dt_s, self.side_m - aside
        north, east = self.level(d, aside)
        self._at[0] += north
        self._at[1] += east
