"""What both ends of a link must know of any aircraft, whatever equations it flies by."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

from flightsw.aircraft.structure import Structure
from flightsw.plugins import RECORDS, PartOf
from flightsw.strict import ConfigError, OneOf, Range, load, near, read_toml

HERE = Path(__file__).parent
Pos = Annotated[float, Range(1e-9)]
NonNeg = Annotated[float, Range(0.0)]
Pair = tuple[float, float]
V3 = tuple[float, float, float]
PROBES = 4  # what AIR_DATA carries
DEFAULT_MODEL = "sixdof"  # of a file that names none
HOLD, TRIM, LEVEL = "hold", "trim", "level"
T = TypeVar("T", bound="Airframe")


@dataclass(frozen=True)
class Meta:
    """`model` names the equations, and by them the type of the record (entry points `wakefield.records`)."""

    name: str
    model: Annotated[str, PartOf(RECORDS)] = DEFAULT_MODEL


@dataclass(frozen=True)
class Controls:
    """Travel of the surfaces [deg], rates [deg/s], and the servos, second order. What is left out the aircraft has not: a surface
    of no travel, a surface without a rate or servo of its own follows its command at once."""

    elevator_deg: Pair
    aileron_deg: Pair = (0.0, 0.0)
    rudder_deg: Pair = (0.0, 0.0)
    flap_deg: Pair = (0.0, 0.0)  # lifting surfaces moved in flight, + trailing edge down
    elevator_rate_degps: NonNeg = 0.0
    aileron_rate_degps: NonNeg = 0.0
    rudder_rate_degps: NonNeg = 0.0
    flap_rate_degps: NonNeg = 0.0
    servo_wn_radps: NonNeg = 0.0
    servo_zeta: NonNeg = 0.0
    # what the servos do by themselves once no command has come for so many ticks: keep the last, go to the trim of steady flight,
    # or hold wings and pitch level about it
    silent: Annotated[str, OneOf((HOLD, TRIM, LEVEL))] = HOLD
    silent_ticks: Annotated[int, Range(1, 1000)] = 5
    silent_pitch_deg: Annotated[float, Range(-10.0, 10.0)] = 0.0  # level: pitch held, from that of the trim
    silent_throttle: Annotated[float, Range(0.0, 2.0)] = 1.0  # trim and level: times the throttle of the trim

    def __post_init__(self) -> None:
        """Raises ConfigError for what the rule of silence does not ask for."""
        unasked = {HOLD: ("silent_ticks", "silent_pitch_deg", "silent_throttle"), TRIM: ("silent_pitch_deg",)}
        for key in unasked.get(self.silent, ()):
            if getattr(self, key) != getattr(Controls, key):
                raise ConfigError(
                    f"controls.{key} = {getattr(self, key)}: nothing obeys it with silent = {self.silent!r}"
                )

    def needs(self, at: str, *keys: str) -> None:
        """Raise ConfigError naming the first of `keys` that is left out; `at` names the aircraft."""
        for key in keys:
            value = getattr(self, key)
            if value in (0.0, (0.0, 0.0)):
                raise ConfigError(f"{at}: controls.{key} = {value}: needed by the equations of this aircraft")

    def none_of(self, at: str, *keys: str) -> None:
        """Raise ConfigError naming the first of `keys` that is set although the equations have no use for it."""
        for key in keys:
            value = getattr(self, key)
            if value not in (0.0, (0.0, 0.0)):
                raise ConfigError(
                    f"{at}: controls.{key} = {value}: the equations of this aircraft have none; allowed: left out"
                )


@dataclass(frozen=True)
class Limits:
    """Where the aircraft may be asked to fly: incidence of steady flight, bank commanded, airspeed commanded or started with."""

    alpha_max_deg: Pos
    V_min_mps: Pos
    V_max_mps: Pos
    bank_max_deg: Annotated[float, Range(1.0, 90.0)] = 90.0  # 90: it never banks


@dataclass(frozen=True)
class Probe:
    """An air-data probe, body axes; faults and their messages know it by its number and name."""

    name: str
    position_m: V3


@dataclass(frozen=True)
class Airframe:
    """Common part of every aircraft record."""

    meta: Meta
    controls: Controls
    limits: Limits
    structure: Structure
    probe: tuple[Probe, ...]

    def __post_init__(self) -> None:
        """Raises ConfigError for limits out of order and probes the link cannot tell apart or carry."""
        names = [p.name for p in self.probe]
        if len(names) > PROBES or len(set(names)) != len(names):
            raise ConfigError(
                f"aircraft {self.meta.name}: probe.name = {names}: allowed: up to {PROBES}, of different names"
            )
        if not self.limits.V_min_mps < self.limits.V_max_mps:
            raise ConfigError(
                f"aircraft {self.meta.name}: limits.V_min_mps = {self.limits.V_min_mps:g}: allowed: below V_max_mps = "
                f"{self.limits.V_max_mps:g}"
            )

    @property
    def fuel_capacity_kg(self) -> float:
        """What a gauge shows as full; 0: fuel is not told apart."""
        return 0.0


def find(name: str) -> Path:
    """File of an aircraft by stem ("kc135r") or path. Raises ConfigError naming what exists."""
    path = Path(name) if name.endswith(".toml") else HERE / f"{name}.toml"
    if not path.exists():
        have = sorted(p.stem for p in HERE.glob("*.toml"))
        raise ConfigError(
            f"aircraft file {str(path)!r} does not exist; available: {', '.join(have)}{near(path.stem, have)}"
        )
    return path


def model_of(path: Path) -> str:
    """meta.model of an aircraft file. Raises ConfigError for one that cannot be read or is no name."""
    meta = read_toml(path).get("meta", {})
    model = meta.get("model", DEFAULT_MODEL) if isinstance(meta, dict) else DEFAULT_MODEL
    if not isinstance(model, str):
        raise ConfigError(f"{path}: meta.model = {model!r}: expected a name")
    return model


def load_as(name: str, cls: type[T], model: str) -> T:
    """Record of an aircraft that flies by the equations `model`. Raises ConfigError for another one, or naming what is wrong."""
    path = find(name)
    if (has := model_of(path)) != model:
        raise ConfigError(f"{path}: meta.model = {has!r}: allowed here: {model!r}")
    return load(path, cls)
