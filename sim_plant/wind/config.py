"""[wind] of a scenario: what the one air mass is made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from flightsw.strict import OneOf, Range
from sim_plant.wind.levels import LEVELS, SPECTRA

NonNeg = Annotated[float, Range(0.0)]
Pos = Annotated[float, Range(1e-9)]
V3 = tuple[float, float, float]


@dataclass(frozen=True)
class GustStep:
    """From t_s on the turbulence has this intensity."""

    t_s: NonNeg
    sigma_mps: NonNeg


@dataclass(frozen=True)
class Dryden:
    """[wind.dryden]: turbulence of this 1-sigma per axis and length, or of a level by name, along the track or fixed in NED."""

    sigma_mps: NonNeg = 0.0
    step: tuple[GustStep, ...] = ()  # ascending in t_s; before the first: sigma_mps
    L_m: Pos = 533.4
    V_mps: Pos = 195.0  # [m/s] airspeed of the shaping filters
    axes: Annotated[str, OneOf(("track", "ned"))] = "track"
    independent: bool = False  # False: frozen field, followers meet the leader's gusts later
    level: Annotated[str, OneOf(("none", *LEVELS))] = "none"  # MIL-F-8785C: intensity and length by height
    model: Annotated[str, OneOf(SPECTRA)] = "dryden"  # of the spectra
    over: Annotated[str, OneOf(("point", "mil", "field"))] = (
        "point"  # of an airframe: alike; turning by MIL-F-8785C; each place its own air
    )


@dataclass(frozen=True)
class Slow:
    """Slow Gauss-Markov variation of the north and east components (lee.md 3.5, ECWM)."""

    sigma_mps: NonNeg = 0.0
    tau_s: Pos = 20000.0
    from_zero: bool = False  # start at the prevailing wind instead of somewhere in the stationary spread


@dataclass(frozen=True)
class Sine:
    """Deterministic variation amplitude * sin(2 pi t / period + phase), north, east, down."""

    amplitude_mps: V3
    period_s: V3
    phase_rad: V3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Wake:
    """[wind.wake]: trailing vortices of one aircraft: cores [m] at the start, their growth [m^2/s], share of lift of the tail."""

    source: str = ""  # aircraft that sheds it; empty: none
    core_wing_m: Pos = 1.2
    core_tail_m: Pos = 0.6
    nu_m2ps: NonNeg = 1.0
    tail_lift_frac: Annotated[float, Range(-0.5, 0.5)] = -0.05
    path: Annotated[str, OneOf(("straight", "flown"))] = "straight"  # flown: the vortices lie where they were shed
    sink: bool = True  # of path flown: by each other's downwash,
    meander: Annotated[float, Range(0.0, 1.0)] = 0.0  # [-] share of their place's gusts that takes them along,
    edr_m2ps3: NonNeg = 0.0  # eddy dissipation rate of the air, by which they decay


@dataclass(frozen=True)
class Bow:
    """[wind.bow]: what a follower does to its leader's air: by its lift, a horseshoe vortex, and by its body, a Rankine oval."""

    source: str = ""  # the follower; empty: none
    core_m: Pos = 0.3  # of its vortices
    radius_m: NonNeg = 0.0  # of its body; 0: that of the longest bar in its file


@dataclass(frozen=True)
class Wind:
    """[wind]: the prevailing wind, and what is added to it."""

    prevailing: Annotated[str, OneOf(("constant", "sounding"))] = "constant"
    constant_mps: tuple[float, float] = (0.0, 0.0)  # north, east, air moves towards
    sounding: str = "sounding_oun_20181222_12z_uwyo.txt"
    density: Annotated[str, OneOf(("isa", "sounding"))] = "isa"  # sounding: at its temperature; six-DOF aircraft only
    slow: Slow = field(default_factory=Slow)
    sine: tuple[Sine, ...] = ()
    dryden: Dryden = field(default_factory=Dryden)
    wake: Wake = field(default_factory=Wake)
    bow: Bow = field(default_factory=Bow)
