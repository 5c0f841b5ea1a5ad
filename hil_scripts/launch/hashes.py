"""Digests of the logs of flights: what a change of the sources changed in what is flown, and what it left alone.

Every scenario flies in process with one seed, its first seconds or all of it; the table is SHA-256 by `scenario/log`. Equal bytes
are a statement about one machine's mathematics library: a table says on what it was made.
"""

from __future__ import annotations

import hashlib
import json
import platform
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from flightsw.files import write_whole
from flightsw.strict import ConfigError, near
from hil_scripts.launch import screen
from hil_scripts.launch.inproc import fly
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import make_folder, resolve, scenario_names

SHORT_S = 8.0  # [s] of every scenario: all rate groups, all start-up designs
SEED = 3
Table = dict[str, Any]


def machine() -> str:
    """What equal bytes depend on besides the sources: processor kind and mathematics library."""
    return f"{platform.machine()} {' '.join(platform.libc_ver())}".strip()


def digests(scenario: str, seconds: float | None, seed: int, stop: StopFlag) -> dict[str, str]:
    """SHA-256 of every log of one flight by `scenario/log`; `seconds` None: all of it.

    Raises ConfigError for a scenario that does not exist, RuntimeError for a flight that ends otherwise than completed or lost.
    """
    with tempfile.TemporaryDirectory(prefix="wakefield-hash-") as tmp:
        plan = resolve(scenario, seed, [], seconds)
        run = make_folder(plan, Path(tmp) / "run")
        ended = fly(plan, run, screen.console(quiet=True), stop)
        if ended.outcome not in ("completed", "lost"):
            raise RuntimeError(f"{scenario}: {ended.outcome}: {ended.reason}")
        logs = sorted(run.glob("*.tlog"))
        return {f"{scenario}/{p.name}": hashlib.sha256(p.read_bytes()).hexdigest() for p in logs}


def table(
    scenarios: Iterable[str], seconds: float | None, seed: int, stop: StopFlag, tell: Callable[[str], None]
) -> Table:
    """The table of several scenarios; `tell` hears which one flies. Raises as `digests`."""
    logs: dict[str, str] = {}
    for name in scenarios:
        if not stop:
            tell(name)
            logs |= digests(name, seconds, seed, stop)
    return {"machine": machine(), "seed": seed, "seconds": seconds, "logs": logs}


def read(path: Path) -> Table:
    """A table as `write` left it. Raises ConfigError naming the file if it is none."""
    try:
        out = json.loads(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise ConfigError(f"{path}: {e.strerror or e}") from None
    except ValueError as e:
        raise ConfigError(f"{path}: not a table of digests: {e}") from None
    if not isinstance(out, dict) or not isinstance(out.get("logs"), dict):
        raise ConfigError(f"{path}: not a table of digests: no `logs`")
    return out


def write(path: Path, t: Table) -> None:
    """Keep a table. Raises OSError."""
    write_whole(path, json.dumps(t, indent=1) + "\n")


def differences(before: Table, now: Table) -> list[str]:
    """Logs of which only one table knows, or whose digests differ, of the scenarios `now` has flown.

    Raises ConfigError for tables of other flights: seed or length.
    """
    for key in ("seed", "seconds"):
        if before.get(key) != now[key]:
            raise ConfigError(f"{key} = {now[key]}: the table has {key} = {before.get(key)}")
    flown = {k.partition("/")[0] for k in now["logs"]}
    old = {k: v for k, v in before["logs"].items() if k.partition("/")[0] in flown}
    return sorted(k for k in old.keys() | now["logs"].keys() if old.get(k) != now["logs"].get(k))


def chosen(names: list[str]) -> list[str]:
    """The scenarios named, or all that come with the project. Raises ConfigError for one that does not."""
    known = scenario_names()
    for n in names:
        if n not in known:
            raise ConfigError(f"scenario {n!r}: allowed: {', '.join(known)}{near(n, known)}")
    return names or known
