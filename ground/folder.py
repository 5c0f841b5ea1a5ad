"""What a command is given: is it a run folder, and if only a log, what is in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ground.columns import Columns, LogError

LOGS = ("truth.tlog", "tlm.tlog")  # every figure and picture needs both


def require(run: Path, logs: tuple[str, ...] = LOGS) -> None:
    """Raises LogError, in the same words for every command, if `run` is no run folder: it lacks one of `logs`; without any
    named, it has no .tlog at all."""
    if not run.exists():
        why = "it does not exist"
    elif not run.is_dir():
        why = "it is a file"
    elif missing := [name for name in logs if not (run / name).is_file()]:
        why = f"it has no {' and no '.join(missing)}"
    elif not logs and not any(run.glob("*.tlog")):
        why = "it has no .tlog"
    else:
        return
    raise LogError(f"{str(run)!r} is not a run folder: {why}")


def contents(log: Columns) -> dict[str, Any]:
    """What a single log holds: packets, what was left out, messages of each system."""
    out: dict[str, Any] = {"log.packets": log.packets, "log.junk_bytes": log.junk_bytes, "log.unknown": log.unknown}
    out |= {"log.bad_stamps": log.bad_stamps, "log.systems": log.sysids()}
    return out | {f"log.{sysid}.{name}": len(table) for (sysid, name), table in sorted(log.tables.items())}
