"""From a scenario name and overrides to a run folder whose files say everything about the run.

Order matters: everything is resolved and checked before the folder is made, so a typing error leaves nothing behind.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from flightsw.aircraft import load_airframe
from flightsw.files import write_whole
from flightsw.process.config import flight_tree, load_flight
from flightsw.strict import ConfigError, changed, near
from hil_scripts.launch import tomlout
from hil_scripts.launch.places import PARAMS, PLANT_KEY, ROOT, SCENARIOS
from sim_plant.dump import tree_of
from sim_plant.obeyed import refuse
from sim_plant.scenario import Link, load_scenario

LIBRARIES = (
    "wakefield", "numpy", "scipy", "numba", "llvmlite", "msgspec", "pymavlink", "rerun-sdk", "fastcrc", "jsbsim",
)  # fmt: skip


@dataclass(frozen=True)
class FlightPlan:
    """One onboard process: its aircraft, MAVLink system id and resolved configuration."""

    name: str
    sysid: int
    config: dict[str, Any]


@dataclass(frozen=True)
class RunPlan:
    """A checked run, ready to be written to a folder."""

    scenario_name: str
    scenario: dict[str, Any]
    seed: int
    duration_s: float  # [s] simulated
    full_s: float  # [s] the scenario's own duration, for which its bounds hold
    flights: tuple[FlightPlan, ...]
    overrides: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()  # what is flown as asked, and may not be meant

    @property
    def shortened(self) -> bool:
        """True when the run ends before the scenario does."""
        return self.duration_s < self.full_s

    @property
    def realtime(self) -> bool:
        """True when the run is paced by the wall clock."""
        return bool(self.scenario.get("clock", {}).get("mode") == "realtime")

    @property
    def names(self) -> dict[int, str]:
        """Aircraft names by system id."""
        return {f.sysid: f.name for f in self.flights}

    @property
    def expect(self) -> dict[str, Any]:
        """The scenario's [expect] table."""
        return dict(self.scenario.get("expect", {}))


def scenario_names() -> list[str]:
    """Scenarios that come with the project."""
    return sorted(p.stem for p in SCENARIOS.glob("*.toml"))


def find_scenario(text: str) -> Path:
    """Path of a scenario given by name or path. Raises ConfigError listing what exists."""
    for p in (Path(text), SCENARIOS / f"{text}.toml"):
        if p.is_file():
            return p
    known = scenario_names()
    raise ConfigError(
        f"scenario {text!r}: no such name or file; known names: {', '.join(known) or 'none'}{near(text, known)}"
    )


def parse_sets(sets: list[str]) -> dict[str, dict[str, str]]:
    """`name.key=value` texts as {name: {key: value}}. Raises ConfigError on a malformed one."""
    out: dict[str, dict[str, str]] = {}
    for text in sets:
        key, eq, value = text.partition("=")
        who, dot, rest = key.strip().partition(".")
        if not eq or not dot or not rest:
            raise ConfigError(
                f"--set {text!r}: expected plant.<key>=<value> or <aircraft name>.<key>=<value>, "
                "for example plant.wind.dryden.sigma_mps=1.0"
            )
        out.setdefault(who, {})[rest] = value.strip()
    return out


def _flight_config_path(aircraft: dict[str, Any], scenario: Path) -> Path:
    """Onboard parameters of an aircraft: flight_<name>.toml beside the scenario (the scenario lies in a run folder), else
    those of its mission, flightsw/params/<mission>.toml or a path.
    """
    text = aircraft.get("mission") or aircraft["name"]
    for p in (
        scenario.parent / f"flight_{aircraft['name']}.toml",
        PARAMS / f"{text}.toml",
        scenario.parent / text,
        ROOT / text,
    ):
        if p.is_file():
            return p
    known = sorted(p.stem for p in PARAMS.glob("*.toml"))
    raise ConfigError(
        f"{scenario}: aircraft.{aircraft['name']}.mission = {text!r}: no such flight configuration; "
        f"in flightsw/params: {', '.join(known) or 'none'}{near(text, known)}"
    )


