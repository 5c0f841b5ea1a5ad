"""Run folder -> `run.rrd`: every entity in one column-wise call, blueprint embedded; timelines sim_time and tick.

What every run has is drawn here (ground.rrd.common, ground.rrd.lines, tabs of ground.rrd.blueprint), what a mission adds by its
view. This package and the views' drawings are the only importers of rerun.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import rerun.blueprint as rrb

from ground import run as runs
from ground.columns import Columns
from ground.rrd.blueprint import blueprint
from ground.rrd.common import COMMON
from ground.rrd.joined import Fit
from ground.rrd.layout import Look, Tab
from ground.rrd.palette import STATES, Color
from ground.rrd.series import TICK_US, Sink
from ground.rrd.terms import Law, laws_of
from ground.run import Run
from ground.views import registry
from ground.views.base import View
from ground.views.registry import Failed, asked
from ground.whole import scenario

NOTHING_US = 100_000  # [us] an empty run is drawn as long


def convert(
    folder: Path,
    out: Path | None = None,
    near: bool = False,
    tab: str = "",
    failed: Failed = None,
    until_s: float | None = None,
) -> Path:
    """Write `run.rrd` of a run folder (or `out`) and return its path; `near`: first look close to what matters; `tab`: the plots
    shown first; `until_s`: as it was in flight at that time, the
    cursor at the end.

    Raises LogError for what is no run folder or no log, NoTabError for an unknown tab, OSError if unwritable, ViewError for a
    view that fails; with a list for `failed` what views fail with is added there and the rest is drawn.
    """
    run = runs.load(folder)
    path = folder / "run.rrd" if out is None else out
    views = registry.found(run.tlm, failed)
    if until_s is not None:
        run = run.until(round(until_s * 1e6))
    end = max(run.end_us, NOTHING_US)
    look = Look(interest(run.tlm, end), end * 1e-6, near, live=until_s is not None)
    shown = screen(run, views, laws_of(run), look, tab, failed=failed)
    with path.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    sink = Sink.recording(run.title, 0, end, tick_us(run))
    draw(sink, run, views, shown.states, failed)
    shown.fit(sink.lines)
    sink.write(path, shown.blueprint)
    return path


@dataclass(frozen=True)
class Screen:
    """What the viewer begins with, and the colours of states; `fit`: told the lines there are, it makes the plots show them."""

    blueprint: rrb.Blueprint
    states: Mapping[str, Color]
    fit: Fit


def screen(
    run: Run,
    views: Mapping[str, View],
    laws: Sequence[Law],
    look: Look,
    tab: str = "",
    title: str = "",
    extra: Sequence[Tab] = (),
    failed: Failed = None,
) -> Screen:
    """Layout of a run that these views find their messages in and whose control laws report, `title` for its own, `extra` tabs
    first. Raises NoTabError for an unknown tab, ViewError as `convert`."""
    answers = (asked(name, "layout", partial(view.layout, run, look), None, failed) for name, view in views.items())
    layouts = [shown for shown in answers if shown is not None]
    estimating = [name for s, name in run.names.items() if run.tlm.get(s, "NAV_STATE") is not None]
    states = STATES | {k: v for part in layouts for k, v in part.states.items()}
    names = list(run.names.values())
    made = blueprint(title or run.title, names, estimating, laws, look, layouts, tab, extra)
    return Screen(made, states, Fit(made))


def draw(sink: Sink, run: Run, views: Mapping[str, View], states: Mapping[str, Color], failed: Failed = None) -> None:
    """What the views draw and what every run has. Raises ViewError as `convert`."""
    for name, view in views.items():
        asked(name, "draw", partial(view.draw, sink, run), None, failed)
    sink.stand()
    for each in COMMON:
        each(sink, run, states)
    sink.join()


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


def picture_tab(run: Run) -> str:
    """The tab a picture shows first; "" for the first of all."""
    return next((view.tab for view in registry.found(run.tlm).values() if view.tab), "")


def picture_time(run: Run, failed: Failed = None) -> float | None:
    """A time [s] worth a picture: what a view says, else the middle of what is measured; None: no time is better than another.
    Raises ViewError as `convert`."""
    found = registry.found(run.tlm, failed)
    moments = (asked(name, "moment", partial(view.moment, run), None, failed) for name, view in found.items())
    t = measured_s(run.tlm)
    return next((m for m in moments if m is not None), t[len(t) // 2] if t else None)
