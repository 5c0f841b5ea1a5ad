"""Published aircraft data, one TOML file per aircraft, as typed records. Data only: no physics lives here, because the
plant and the onboard software read the same files and must share no mathematics.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from flightsw.strict import ConfigError, OneOf, Range, load, near, read_toml

HERE = Path(__file__).parent
Pos = Annotated[float, Range(1e-9)]
Pair = tuple[float, float]
V3 = tuple[float, float, float]


@dataclass(frozen=True)
class Meta:
    name: str
    title: str


@dataclass(frozen=True)
class Geometry:
    S_m2: Pos
    b_m: Pos
    c_m: Pos


@dataclass(frozen=True)
class Mass:
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
    lapse_mach: tuple[float, ...] = ()
    lapse_h_m: tuple[float, ...] = ()
    lapse_frac: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Controls:
    elevator_deg: Pair
    aileron_deg: Pair
    rudder_deg: Pair
    elevator_rate_degps: Pos
    aileron_rate_degps: Pos
    rudder_rate_degps: Pos
    servo_wn_radps: Pos
    servo_zeta: Pos
    flap_deg: Pair = (0.0, 0.0)  # lifting surfaces moved in flight, + trailing edge down; none: zeros


@dataclass(frozen=True)
class Limits:
    alpha_max_deg: Pos
    bank_max_deg: Pos
    V_min_mps: Pos
    V_max_mps: Pos


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
    wing_ac_m: V3
    tail_ac_m: V3
    tail_span_m: float = 0.0
    nose_m: V3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Probe:
    name: str
    position_m: V3


@dataclass(frozen=True)
class Airframe:
    """What both ends of a link must know of any aircraft, whatever equations it flies by."""

    meta: Meta
    mass: Mass
    controls: Controls
    limits: Limits
    probe: tuple[Probe, ...]


@dataclass(frozen=True)
class Aircraft(Airframe):
    """An aircraft flown by the six-degree-of-freedom equations."""

    geometry: Geometry
    inertia: Inertia
    aero: Aero
    engine: Engine
    wake: WakePoints
    boom: Boom | None = None
    receptacle: Receptacle | None = None


def find(name: str) -> Path:
    """File of an aircraft by stem ("kc135r") or path. Raises ConfigError naming what exists."""
    path = Path(name) if name.endswith(".toml") else HERE / f"{name}.toml"
    if not path.exists():
        have = sorted(p.stem for p in HERE.glob("*.toml"))
        raise ConfigError(
            f"aircraft file {str(path)!r} does not exist; available: {', '.join(have)}{near(path.stem, have)}"
        )
    return path


def load_aircraft(name: str) -> Aircraft:
    """Aircraft record by file stem ("kc135r") or path. Raises ConfigError naming what is wrong and what exists."""
    return load(find(name), Aircraft)


def load_airframe(name: str) -> Airframe:
    """As `load_aircraft`; a file without [aero] gives the bare record of an aircraft with equations of its own."""
    path = find(name)
    return load(path, Aircraft if "aero" in read_toml(path) else Airframe)
