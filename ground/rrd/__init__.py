"""Run folder -> `run.rrd`: every series in one column-wise call, blueprint embedded; timelines sim_time and tick.

What every run has is drawn here (ground.rrd.common, ground.rrd.lines, tabs of ground.rrd.blueprint), what a mission adds by its
view. This package and the views' drawings are the only importers of rerun.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from ground import run as runs
from ground.columns import Columns
from ground.rrd.blueprint import blueprint
from ground.rrd.common import common
from ground.rrd.layout import Look
from ground.rrd.palette import STATES
from ground.rrd.series import TICK_US, Sink
from ground.rrd.terms import draw, laws_of
from ground.run import Run
from ground.views import registry
from ground.views.registry import Failed, asked
from ground.whole import scenario

NOTHING_US = 100_000  # [us] an empty run is drawn as long


def convert(folder: Path, out: Path | None = None, near: bool = False, tab: str = "", failed: Failed = None) -> Path:
    """Write `run.rrd` of a run folder (or `out`) and return its path; `near`: first look close to what matters; `tab`: the plots
    shown first.

    Raises LogError for what is no run folder or no log, NoTabError for an unknown tab, OSError if unwritable, ViewError for a
    view that fails; with a list for `failed` what views fail with is added there and the rest is drawn.
    """
    run = runs.load(folder)
    path = folder / "run.rrd" if out is None else out
    views = registry.found(run.tlm, failed)
    end = max(run.end_us, NOTHING_US)
    look = Look(interest(run.tlm, end), end * 1e-6, near)
    asked_for = (asked(name, "layout", partial(view.layout, run, look), None, failed) for name, view in views.items())
    layouts = [shown for shown in asked_for if shown is not None]
    estimating = [name for s, name in run.names.items() if run.tlm.get(s, "NAV_STATE") is not None]
    laws = laws_of(run)
    screen = blueprint(run.title, list(run.names.values()), estimating, laws, look, layouts, tab)
    with path.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    sink = Sink(path, run.title, 0, end, screen, tick_us(run))
    for name, view in views.items():
        asked(name, "draw", partial(view.draw, sink, run), None, failed)
    sink.stand()
    states = STATES | {k: v for part in layouts for k, v in part.states.items()}
    common(sink, run, states)
    draw(sink, laws)
    sink.close()
    return path


def tick_us(run: Run) -> int:
    """Base tick [us] of a run by its scenario, else `TICK_US`."""
    rate = scenario(run.folder).get("clock", {}).get("base_rate_hz")
    return round(1e6 / rate) if rate else TICK_US


def measured_s(tlm: Columns) -> list[float]:
    """Times [s] at which some mission says that it measures (MISSION_STATUS.measure), ascending."""
    tables = [t for (_, message), t in tlm.tables.items() if message == "MISSION_STATUS"]
    return sorted(t for table in tables for t in (table.t_us[table["measure"] != 0] * 1e-6).tolist())


def interest(tlm: Columns, end_us: int) -> tuple[float, float]:
    """Time range [s] the first look should show: what is measured with a margin, else the whole run."""
    t = measured_s(tlm)
    return (max(0.0, t[0] - 60.0), min(end_us * 1e-6, t[-1] + 30.0)) if t else (0.0, end_us * 1e-6)


def picture_time(tlm: Columns) -> float | None:
    """A time [s] worth a picture: the middle of what is measured; None where nothing is."""
    t = measured_s(tlm)
    return t[len(t) // 2] if t else None
