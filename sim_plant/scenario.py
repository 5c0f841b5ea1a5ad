"""Scenario: one TOML file = one experiment. Typed, strict: an unknown, missing or out-of-range key is an error
naming it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from flightsw.aircraft import Airframe, load_airframe
from flightsw.aircraft.base import DEFAULT_MODEL
from flightsw.files import beside
from flightsw.plugins import AIRCRAFT, PartOf
from flightsw.strict import ConfigError, OneOf, Range, apply_overrides, convert, near, read_toml
from sim_plant.aircraft.kind import formation_models, kind_of
from sim_plant.aircraft.mismatch import Mismatch
from sim_plant.couplings.traffic_config import Track, TrafficCfg
from sim_plant.dump import dump
from sim_plant.earth.model import EARTHS
from sim_plant.failures.script import ACTIONS, PLANT, SENSORS, Event, check_event
from sim_plant.obeyed import check_obeyed, refuse
from sim_plant.sensors.config import Latency, NoiseCfg, NonNeg, Suite
from sim_plant.sensors.over import asked, lay_over
from sim_plant.sensors.terms import PAPER, grade_of
from sim_plant.silence import END, RULES
from sim_plant.wind.config import Wind

__all__ = ["ACTIONS", "SENSORS", "Event", "Scenario", "dump", "load_scenario"]

HERE = Path(__file__).parent / "scenarios"
Pos = Annotated[float, Range(1e-9)]
Prob = Annotated[float, Range(0.0, 1.0)]
V3 = tuple[float, float, float]


@dataclass(frozen=True)
class Meta:
    """[meta]: what the experiment is called, how long it lasts [s, simulated], the seed of every random draw."""

    name: str
    duration_s: Pos
    seed: Annotated[int, Range(0)] = 1
    purpose: str = ""


@dataclass(frozen=True)
class Clock:
    """[clock]: lockstep or paced by the wall, rates [Hz], and how long silence is borne."""

    mode: Annotated[str, OneOf(("lockstep", "realtime"))] = "lockstep"
    base_rate_hz: Annotated[int, Range(10, 1000)] = 100
    truth_hz: Annotated[int, Range(1, 1000)] = 20  # truth.tlog
    startup_timeout_s: Pos = 180.0  # [s, wall] until a flightsw first answers
    peer_timeout_s: Pos = 3.0  # [s, wall] until an aircraft that is not heard counts as silent
    silence: Annotated[str, OneOf(RULES)] = END  # then: end the run, let time wait, or fly on by its servo unit
    silence_end_s: Pos = 60.0  # [s, wall] of silence that end it all the same


@dataclass(frozen=True)
class Origin:
    """Where the local north-east-down frame touches the earth; heights are above mean sea level."""

    lat_deg: Annotated[float, Range(-85.0, 85.0)] = 35.18
    lon_deg: Annotated[float, Range(-180.0, 180.0)] = -97.44


@dataclass(frozen=True)
class Upset:
    """Attitude, rates and flow an aircraft starts with instead of those of its trim; controls and thrust are the trim's."""

    attitude_deg: V3 = (0.0, 0.0, 0.0)  # heading, pitch, roll
    rates_degps: V3 = (0.0, 0.0, 0.0)  # about the body axes
    V_mps: Annotated[float, Range(0.0, 400.0)] = 0.0  # airspeed; 0: that of the trim
    alpha_deg: Annotated[float, Range(-90.0, 90.0)] = 0.0
    beta_deg: Annotated[float, Range(-60.0, 60.0)] = 0.0


@dataclass(frozen=True)
class Start:
    """Trimmed level flight: own position, heading and airspeed, or (relative_to) offset and velocity of another
    aircraft. Out of it with an upset."""

    pos_n_m: V3 = (0.0, 0.0, -7010.0)
    V_mps: Pos = 195.0
    psi_deg: float = 0.0
    relative_to: str = ""
    xi_m: V3 = (0.0, 0.0, 0.0)  # in that aircraft's body axes
    upset: Upset | None = None


@dataclass(frozen=True)
class AircraftCfg:
    """[[aircraft]]: one aircraft, what flies it on board, how it starts, and whom it goes by."""

    name: str
    file: str
    sysid: Annotated[int, Range(1, 250)]
    mission: str = ""
    start: Start = field(default_factory=Start)
    fuel_kg: Annotated[float, Range(-1.0)] = -1.0  # -1: the file's default
    aero_error_frac: Annotated[float, Range(0.0, 0.9)] = 0.0  # each coefficient off by U(-x, x), seeded
    airframe: Annotated[str, OneOf(("derivatives", "full"))] = (
        "derivatives"  # full: Mach, thrust line, fuel's place, spool
    )
    mismatch: Mismatch = field(default_factory=Mismatch)
    rel_nav_to: str = ""  # carries relative navigation to this aircraft
    boom_to: str = ""  # refuels from this aircraft
    tacan_to: str = ""  # carries an air-to-air TACAN tuned to this aircraft, or to the name in [traffic]
    model: Annotated[str, PartOf(AIRCRAFT)] = DEFAULT_MODEL  # its kind (sim_plant/aircraft/kind.py)
    plant: dict[str, Any] = field(default_factory=dict)  # table of the kind, read by it


