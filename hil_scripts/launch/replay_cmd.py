"""`sil replay`: run the onboard software of a run folder again from its recorded inputs and compare every output."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from flightsw.process.clock import monotonic_us
from flightsw.process.config import load_flight
from flightsw.process.executive import no_time
from flightsw.process.node import Node
from flightsw.process.replay import Report, replay
from flightsw.strict import ConfigError


def names_of(run: Path) -> list[str]:
    """Aircraft of a run folder, by its link logs. Raises ConfigError if it is none."""
    names = sorted(p.stem.removeprefix("link_") for p in run.glob("link_*.tlog"))
    if not names:
        raise ConfigError(f"{run}: no link_<aircraft>.tlog here; is this a run folder?")
    return names


def was_realtime(run: Path) -> bool:
    """Whether the run was paced by the wall clock, as meta.json says; a folder without it counts as lockstep."""
    try:
        return bool(json.loads((run / "meta.json").read_text()).get("mode") == "realtime")
    except (OSError, ValueError):
        return False


def replay_run(run: Path) -> dict[str, Report]:
    """Replay every aircraft of `run`. Raises ConfigError, TlogError (an OSError) naming the file at fault."""
    realtime = was_realtime(run)
    out = {}
    for name in names_of(run):
        cfg = load_flight(run / f"flight_{name}.toml")
        node = Node(cfg, realtime=realtime, now_us=monotonic_us if realtime else no_time)
        out[name] = replay(run / f"link_{name}.tlog", node)
    return out


def show(console: Console, reports: dict[str, Report]) -> bool:
    """Table of the reports, and details where something differs. True if nothing does."""
    t = Table(title="replay against recorded outputs", title_justify="left")
    for head in ("aircraft", "ticks", "packets", "fields that differ", "packets of one side only"):
        t.add_column(head, justify="left" if head == "aircraft" else "right")
    for name, r in reports.items():
        t.add_row(name, str(r.ticks), str(r.packets), str(r.differences), str(len(r.extra)))
    console.print(t)
    for name, r in reports.items():
        if not r.ok:
            for line in r.lines():
                console.print(f"{name}: {line}", style="red", soft_wrap=True)
    return all(r.ok for r in reports.values())


def as_dict(reports: dict[str, Report]) -> dict[str, Any]:
    """The reports by aircraft, and whether nothing differs at all."""
    rows = {
        name: {
            "ticks": r.ticks,
            "packets": r.packets,
            "differences": r.differences,
            "extra": len(r.extra),
            "same": r.ok,
        }
        for name, r in reports.items()
    }
    return {"same": all(r.ok for r in reports.values()), "aircraft": rows}
