"""Are the logs of a run whole? Each must reach the run's end; what ended it is the launcher's to say.

The end is what summary.json (the launcher's word) or meta.json says, else the scenario's duration. The truth must come up to its
last sample, telemetry of every aircraft to within `TLM_SLACK_S`, and the plant's last word, the shutdown command, must be in
every link log. A log that stops short makes a completed run "truncated".
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from flightsw.icd.dialect import VALUES
from flightsw.icd.scan import scan
from ground.columns import Columns
from ground.link.packets import IDS, decode
from ground.tree import flatten

TLM_SLACK_S = 0.5  # [s] telemetry is sent ten times a second
TAIL_BYTES = 1 << 16  # of a link log are looked at
BASE_HZ, TRUTH_HZ = 100.0, 20.0  # [1/s] of a scenario that does not say
TRUNCATED = "truncated"
Flat = dict[str, Any]


def _json(path: Path) -> Flat:
    """A JSON file as flat keys, {} without one. Raises ValueError naming a file that is not JSON."""
    if not path.exists():
        return {}
    try:
        return flatten(json.loads(path.read_text()))
    except (json.JSONDecodeError, AttributeError) as exc:
        raise ValueError(f"{str(path)!r} is not JSON: {exc}") from exc


def flown(run: Path) -> Flat:
    """run.* of a run folder as the launcher left it: summary.json before meta.json; {} without either."""
    found = _json(run / "meta.json") | _json(run / "summary.json")
    return {k: v for k, v in found.items() if k.startswith("run.")}


def toml(path: Path) -> dict[str, Any]:
    """A TOML file, {} without a readable one. Not to be changed: it is read once."""
    try:
        return _toml(path, path.stat().st_mtime_ns)
    except (OSError, ValueError):
        return {}


def scenario(run: Path) -> dict[str, Any]:
    """The run's scenario.toml as `toml`."""
    return toml(run / "scenario.toml")


@lru_cache(maxsize=8)
def _toml(path: Path, _mtime_ns: int) -> dict[str, Any]:
    return tomllib.loads(path.read_text())


def log_figures(run: Path, truth: Columns, tlm: Columns) -> Flat:
    """run.outcome, run.reason where there is one, run.sim_s, and log.*: where the logs end and what they lost."""
    out = flown(run)
    setup = scenario(run)
    end_s = out.get("run.sim_s", setup.get("meta", {}).get("duration_s"))
    out.setdefault("run.outcome", None)
    out.setdefault("run.sim_s", truth.end_us * 1e-6)
    both = {"truth": truth, "tlm": tlm}
    out |= {f"log.{name}.end_s": log.end_us * 1e-6 for name, log in both.items()}
    for key in ("packets", "junk_bytes", "bad_stamps", "unknown"):
        out[f"log.{key}"] = sum(getattr(log, key) for log in both.values())
    short = [f"{name}.tlog: its last record is cut off" for name, log in both.items() if log.cut_bytes]
    if end_s is not None:
        short += _early(setup, truth, tlm, float(end_s))
    short += [f"{p.name} ends before the run does" for p in sorted(run.glob("link_*.tlog")) if not link_whole(p)]
    if short and out["run.outcome"] in (None, "completed"):
        out["run.outcome"] = TRUNCATED
        out["run.reason"] = "; ".join(short)
    return out


def _early(setup: dict[str, Any], truth: Columns, tlm: Columns, end_s: float) -> list[str]:
    """Logs that end before end_s [s], in words."""
    clock = setup.get("clock", {})
    step_s = 1.0 / float(clock.get("truth_hz", TRUTH_HZ)) + 1.0 / float(clock.get("base_rate_hz", BASE_HZ))
    aircraft = [int(a["sysid"]) for a in setup.get("aircraft", []) if "sysid" in a]
    out = []
    for name, log, slack in (("truth", truth, step_s), ("tlm", tlm, TLM_SLACK_S)):
        last = _last_us(log, aircraft or log.sysids(), "TRUTH" if name == "truth" else None)
        if last is None or last * 1e-6 < end_s - slack:
            at = "is empty" if last is None else f"ends at t = {last * 1e-6:.2f} s"
            out.append(f"{name}.tlog {at}, the run at {end_s:.2f} s")
    return out


def _last_us(log: Columns, sysids: Iterable[int], message: str | None) -> int | None:
    """Time [us] up to which all of `sysids` are in the log (their `message` alone, if given); None: one is not at all."""
    ends = []
    for s in sysids:
        found = [
            int(t.t_us.max()) for (i, name), t in log.tables.items() if i == s and message in (None, name) and len(t)
        ]
        if not found:
            return None
        ends.append(max(found))
    return min(ends, default=None)


def link_whole(path: Path) -> bool:
    """Whether a link log has the plant's shutdown command among its last packets, and no cut end."""
    with path.open("rb") as f:
        f.seek(max(os.fstat(f.fileno()).st_size - TAIL_BYTES, 0))
        log = scan(f.read())
    if log.cut_bytes:
        return False
    for k in ((log.msgid == IDS["COMMAND_LONG"]) & log.known & ~log.v1).nonzero()[0]:
        command = decode(log.raw[log.head[k] : log.head[k] + log.size[k]])
        if command["command"] == VALUES["MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN"] and command["param1"] == 2.0:
            return True
    return False