@dataclass(frozen=True)
class Link:
    """Plant-flightsw command path and the simulated radio between aircraft."""

    actuator_delay_ticks: Annotated[int, Range(0, 100)] = 1
    actuator_jitter_ticks: Annotated[int, Range(0, 100)] = 0
    radio_latency_ms: Latency = 50.0
    radio_loss: Prob = 0.0


@dataclass(frozen=True)
class Refuel:
    """Boom coupling: what makes and breaks contact besides the aircraft file's envelope."""

    capture_s: NonNeg = 1.0  # inside, latched and slow for this long
    capture_speed_mps: Pos = 0.6
    transfer_kgps: NonNeg = 2.5


@dataclass(frozen=True)
class Scenario:
    """One experiment. Raises ConfigError naming the key for what cannot be flown or would not be obeyed."""

    meta: Meta
    aircraft: tuple[AircraftCfg, ...]
    clock: Clock = field(default_factory=Clock)
    earth: Annotated[str, OneOf(tuple(EARTHS))] = "flat"  # six-DOF aircraft only
    origin: Origin = field(default_factory=Origin)
    wind: Wind = field(default_factory=Wind)
    noise: NoiseCfg = field(default_factory=NoiseCfg)
    sensors: dict[str, Suite] = field(default_factory=dict)
    link: Link = field(default_factory=Link)
    refuel: Refuel = field(default_factory=Refuel)
    track: Track = field(default_factory=Track)
    traffic: TrafficCfg = field(default_factory=TrafficCfg)
    event: tuple[Event, ...] = ()
    expect: dict[str, Any] = field(default_factory=dict)  # summary key -> bound, read by the launcher's tests

    def __post_init__(self) -> None:
        """Check what no single field shows: names, references, event contents. Raises ConfigError."""
        names = [a.name for a in self.aircraft]
        if not names:
            raise ConfigError("aircraft: a scenario needs at least one [[aircraft]] with its file")
        if len(set(names)) != len(names) or len({a.sysid for a in self.aircraft}) != len(names):
            raise ConfigError(
                f"aircraft: names and sysid must be unique, got {names} / {[a.sysid for a in self.aircraft]}"
            )
        if PLANT in names:
            raise ConfigError(f"aircraft.{PLANT}.name = {PLANT!r}: reserved for the plant as the target of commands")
        for i, a in enumerate(self.aircraft):
            # relative motion, wake and the frozen field are all measured from the first aircraft, the leader
            for key, ref in (
                ("start.relative_to", a.start.relative_to),
                ("rel_nav_to", a.rel_nav_to),
                ("boom_to", a.boom_to),
            ):
                if ref and (i == 0 or ref != names[0]):
                    allowed = "none on the first aircraft" if i == 0 else f"the first aircraft, {names[0]!r}"
                    raise ConfigError(f"aircraft.{a.name}.{key} = {ref!r}: allowed: {allowed}")
        self._check_models()
        others = [*names, self.traffic_name] if self.traffic.on else names
        if self.traffic.on and (self.traffic_name in names or self.traffic.sysid in [a.sysid for a in self.aircraft]):
            raise ConfigError(
                f"traffic.name = {self.traffic_name!r}, traffic.sysid = {self.traffic.sysid} with traffic.on = true: allowed: "
                "those of no aircraft"
            )
        for a in self.aircraft:
            if a.tacan_to and (a.tacan_to not in others or a.tacan_to == a.name):
                allowed = ", ".join(repr(x) for x in others if x != a.name) or "none (no other aircraft, [traffic] off)"
                raise ConfigError(f"aircraft.{a.name}.tacan_to = {a.tacan_to!r}: allowed: {allowed}")
        if self.wind.wake.source and self.wind.wake.source != names[0]:
            raise ConfigError(
                f"wind.wake.source = {self.wind.wake.source!r}: allowed: the first aircraft, {names[0]!r}"
            )
        if self.wind.bow.source and self.wind.bow.source not in names[1:]:
            raise ConfigError(
                f"wind.bow.source = {self.wind.bow.source!r}: allowed: an aircraft that follows the first, {', '.join(names[1:])}"
            )
        for key in self.sensors:
            if key not in names:
                raise ConfigError(f"sensors.{key}: no such aircraft; allowed: {', '.join(names)}{near(key, names)}")
        for i, e in enumerate(self.event):
            check_event(f"event[{i}]", e, names)
        check_obeyed(self)

    def _check_models(self) -> None:
        """Aircraft of a kind that does not fly in formation fly by themselves."""
        kinds = [kind_of(a) for a in self.aircraft]
        alone = [a.name for a, k in zip(self.aircraft, kinds, strict=True) if not k.formation]
        for a, k in zip(self.aircraft, kinds, strict=True):
            at = f"aircraft.{a.name}"
            k.check_has_table(a)
            if EARTHS[self.earth].round and not k.round_earth:
                raise ConfigError(f"earth = {self.earth!r}: allowed with {at}.model = {a.model!r}: flat")
            if self.wind.density != "isa" and not k.any_density:
                raise ConfigError(f"wind.density = {self.wind.density!r}: allowed with {at}.model = {a.model!r}: isa")
            refs = {"start.relative_to": a.start.relative_to, "tacan_to": a.tacan_to}
            if not k.formation:
                for key, ref in (refs | {"rel_nav_to": a.rel_nav_to, "boom_to": a.boom_to}).items():
                    if ref:
                        raise ConfigError(f"{at}.{key} = {ref!r}: allowed: none with model = {a.model!r}")
            for key, ref in refs.items():
                if ref in alone:
                    raise ConfigError(f"{at}.{key} = {ref!r}: allowed: aircraft of model = {formation_models()}")
        if (source := self.wind.wake.source) in alone:
            raise ConfigError(f"wind.wake.source = {source!r}: allowed: aircraft of model = {formation_models()}")

    def groups(self, a: AircraftCfg) -> set[str]:
        """Sensor groups an aircraft carries: those of its kind, air data, and those its place among the others asks for."""
        have = {*kind_of(a).carries, "air"}
        suite = self.suite(a.name)
        if grade_of(suite.radalt.grade, suite.grade) == PAPER:
            have.discard("radalt")
        if a.rel_nav_to:
            have.add("rel")
        if a.boom_to or any(other.boom_to == a.name for other in self.aircraft):
            have.add("boom")
        return have | {"tacan", "radar"} if a.tacan_to else have

    def _check_sounding(self) -> None:
        """The file can be read, and its balloon measured wind where the aircraft start."""
        if self.wind.prevailing != "sounding":
            return
        from sim_plant.wind.prevailing import read_sounding

        ascent = read_sounding(self.wind.sounding)
        for a in self.aircraft:
            height = -a.start.pos_n_m[2]
            if not a.start.relative_to and (why := ascent.lost(height)):
                raise ConfigError(
                    f"wind.sounding = {self.wind.sounding!r}: {why}, and aircraft.{a.name} starts at {height:.0f} m; "
                    "allowed: an ascent that measured the wind there"
                )

    @property
    def traffic_name(self) -> str:
        """What `tacan_to` says for the receiver of [traffic]."""
        return self.traffic.name

    def suite(self, name: str) -> Suite:
        """Sensor settings of an aircraft."""
        return self.sensors.get(name, Suite())

    def load_aircraft(self) -> list[Airframe]:
        """Aircraft records in scenario order; the tables of their models and the sounding are checked. Raises ConfigError
        naming what is wrong or what file does not exist."""
        self._check_sounding()
        out: list[Airframe] = []
        for a in self.aircraft:
            kind = kind_of(a)
            out.append(load_airframe(a.file))
            if not isinstance(out[-1], kind.record):
                raise ConfigError(
                    f"aircraft.{a.name}.file = {a.file!r}: an aircraft of model {out[-1].meta.model!r}; allowed: one of "
                    f"model = {a.model!r}"
                )
            kind.check(a)
            if not out[-1].probe:
                refuse(f"sensors.{a.name}.air", self.suite(a.name).air, f"on an aircraft without probes, {a.file!r}")
        return out


def load_scenario(name: str, overrides: dict[str, Any] | None = None) -> Scenario:
    """Scenario by name (file stem in sim_plant/scenarios) or path; `overrides` maps dotted keys to values. Files it names
    lie beside it, or are known by name.

    Raises ConfigError naming the file, the key and what is allowed.
    """
    path = Path(name) if name.endswith(".toml") else HERE / f"{name}.toml"
    if not path.exists():
        have = sorted(p.stem for p in HERE.glob("*.toml"))
        raise ConfigError(f"scenario {str(path)!r} does not exist; available: {', '.join(have)}{near(path.stem, have)}")
    sets = overrides or {}
    tree, file = read_toml(path), read_toml(path)
    apply_overrides(tree, sets, str(path))
    lay_over(tree, file, asked(sets), str(path))
    sc = convert(tree, Scenario, str(path))
    aircraft = tuple(replace(a, file=beside(path, a.file)) for a in sc.aircraft)
    return replace(sc, aircraft=aircraft, wind=replace(sc.wind, sounding=beside(path, sc.wind.sounding)))
