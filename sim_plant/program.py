"""The plant's process from its scenario to its exit code.

Machine-readable status goes to stdout, one JSON object a line; words for people go to stderr.
Exit code 0: scenario complete; 2: bad configuration or file; 3: a peer was lost; 4: an aircraft was lost;
130 / 143: interrupted.
"""

from __future__ import annotations

import gc
import signal
import time
from pathlib import Path
from types import FrameType
from typing import Any

from flightsw.cli import report, tell
from flightsw.icd.lines import UDP, Line, parse_line
from flightsw.icd.link import plant_port
from flightsw.icd.signing import SigningError, security
from flightsw.preload import preload
from flightsw.priority import realtime_priority
from flightsw.strict import ConfigError
from sim_plant.accounts import accounts
from sim_plant.loops import PeerLostError, StoppedError, UdpPlant
from sim_plant.peers import HOST
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.server import PlantServer
from sim_plant.world import AircraftLostError


class Stop:
    """Signals as a flag that is looked at between two ticks. A reader of the status lines that went away (the launcher was
    killed) counts as SIGPIPE: nobody is left to end the run."""

    def __init__(self) -> None:
        self.signum = 0
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on)

    def _on(self, number: int, _: FrameType | None) -> None:
        self.signum = number

    def say(self, record: dict[str, Any]) -> None:
        """One status line."""
        if not report(record):
            self.signum = self.signum or signal.SIGPIPE

    def status(self, t_us: int, tick: int, lines: dict[str, str]) -> None:
        """Where the run is, and how the lines to external aircraft are."""
        self.say({"t": t_us / 1e6, "tick": tick} | ({"lines": lines} if lines else {}))


def _say(text: str) -> None:
    tell(f"sim-plant: {text}")


def _overrides(pairs: list[str]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for p in pairs:
        key, sep, value = p.partition("=")
        if not sep or not key:
            raise ConfigError(f"--set {p!r}: expected key=value, for example noise.scale=2")
        out[key] = value
    return out


def _build(sc: Scenario, seed: int | None, run_dir: Path | None) -> PlantServer:
    try:
        return PlantServer(sc, seed, run_dir)
    except (ValueError, ArithmeticError, RuntimeError) as e:  # no trim where the scenario starts
        raise ConfigError(str(e)) from None


def _lines(external: list[str], server: PlantServer, port_offset: int) -> dict[str, Line]:
    """Options `--external` as aircraft -> line. Raises ConfigError, LinkError."""
    out = {}
    for text in external:
        name, _, line = text.partition("=")
        if name not in server.names:
            raise ConfigError(f"--external {text!r}: no such aircraft; allowed: {', '.join(server.names)}")
        port = plant_port(server.sysids[server.names.index(name)], port_offset)
        out[name] = parse_line(line or f"{UDP}:{HOST}", port)
    return out


def fly(
    scenario: str, seed: int | None, run_dir: Path | None, realtime: bool, port_offset: int, sets: list[str], stop: Stop,
    signing_key: Path | None = None, unsigned: bool = False, external: list[str] | None = None, speed: float = 0.0,
) -> int:  # fmt: skip
    """Run one scenario against flightsw processes; the exit code."""
    server: PlantServer | None = None
    link: UdpPlant | None = None
    outcome, code, lost, told = "completed", 0, "", ""
    try:
        overrides = _overrides(sets)
        if realtime:
            overrides["clock.mode"] = '"realtime"'
        sc = load_scenario(scenario, overrides)
        server = _build(sc, seed, run_dir)
        links = security(signing_key, unsigned, time.time)
        lines = _lines(external or [], server, port_offset)
        link = UdpPlant(server, port_offset, stop.status, _say, lambda: bool(stop.signum), links, lines)
        paced = sc.clock.mode == "realtime"
        loaded = preload("sim_plant") if paced else 0
        gc.collect()
        gc.freeze()
        gc.disable()  # nothing here makes reference cycles; a collection would only show as a late tick
        server.desk.pace.speed = speed
        if paced:
            _say(f"real time at {sc.clock.base_rate_hz} Hz: {realtime_priority()}, {loaded} kernels loaded beforehand")
            link.realtime()
        else:
            link.lockstep()
    except (ConfigError, SigningError) as e:
        outcome, code = "bad configuration", 2
        _say(str(e))
    except PeerLostError as e:
        outcome, code = "peer lost", 3
        _say(str(e))
    except AircraftLostError as e:
        outcome, code, lost = "aircraft lost", 4, str(e)
        _say(lost)
    except OSError as e:
        outcome, code, told = "file or port error", 2, str(e)
        _say(told)
    except StoppedError:
        outcome, code = "stopped", 128 + stop.signum
        _say(f"stopped by {signal.Signals(stop.signum).name} at t = {server.t_us / 1e6 if server else 0.0:.2f} s")
    final: dict[str, Any] = {"done": True, "outcome": outcome} | ({"lost": lost} if lost else {})
    if server is not None:
        final |= {"t": server.t_us / 1e6, "tick": server.tick}
        try:
            server.close()
        except OSError as e:
            code = code or 2
            if str(e) != told:
                _say(str(e))
    if link is not None:
        link.finish()
    if server is not None:
        final["accounts"] = accounts(server, link)
    stop.say(final)
    return code
