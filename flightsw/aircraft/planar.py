"""Records of the aircraft that move in a vertical plane by equations of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.aircraft.base import Airframe, Limits, NonNeg, Pos
from flightsw.strict import ConfigError, Range

Row2 = tuple[float, float]
Row3 = tuple[float, float, float]
Row5 = tuple[float, float, float, float, float]
NEVER_MOVED = ("aileron_deg", "rudder_deg", "aileron_rate_degps", "rudder_rate_degps")


@dataclass(frozen=True)
class Body:
    """Mass, whole: fuel is not told apart."""

    kg: Pos


@dataclass(frozen=True)
class Level:
    """The level flight the derivatives hold at."""

    V_mps: Annotated[float, Range(5.0, 100.0)]
    height_m: Annotated[float, Range(-500.0, 5000.0)]
    gravity_mps2: Annotated[float, Range(9.7, 9.9)]


@dataclass(frozen=True)
class Force:
    """Force per unit of mass at the trim airspeed [m/s^2]: in trim, per rad of incidence, per rad/s of pitch rate, per rad of
    elevator and of flap."""

    trim: float
    alpha: float
    q: float
    elevator: float
    flap: float


@dataclass(frozen=True)
class Moment:
    """Pitching moment per unit of inertia at the trim airspeed: per rad/s of pitch rate [1/s], per rad of incidence, elevator and
    flap [1/s^2]."""

    q: float
    alpha: float
    elevator: float
    flap: float


@dataclass(frozen=True)
class SideForce:
    """Side force per unit of mass at the trim airspeed [m/s^2 per rad of sideslip]: how a cross wind takes the aircraft along."""

    beta: Annotated[float, Range(hi=0.0)]


@dataclass(frozen=True)
class Push:
    """Thrust per unit of mass [m/s^2]: in trim, and per unit of the source's throttle setting."""

    trim: Pos
    setting: Pos


@dataclass(frozen=True)
class Linear:
    """The source's linear model: dx/dt = A x + B u + E w; x = q, alpha_K, V_K, Theta, H; u = elevator, throttle setting, flap;
    w = alpha_W, V_W. SI and radians."""

    A: tuple[Row5, Row5, Row5, Row5, Row5]
    B: tuple[Row3, Row3, Row3, Row3, Row3]
    E: tuple[Row2, Row2, Row2, Row2, Row2]


def in_the_plane(ac: Airframe) -> None:
    """Raise ConfigError for a limit of bank, bars of the body, and a probe elsewhere than at the centre of gravity, whose flow
    these equations give."""
    if ac.limits.bank_max_deg != Limits.bank_max_deg:
        raise ConfigError(
            f"aircraft {ac.meta.name}: limits.bank_max_deg = {ac.limits.bank_max_deg:g}: it never banks; allowed: left out"
        )
    if ac.structure.bars:
        raise ConfigError(
            f"aircraft {ac.meta.name}: structure.bars: it flies alone and touches nobody; allowed: left out"
        )
    for i, p in enumerate(ac.probe):
        if any(p.position_m):
            raise ConfigError(
                f"aircraft {ac.meta.name}: probe.{i}.position_m = {list(p.position_m)}: allowed: [0.0, 0.0, 0.0], the flow at "
                "the centre of gravity"
            )


@dataclass(frozen=True)
class Alexis(Airframe):
    """Dimensional derivatives per unit of mass, elevator and flap on servos."""

    mass: Body
    trim: Level
    lift: Force
    drag: Force
    pitch: Moment
    thrust: Push
    side: SideForce
    linear: Linear

    def __post_init__(self) -> None:
        """Raises ConfigError for a surface these equations need or do not have, or travel that differs up and down."""
        super().__post_init__()
        in_the_plane(self)
        c, at = self.controls, f"aircraft {self.meta.name}"
        c.needs(
            at, "elevator_deg", "flap_deg", "elevator_rate_degps", "flap_rate_degps", "servo_wn_radps", "servo_zeta"
        )
        c.none_of(at, *NEVER_MOVED)
        for key in ("elevator_deg", "flap_deg"):
            lo, hi = getattr(c, key)
            if lo != -hi:
                raise ConfigError(f"{at}: controls.{key} = {[lo, hi]}: allowed: the same travel up and down")
        if not c.servo_zeta < 1.0:
            raise ConfigError(f"{at}: controls.servo_zeta = {c.servo_zeta:g}: allowed: below 1")


@dataclass(frozen=True)
class Wing:
    S_m2: Pos
    c_m: Pos


@dataclass(frozen=True)
class PitchInertia:
    Iyy_kgm2: Pos


@dataclass(frozen=True)
class AirAround:
    """Air density and gravity the flight is reckoned with."""

    rho_kgpm3: Annotated[float, Range(0.5, 1.5)]
    gravity_mps2: Annotated[float, Range(9.7, 9.9)]


@dataclass(frozen=True)
class LiftCurve:
    """C_L: straight up to straight_rad, rounded off to its top at top_rad; beyond, `fall` is lost over about fall_rad."""

    CL0: float
    CL_alpha: Pos
    CL_de: float
    straight_rad: Annotated[float, Range(0.01, 0.6)]
    top_rad: Annotated[float, Range(0.01, 0.6)]
    fall: NonNeg
    fall_rad: Pos

    def __post_init__(self) -> None:
        if not self.straight_rad < self.top_rad:
            raise ConfigError(f"lift.straight_rad = {self.straight_rad}, top_rad = {self.top_rad}; allowed: ascending")


@dataclass(frozen=True)
class DragCurve:
    """C_D = CD0 + K C_L^2 + beyond (alpha - straight_rad)^2, the last where incidence is beyond the straight part."""

    CD0: Pos
    K: NonNeg
    beyond: NonNeg


@dataclass(frozen=True)
class PitchCurve:
    """C_m: constant, per rad of incidence, of q c / 2V, of elevator."""

    Cm0: float
    Cm_alpha: float
    Cm_q: float
    Cm_de: float


@dataclass(frozen=True)
class SideCurve:
    """C_Y per rad of sideslip: how a cross wind takes the aircraft along."""

    CY_beta: Annotated[float, Range(hi=0.0)]


@dataclass(frozen=True)
class Jets:
    """Thrust at rest, what is lost per m/s, idle as a share of the largest, first-order lag."""

    thrust_N: Pos
    lapse_spm: Annotated[float, Range(0.0, 0.01)]
    idle_frac: Annotated[float, Range(0.0, 0.5)]
    lag_s: Annotated[float, Range(0.1, 20.0)]


@dataclass(frozen=True)
class TwinJet(Airframe):
    """Coefficients of a jet transport; the elevator follows its command at once (the source has no servo)."""

    mass: Body
    geometry: Wing
    inertia: PitchInertia
    air: AirAround
    lift: LiftCurve
    drag: DragCurve
    pitch: PitchCurve
    side: SideCurve
    engine: Jets

    def __post_init__(self) -> None:
        """Raises ConfigError for a surface these equations need or do not have."""
        super().__post_init__()
        in_the_plane(self)
        c, at = self.controls, f"aircraft {self.meta.name}"
        c.needs(at, "elevator_deg")
        c.none_of(
            at, *NEVER_MOVED, "flap_deg", "flap_rate_degps", "elevator_rate_degps", "servo_wn_radps", "servo_zeta"
        )
