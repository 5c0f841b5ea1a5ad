"""Configuration of one flight process: strict TOML into frozen dataclasses.

[app], [origin], [link] and [telemetry] are read here. Everything else in the file belongs to the mission and stays a
plain tree; `FlightApp` converts it, as strictly.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any

from flightsw.files import beside
from flightsw.icd.geo import Origin
from flightsw.icd.lines import Line, parse_line
from flightsw.icd.link import GROUND_PORT, OPERATOR_PORT, LinkError
from flightsw.icd.rates import MAX_RATE_HZ
from flightsw.icd.scaling import STATIONS
from flightsw.strict import OneOf, Range, Tree, apply_overrides, convert, read_toml, to_dict

Hz = Annotated[float, Range(0.0, MAX_RATE_HZ)]
Port = Annotated[int, Range(1, 65535)]


@dataclass(frozen=True)
class AppConfig:
    """What flies: mission and aircraft file, under which name and MAVLink system id, at which base rate."""

    name: str
    mission: str
    aircraft: str
    sysid: Annotated[int, Range(1, 250)]
    base_rate_hz: Annotated[int, Range(10, 1000)] = 100
    mission_rate_hz: Annotated[int, Range(1, 1000)] = 20

    def __post_init__(self) -> None:
        if self.base_rate_hz % 10:
            raise ValueError(f"base_rate_hz = {self.base_rate_hz}: allowed: multiples of 10")
        if 250_000 % self.base_rate_hz:
            raise ValueError(f"base_rate_hz = {self.base_rate_hz}: the period must be a multiple of 4 us (log stamps)")
        if self.base_rate_hz % self.mission_rate_hz:
            raise ValueError(
                f"mission_rate_hz = {self.mission_rate_hz}: must divide base_rate_hz = {self.base_rate_hz}"
            )


@dataclass(frozen=True)
class OriginConfig:
    """Origin of the local north-east-down frame; the plant must use the same."""

    lat_deg: Annotated[float, Range(-85.0, 85.0)] = Origin().lat_deg
    lon_deg: Annotated[float, Range(-180.0, 180.0)] = Origin().lon_deg
    alt_m: Annotated[float, Range(-500.0, 9000.0)] = 0.0

    def origin(self) -> Origin:
        """The record geo.py wants."""
        return Origin(self.lat_deg, self.lon_deg, self.alt_m)


@dataclass(frozen=True)
class LinkConfig:
    """Ports and time-outs of the plant link and of the data link between aircraft. Port 0 = the port plan of
    icd/link.py.
    """

    host: str = "127.0.0.1"
    plant_port: Annotated[int, Range(0, 65535)] = 0
    telemetry_port: Annotated[int, Range(0, 65535)] = 0
    line: str = ""  # instead of UDP on host and plant_port: tcp:HOST:PORT to listen on, or serial:DEVICE:BAUD
    targets: tuple[str, ...] = (f"127.0.0.1:{GROUND_PORT}", f"127.0.0.1:{OPERATOR_PORT}")
    startup_timeout_s: Annotated[float, Range(0.1, 3600.0)] = 180.0  # wall time to the first datagram
    peer_timeout_s: Annotated[float, Range(0.1, 600.0)] = 3.0  # wall time between datagrams
    silence: Annotated[str, OneOf(("end", "wait"))] = "end"  # what follows: the process ends, or waits for the plant
    silence_end_s: Annotated[float, Range(0.1, 3600.0)] = 60.0  # wall time of silence that ends it all the same
    delay_ticks: Annotated[int, Range(0, 20)] = 1  # transport delay the control law allows for
    broadcast_peer: bool = False  # send own state to the other aircraft
    peer_rate_hz: Annotated[int, Range(1, 100)] = 20
    raw_fix: bool = False  # and every GNSS fix as it came
    peer_sysid: Annotated[int, Range(0, 250)] = 0  # whose state to accept; 0 = any other aircraft
    operators: Annotated[tuple[int, int], Range(1, 255)] = (
        STATIONS  # system ids from, to, that may command; the others may look
    )
    simulated: bool = True  # false: it flies hardware, and no failure is handed on

    def __post_init__(self) -> None:
        for text in self.targets:
            parse_target(text)
        if self.line and not self.stream().stream:
            allowed = "tcp:HOST:PORT, serial:DEVICE:BAUD; UDP by host and plant_port"
            raise ValueError(f"line = {self.line!r}: allowed: {allowed}")
        if self.silence == "end" and self.silence_end_s != LinkConfig.silence_end_s:
            raise ValueError(f"silence_end_s = {self.silence_end_s}: allowed with silence = 'wait'")
        if not self.broadcast_peer and self.peer_rate_hz != LinkConfig.peer_rate_hz:
            raise ValueError(f"peer_rate_hz = {self.peer_rate_hz}: allowed with broadcast_peer = true")
        if self.raw_fix and not self.broadcast_peer:
            raise ValueError("raw_fix = true: allowed with broadcast_peer = true")

    def stream(self) -> Line:
        """Of `line`, which is not empty. Raises ValueError."""
        try:
            return parse_line(self.line, 0)
        except LinkError as e:
            raise ValueError(f"line: {e}") from None


@dataclass(frozen=True)
class TelemetryConfig:
    """Rates that differ from icd/rates.py: message name -> Hz, 0 = off."""

    rates_hz: dict[str, Hz] = field(default_factory=dict)


@dataclass(frozen=True)
class FlightConfig:
    """One flight file. `tables`: everything else in it, the mission's own."""

    app: AppConfig
    origin: OriginConfig = field(default_factory=OriginConfig)
    link: LinkConfig = field(default_factory=LinkConfig)
    telemetry: TelemetryConfig = field(default_factory=TelemetryConfig)
    tables: Tree = field(default_factory=dict)

    @property
    def period_us(self) -> int:
        """Base period [us]."""
        return 1_000_000 // self.app.base_rate_hz


def parse_target(text: str) -> tuple[str, int]:
    """Host and port of "host:port". Raises ValueError."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 1 <= int(port) <= 65535:
        raise ValueError(f"targets: {text!r}: expected host:port with a port of 1 to 65535")
    return host, int(port)


OWN = tuple(f.name for f in fields(FlightConfig) if f.name != "tables")  # tables read here


def load_flight(path: str | Path, overrides: dict[str, Any] | None = None) -> FlightConfig:
    """Read a flight file; `overrides` maps dotted keys to values. Files it names lie beside it, or are known by
    name. Raises ConfigError naming file, key and what is allowed.
    """
    data = read_toml(path)
    apply_overrides(data, overrides or {}, str(path))
    cfg = flight_of(data, str(path))
    return replace(cfg, app=replace(cfg.app, aircraft=beside(path, cfg.app.aircraft)), tables=_found(path, cfg.tables))


def _found(path: str | Path, tables: Tree) -> Tree:
    """Tables whose words that name a file found beside `path` are where it is."""
    out = {}
    for k, v in tables.items():
        out[k] = _found(path, v) if isinstance(v, dict) else beside(path, v) if isinstance(v, str) else v
    return out


def flight_of(tree: Tree, where: str) -> FlightConfig:
    """The record of a parsed flight file. Raises ConfigError naming the key."""
    cfg = convert({k: v for k, v in tree.items() if k in OWN}, FlightConfig, where)
    return replace(cfg, tables={k: v for k, v in tree.items() if k not in OWN})


def flight_tree(cfg: FlightConfig) -> Tree:
    """The inverse: the tables of a flight file that `load_flight` reads back to an equal record."""
    tree = to_dict(cfg)
    return {k: tree[k] for k in OWN} | tree["tables"]
