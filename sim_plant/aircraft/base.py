"""A member of the plant's world: one aircraft, of whatever kind. What the world, the air and the couplings ask of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Boom, Receptacle
from flightsw.strict import ConfigError
from flightsw.types import SensorFrame
from sim_plant.actuators import CommandPath, Values
from sim_plant.aircraft.kind import Setup
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.sensors.bank import Bank
from sim_plant.sensors.base import View
from sim_plant.sensors.suite import sensors_of
from sim_plant.servo_unit import ServoUnit
from sim_plant.wind.config import Bow, Wake
from sim_plant.wind.field import AirMass
from sim_plant.wind.wake import Exposure

Arr = NDArray[np.float64]
MAG_N = np.array([0.215, 0.010, 0.440])  # [gauss] earth's field at the origin, NED (mid-latitude dipole)


@dataclass(frozen=True)
class Tanks:
    """What fuel can be taken on: tanks [kg], and mass with it [kg]."""

    capacity_kg: float
    mass_max_kg: float


class Member(ABC):
    """Base of every kind's class. A world calls start() once, then per tick: the air fills `free` (wind without wake [3], m/s
    NED), `wind` (effective wind [NW]) and `probe_wake` ([probes, 3] m/s NED); observe(); sensors read `view`; advance().

    `view` holds state and what instruments see (layout.py) as plain floats, current after start() and observe(), and what
    couplings put there. A kind that flies in formation keeps both in the arrays `s` [NS] and `obs` [NO] too, `s` also current
    after advance(): that is what others are measured from. `calm` is `free` without gusts; wind of a kind's own comes on top of
    `free`, into `wind`.
    """

    # what others can meet at it, if it has one
    boom: Boom | None = None
    receptacle: Receptacle | None = None
    tanks: Tanks | None = None
    exposure: Exposure | None = None  # where it feels a wake
    engines = 0  # that can fail
    well = False  # within `bounds` (layout.py) as last observed, by a kind that looks: not lost
    leak_kgps = 0.0  # fuel it loses (of a kind that has `tanks`)

    trim: Values  # the command that holds the start: aileron, elevator, rudder [rad], throttle, latch, flap [rad]
    path: CommandPath  # `path.current`: the command in force
    unit: ServoUnit

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError for a sensor's rate that does not fit."""
        self.setup, self.kind, self.cfg, self.ac = setup, setup.kind, setup.cfg, setup.ac
        self.dt_s = 1.0 / setup.sc.clock.base_rate_hz
        self.probes = np.array([p.position_m for p in self.ac.probe]).reshape(-1, 3)
        self.sensors = sensors_of(setup.sc, self.cfg, tuple(p.name for p in self.ac.probe), setup.seed)
        self.bank = Bank(self.sensors, len(self.probes))
        self.s, self.obs = np.zeros(n.NS), np.zeros(n.NO)
        self.bounds = np.full(n.NB, math.nan)
        self.wind, self.free, self.calm = np.zeros(n.NW), np.zeros(3), np.zeros(3)
        self.probe_wake = np.zeros((len(self.probes), 3))
        self.view = View(len(self.probes))
        self.frame = SensorFrame()

    def hold(self, trim: Values) -> None:
        """Begin with this command in force."""
        link = self.setup.sc.link
        self.trim = trim
        self.unit = ServoUnit(self.ac.controls, trim, self.setup.seed, self.cfg.name)
        self.path = CommandPath(
            self.setup.seed, self.cfg.name, link.actuator_delay_ticks, link.actuator_jitter_ticks, trim
        )

    def show(self) -> None:
        """Copy `s` and `obs` into the view."""
        self.view.see(self.s.copy(), self.obs)

    def check_limits(self) -> None:
        """Raise ConfigError for a start beyond the limits of the aircraft's file; an upset may be beyond its incidence."""
        o, limits = self.view.o, self.ac.limits
        V, alpha = o[n.O_V], math.degrees(o[n.O_ALPHA])
        stalled = abs(alpha) > limits.alpha_max_deg and self.cfg.start.upset is None
        if not limits.V_min_mps <= V <= limits.V_max_mps or stalled:
            raise ConfigError(
                f"aircraft.{self.cfg.name}.start: {V:.1f} m/s of airspeed at {alpha:.1f} deg of incidence; allowed by the limits "
                f"of {self.cfg.file!r}: {limits.V_min_mps:g} to {limits.V_max_mps:g} m/s, up to {limits.alpha_max_deg:g} deg"
            )

    def set_power(self, share: list[float]) -> None:
        """From now on engine i gives share[i] [-] of the thrust it would; only with `engines`."""
        raise NotImplementedError

    @property
    @abstractmethod
    def height_m(self) -> float:
        """Height [m] now, also between advance() and observe()."""

    @abstractmethod
    def track(self) -> tuple[float, float]:
        """North and east component of the unit vector along which turbulence of axes "track" lies."""

    @abstractmethod
    def start(self, air: AirMass, other: Member | None) -> None:
        """Put it into steady flight in the mean wind (gusts not in it), call hold(), and observe. other: whom its start is
        relative to. Raises ConfigError where there is no such flight."""

    @abstractmethod
    def observe(self) -> None:
        """Bring the view to the present tick, in the wind the air has just filled in."""

    @abstractmethod
    def advance(self, jam: list[float]) -> None:
        """Fly one tick with `path.current` in force; jam [3]: 1 = aileron (or what is in its place), elevator, rudder frozen."""

    def air(self, height_m: float) -> tuple[float, float, float, float]:
        """Temperature [K], pressure [Pa], density [kg/m^3], speed of sound [m/s] it meets at a height [m]."""
        return isa(height_m)

    def wake_source(self, wake: Wake) -> Arr | None:
        """Source vector (wind/vortex.py) of the wake it sheds; None: this kind sheds none."""
        return None

    def bow_source(self, bow: Bow) -> Arr | None:
        """The same of what it does to the air ahead of it; None: nothing. Raises ConfigError for a body it cannot have."""
        return None
