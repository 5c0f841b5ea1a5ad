"""Published aircraft data, one TOML file per aircraft, as typed records. Data only: no physics lives here, because the
plant and the onboard software read the same files and must share no mathematics.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

from flightsw.aircraft.base import (
    DEFAULT_MODEL,
    V3,
    Airframe,
    Controls,
    Limits,
    Meta,
    Pair,
    Pos,
    Probe,
    find,
    load_as,
    model_of,
)
from flightsw.aircraft.planar import Alexis, TwinJet
from flightsw.plugins import RECORDS, part, parts
from flightsw.strict import ConfigError, OneOf, Range, load

__all__ = [
    "Aero", "Aircraft", "Airframe", "Alexis", "Boom", "Controls", "Engine", "Geometry", "Inertia", "Limits", "Mass", "Meta",
    "Probe", "Receptacle", "TwinJet", "WakePoints", "alexis", "load_aircraft", "load_airframe", "load_as",
    "record_types", "twinjet",
]  # fmt: skip


@dataclass(frozen=True)
class Geometry:
    S_m2: Pos
    b_m: Pos
    c_m: Pos


@dataclass(frozen=True)
class Mass:
    """Masses [kg]: empty with crew, the most it may have, what its tanks hold and usually hold at the start."""

    empty_kg: Pos
    max_kg: Pos
    fuel_capacity_kg: Pos
    default_fuel_kg: Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class Inertia:
    """Body-axis moments against mass; linear between points, end values held outside."""

    mass_kg: tuple[float, ...]
    Ixx_kgm2: tuple[float, ...]
    Iyy_kgm2: tuple[float, ...]
    Izz_kgm2: tuple[float, ...]
    Ixz_kgm2: tuple[float, ...]


@dataclass(frozen=True)
class Aero:
    """Stability-axis derivatives per radian; field order is the order of the parameter vectors."""

    CL0: float
    CL_alpha: float
    CL_alphadot: float
    CL_q: float
    CL_de: float
    CD0: float
    K: float
    Cm0: float
    Cm_alpha: float
    Cm_alphadot: float
    Cm_q: float
    Cm_de: float
    CY_beta: float
    CY_p: float
    CY_r: float
    CY_dr: float
    Cl_beta: float
    Cl_p: float
    Cl_r: float
    Cl_da: float
    Cl_dr: float
    Cn_beta: float
    Cn_p: float
    Cn_r: float
    Cn_da: float
    Cn_dr: float


@dataclass(frozen=True)
class Engine:
    """Thrust along body x through the centre of gravity. `lapse` names the altitude-Mach law of available thrust."""

    static_thrust_N: Pos
    lapse: Annotated[str, OneOf(("bypass", "table"))]
    idle_frac: Annotated[float, Range(0.0, 1.0)]
    tau_s: Pos
    tsfc_kgpNs: Pos
    y_m: tuple[float, ...] = (0.0,)  # of each engine, to the right: one that fails leaves the others' moment
    below_m: float = 0.0  # thrust line under the centre of gravity
    spool_idle_ps: Annotated[float, Range(0.0)] = (
        0.0  # greatest rise of thrust, as a share of that available per second,
    )
    spool_full_ps: Annotated[float, Range(0.0)] = 0.0  # at rest and at full thrust, straight between; 0: no limit
    lapse_mach: tuple[float, ...] = ()
    lapse_h_m: tuple[float, ...] = ()
    lapse_frac: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Stall:
    """Lift curve of the wing: straight to straight_deg, a parabola to its top CL_max; CL_min mirrors it."""

    straight_deg: Pos
    CL_max: Pos
    CL_min: Annotated[float, Range(-5.0, 0.0)]


@dataclass(frozen=True)
class Mach:
    """Compressibility: Mach number the derivatives hold at, sweep of the quarter-chord line, thickness, technology factor."""

    reference: Annotated[float, Range(0.0, 0.9)]
    sweep_deg: Annotated[float, Range(0.0, 60.0)]
    thickness: Annotated[float, Range(0.0, 0.3)]
    technology: Annotated[float, Range(0.5, 1.0)] = (
        0.87  # kappa of Korn's equation: 0.87 NACA 6-series, 0.95 supercritical
    )


@dataclass(frozen=True)
class Balance:
    """Where the fuel lies ahead of the centre of gravity the moments are about, which is that with `fuel_kg` on board."""

    fuel_x_m: float
    fuel_kg: Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class Boom:
    """Pivot in tanker body axes; elevation negative below the longitudinal axis, azimuth positive to the right."""

    pivot_m: V3
    length_retracted_m: Pos
    extension_m: Pair
    elevation_deg: Pair
    azimuth_deg: Pair
    radial_rate_max_mps: Pos


@dataclass(frozen=True)
class Receptacle:
    position_m: V3


@dataclass(frozen=True)
class WakePoints:
    """Points of wing and tail [m, body] where vortices are shed and wind is felt; tail span [m], 0: a third of the wing's."""

    wing_ac_m: V3
    tail_ac_m: V3
    tail_span_m: float = 0.0
    nose_m: V3 = (0.0, 0.0, 0.0)


SERVOED = ("aileron_deg", "rudder_deg", "elevator_rate_degps", "aileron_rate_degps", "rudder_rate_degps")


@dataclass(frozen=True)
class Aircraft(Airframe):
    """An aircraft flown by the six-degree-of-freedom equations."""

    mass: Mass
    geometry: Geometry
    inertia: Inertia
    aero: Aero
    engine: Engine
    wake: WakePoints
    stall: Stall | None = None  # none: the straight line goes on
    mach: Mach | None = None
    balance: Balance | None = None
    boom: Boom | None = None
    receptacle: Receptacle | None = None

    def __post_init__(self) -> None:
        """Raises ConfigError for what these equations need and the file leaves out, or have no use for."""
        super().__post_init__()
        at = f"aircraft {self.meta.name}"
        self.controls.needs(at, "elevator_deg", *SERVOED, "servo_wn_radps", "servo_zeta")
        self.controls.none_of(at, "flap_deg", "flap_rate_degps")

    @property
    def fuel_capacity_kg(self) -> float:
        """Of all tanks."""
        return self.mass.fuel_capacity_kg


def load_aircraft(name: str) -> Aircraft:
    """Six-degree-of-freedom record by file stem ("kc135r") or path. Raises ConfigError naming what is wrong and what exists."""
    return load_as(name, Aircraft, DEFAULT_MODEL)


def record_types() -> dict[str, type[Airframe]]:
    """Type of the record of every declared model."""
    return {name: _record(name, cls, RECORDS) for name, cls in parts(RECORDS, type).items()}


def _record(name: str, cls: type, at: str) -> type[Airframe]:
    if not issubclass(cls, Airframe):
        raise ConfigError(
            f"{at} = {name!r}: {cls.__name__} is no record of an aircraft; allowed: a subclass of Airframe"
        )
    return cls


def load_airframe(name: str) -> Airframe:
    """As `load_aircraft`, of whatever model the file names: one declared in `wakefield.records`, or `package.module:Record`."""
    path = find(name)
    model, at = model_of(path), f"{path}: meta.model"
    return load(path, _record(model, part(RECORDS, model, type, at), at))


@lru_cache(maxsize=1)
def alexis() -> Alexis:
    """The small UAV as published: what studies and tests fly. A mission and the plant are given the record they are to fly."""
    return load_as("alexis", Alexis, "alexis")


@lru_cache(maxsize=1)
def twinjet() -> TwinJet:
    """The jet transport as published; see `alexis`."""
    return load_as("twinjet", TwinJet, "twinjet")
