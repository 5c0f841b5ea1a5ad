"""Aircraft that another computer flies: which line leads there, what is handed over, and the words of the wait."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from flightsw.files import write_whole
from flightsw.icd.lines import SERIAL, TCP, UDP, Line, parse_line
from flightsw.icd.link import GROUND_PORT, OPERATOR_PORT, LinkError, plant_port
from flightsw.strict import ConfigError, near
from hil_scripts.launch.keep import AIRCRAFT
from hil_scripts.launch.ports import HOST
from hil_scripts.launch.runfolder import RunPlan
from sim_plant.peers import own_address
from sim_plant.silence import END

LONGER_S = 5.0  # [s]


@dataclass(frozen=True)
class External:
    """The external aircraft of a run, by name, and the address of this machine as they see it."""

    lines: dict[str, Line]
    here: str = HOST

    @property
    def open(self) -> bool:
        """Whether others than this machine can reach the sockets of the run."""
        return not ip_address(self.here).is_loopback

    @property
    def plant_args(self) -> list[str]:
        """Options of sim-plant."""
        return [word for name, line in self.lines.items() for word in ("--external", f"{name}={line}")]


NONE = External({})


def of_options(texts: Sequence[str], here: str, plan: RunPlan, port_offset: int) -> External:
    """Options `--external NAME[=LINE]` and `--here`. Raises ConfigError quoting the text, LinkError for a host that is not
    reached."""
    lines: dict[str, Line] = {}
    known = {f.name: f.sysid for f in plan.flights}
    for text in texts:
        name, _, line = text.partition("=")
        if name not in known:
            raise ConfigError(f"--external {text!r}: no such aircraft; allowed: {', '.join(known)}{near(name, known)}")
        if name in lines:
            raise ConfigError(f"--external {text!r}: {name} is named twice")
        try:
            lines[name] = parse_line(line or f"{UDP}:{HOST}", plant_port(known[name], port_offset))
        except LinkError as e:
            raise ConfigError(f"--external {text!r}: {e}") from None
    if here and not lines:
        raise ConfigError(f"--here {here}: allowed with --external")
    seen = {own_address(line.host) for line in lines.values() if line.kind != SERIAL}
    if not here and len(seen) > 1:
        raise ConfigError(f"--here: which of {', '.join(sorted(seen))} do the external aircraft send telemetry to?")
    here = here or (seen.pop() if seen else HOST)
    try:
        ip_address(here)
    except ValueError:
        raise ConfigError(f"--here {here!r}: allowed: an address in numbers") from None
    return External(lines, here)


def handed(plan: RunPlan, external: External, port_offset: int) -> RunPlan:
    """The plan, its external aircraft's flight files such that they fit the other end of their lines. All onboard processes wait
    longer for the start than the plant, which knows who is missing."""
    if not external.lines:
        return plan
    clock = plan.scenario["clock"]
    patient: dict[str, Any] = {}
    if clock["silence"] != END:  # whoever ends earlier than the plant would end it for all
        patient = {"silence": "wait", "silence_end_s": min(clock["silence_end_s"] + LONGER_S, 3600.0)}
    flights = []
    for f in plan.flights:
        link = {
            **f.config["link"],
            **patient,
            "startup_timeout_s": min(f.config["link"]["startup_timeout_s"] + LONGER_S, 3600.0),
        }
        if f.name in external.lines:
            link = _far(link, f.sysid, external.lines[f.name], external.here, port_offset)
        flights.append(replace(f, config={**f.config, "link": link}))
    return replace(plan, flights=tuple(flights))


def _far(link: dict[str, Any], sysid: int, line: Line, here: str, port_offset: int) -> dict[str, Any]:
    """Table [link] of the flight file at the far end of `line`."""
    link = {**link, "targets": [f"{here}:{p}" for p in (GROUND_PORT, OPERATOR_PORT)]}
    if line.kind == UDP:
        usual = plant_port(sysid, port_offset)
        link |= {"host": line.host, "plant_port": 0 if line.port == usual else line.port}
    elif line.kind == TCP:
        link |= {"host": line.host, "line": str(line)}
    return link


def board_folder(run: Path, name: str) -> Path:
    """What is to be taken to the onboard computer of an aircraft."""
    return run / f"board_{name}"


def hand_over(run: Path, external: External) -> None:
    """Fill a folder for each external aircraft: its flight file and the aircraft files that names. Raises OSError."""
    for name in external.lines:
        board = board_folder(run, name)
        shutil.copytree(run / AIRCRAFT, board / AIRCRAFT)
        flight = f"flight_{name}.toml"
        write_whole(board / flight, (run / flight).read_text())  # last and whole: whoever waits for it may take all


def words(run: Path, plan: RunPlan, external: External, port_offset: int, options: Sequence[str]) -> list[str]:
    """Lines for a person: who is awaited where and how long, what to take there, what to start there."""
    out = []
    wait_s = float(plan.scenario["clock"]["startup_timeout_s"])
    for f in plan.flights:
        line = external.lines.get(f.name)
        if line is None:
            continue
        out.append(
            f"{f.name} (system {f.sysid}) is flown by another computer: awaited at {line} for at most {wait_s:g} s "
            "(plant.clock.startup_timeout_s)"
        )
        out.append(f"  take there: {board_folder(run, f.name)}")
        args = ["flightsw", "--config", f"flight_{f.name}.toml", "--run-dir", "."]
        args += ["--link", f"{SERIAL}:ITS_DEVICE:{line.baud}"] if line.kind == SERIAL else []
        args += ["--realtime"] if plan.realtime else []
        args += ["--port-offset", str(port_offset)] if port_offset else []
        out.append(f"  start there: {' '.join([*args, *options])}")
    return out
