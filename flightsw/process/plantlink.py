"""The onboard end of the plant link, of whatever kind the flight file or the command line names."""

from __future__ import annotations

from flightsw.icd.lines import TCP, UDP, parse_line
from flightsw.icd.link import PLANT_PORT, LinkError, UdpLink, plant_port
from flightsw.icd.signing import PLANT, Security
from flightsw.icd.stream_link import StreamLink
from flightsw.process.clock import monotonic_us
from flightsw.process.config import FlightConfig
from flightsw.strict import ConfigError


def link_overrides(text: str) -> dict[str, object]:
    """Keys of a flight file for the option `--link`. Raises ConfigError quoting the text."""
    try:
        line = parse_line(text, PLANT_PORT if text.startswith(UDP) else 0)
    except LinkError as e:
        raise ConfigError(f"--link: {e}") from None
    if line.kind == UDP:
        port = line.port if text.count(":") > 1 else 0  # without a port: that of the system id
        return {"link.host": line.host, "link.plant_port": port, "link.line": '""'}
    out: dict[str, object] = {"link.line": f'"{line}"'}
    return out | ({"link.host": line.host} if line.kind == TCP else {})


def open_plant(cfg: FlightConfig, realtime: bool, port_offset: int, security: Security) -> UdpLink | StreamLink:
    """The link of a configuration. Raises LinkError, SigningError."""
    use = f"plant link of {cfg.app.name}, sysid {cfg.app.sysid}"
    if cfg.link.line:
        return StreamLink(
            cfg.link.stream(), use, _now_s, listen=True, whole=not realtime, security=security, ident=PLANT
        )
    port = cfg.link.plant_port or plant_port(cfg.app.sysid, port_offset)
    return UdpLink(port, use, cfg.link.host, security=security, ident=PLANT)


def _now_s() -> float:
    return monotonic_us() * 1e-6