def resolve(
    scenario_text: str, seed: int | None, sets: list[str], duration_s: float | None, realtime: bool = False
) -> RunPlan:
    """Read, override and check scenario and flight configurations, each mission's own tables too. Raises ConfigError naming
    file and key."""
    from flightsw.app import check  # slow to import (numba)

    path = find_scenario(scenario_text)
    by_owner = parse_sets(sets)
    plant_sets = dict(by_owner.pop(PLANT_KEY, {}))
    full_s = load_scenario(str(path)).meta.duration_s
    if duration_s is not None:
        plant_sets["meta.duration_s"] = repr(float(duration_s))
    if seed is not None:
        plant_sets["meta.seed"] = str(seed)
    if realtime:
        plant_sets["clock.mode"] = "realtime"
    scenario = load_scenario(str(path), plant_sets)
    scenario.load_aircraft()
    resolved = tree_of(scenario)
    if scenario.meta.duration_s < full_s:
        # the bounds hold for the whole flight; a run folder must fly again without being judged by them
        resolved["expect"] = {}
    names = [a["name"] for a in resolved["aircraft"]]
    unknown = sorted(set(by_owner) - set(names))
    if unknown:
        owners = [PLANT_KEY, *names]
        raise ConfigError(
            f"--set {unknown[0]}.…: no such owner; allowed: {', '.join(owners)}{near(unknown[0], owners)}"
        )
    origin = resolved.get("origin", {})
    flights = []
    for a in resolved["aircraft"]:
        sets_of = dict(by_owner.get(a["name"], {}))
        # identity and origin are the world's to give: both sides must agree on them
        own = {"app.name": a["name"], "app.sysid": a["sysid"], **{f"origin.{k}": v for k, v in origin.items()}}
        if taken := sorted(set(sets_of) & set(own)):
            raise ConfigError(
                f"--set {a['name']}.{taken[0]}: given by the scenario; change it there with --set plant.…"
            )
        file = _flight_config_path(a, path)
        cfg = load_flight(file, {**sets_of, **own})
        check(cfg.app.mission, cfg.tables, cfg.app.base_rate_hz, cfg.app.mission_rate_hz, str(file))
        flights.append(FlightPlan(a["name"], int(a["sysid"]), flight_tree(cfg)))
    if not any(f.config["link"]["broadcast_peer"] for f in flights):
        for key, value, default in (
            ("latency_ms", scenario.link.radio_latency_ms, Link().radio_latency_ms),
            ("loss", scenario.link.radio_loss, Link().radio_loss),
        ):
            refuse(
                f"link.radio_{key}", value, "without an aircraft that broadcasts (link.broadcast_peer)", default=default
            )
    # all wait for the one that starts slowest: whoever gave up earlier would end the run of the others
    starts = [resolved["clock"], *(f.config["link"] for f in flights)]
    longest_s = max(t["startup_timeout_s"] for t in starts)
    for t in starts:
        t["startup_timeout_s"] = longest_s
    # a run folder's scenario.toml keeps the name of what it was made from
    kept_name = path.name == "scenario.toml" and re.fullmatch(r"[\w.+-]+", scenario.meta.name)
    return RunPlan(
        scenario_name=scenario.meta.name if kept_name else path.stem,
        scenario=resolved,
        seed=int(resolved["meta"]["seed"]),
        duration_s=float(resolved["meta"]["duration_s"]),
        full_s=float(full_s),
        flights=tuple(flights),
        overrides={s.partition("=")[0].strip(): s.partition("=")[2].strip() for s in sets},
        warnings=_other_aircraft(resolved["aircraft"], flights),
    )


def _other_aircraft(plant: list[dict[str, Any]], flights: list[FlightPlan]) -> tuple[str, ...]:
    """What the onboard software believes to fly, or to follow, where the plant flies another aircraft. Raises ConfigError."""
    from flightsw.missions.base import find_mission  # slow to import (numba)

    out = []
    for a, f in zip(plant, flights, strict=True):
        pairs = [("app.aircraft", f.config["app"]["aircraft"], a)]
        leader = next((p for p in plant if p["name"] == a.get("rel_nav_to")), None)
        spec = find_mission(f.config["app"]["mission"], f.name)
        pairs += [(key, f.config[key], leader) for key in spec.files if leader is not None and key in f.config]
        for key, believed, flown in pairs:
            mine, true = load_airframe(believed), load_airframe(flown["file"])
            what = changed(mine, true) if type(mine) is type(true) else ("meta.model", mine.meta.model)
            if what is not None:
                out.append(
                    f"{f.name}.{key} = {believed!r} is not the aircraft of plant.aircraft.{flown['name']}.file = "
                    f"{flown['file']!r}: {what[0]} = {what[1]!r} on board"
                )
    return tuple(out)


def make_folder(plan: RunPlan, out: Path | None) -> Path:
    """Create `out`, or runs/<scenario>-<seed>-<timestamp>; writes the resolved TOML files and what they name. Nothing is left
    of a folder that cannot be filled. Raises ConfigError."""
    from hil_scripts.launch.keep import keep  # slow to import (numba)

    kept, scenario, flights = keep(plan.scenario, [f.config for f in plan.flights])
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    run = out if out is not None else Path("runs") / f"{plan.scenario_name}-{plan.seed}-{stamp}"
    n = 1
    while out is None and run.exists():  # two runs started within one second
        n += 1
        run = Path("runs") / f"{plan.scenario_name}-{plan.seed}-{stamp}-{n}"
    began = False
    try:
        if run.is_dir() and any(run.iterdir()):
            raise ConfigError(f"run folder {run} exists and is not empty; name another with --out or remove it")
        run.mkdir(parents=True, exist_ok=True)
        began = True
        write_whole(run / "scenario.toml", tomlout.dumps(scenario))
        for f, tree in zip(plan.flights, flights, strict=True):
            write_whole(run / f"flight_{f.name}.toml", tomlout.dumps(tree))
        kept.write(run)
    except OSError as e:
        if began:  # it was empty before
            shutil.rmtree(run, ignore_errors=True)
        raise ConfigError(f"run folder {run}: cannot be written: {e.strerror or e}") from None
    return run


def _git(*args: str) -> str:
    try:
        r = subprocess.run(["git", "-C", str(ROOT), *args], capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return r.stdout.strip() if r.returncode == 0 else ""


def cpu_model() -> str:
    """Model name of the first processor, or what `platform` knows."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor()
    m = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return m.group(1) if m else platform.processor()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def write_meta(run: Path, plan: RunPlan, **more: Any) -> None:
    """meta.json: what ran, on what, from which commit. Wall-clock facts belong here and in no other file of the run."""
    commit = _git("rev-parse", "HEAD")
    meta = {
        "scenario": plan.scenario_name,
        "seed": plan.seed,
        "overrides": plan.overrides,
        "warnings": list(plan.warnings),
        "aircraft": {f.name: f.sysid for f in plan.flights},
        "git_commit": commit or "unknown",
        "git_dirty": bool(_git("status", "--porcelain")) if commit else None,
        "started": datetime.now().astimezone().isoformat(timespec="seconds"),
        "command": sys.argv,
        "python": sys.version.split()[0],
        "versions": {n: _version(n) for n in LIBRARIES},
        "platform": platform.platform(),
        "cpu": cpu_model(),
        "cpu_count": os.cpu_count(),
        **more,
    }
    write_whole(run / "meta.json", json.dumps(meta, indent=2) + "\n")
