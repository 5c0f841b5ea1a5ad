"""What a view shows of a run, and what it is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import TypeAlias

import rerun.blueprint as rrb

from ground.rrd.palette import Color

LIVE_S = 120.0  # [s] shown of a run that goes on
Span = tuple[float, float]
Tab: TypeAlias = rrb.Vertical | rrb.Horizontal
Scene: TypeAlias = rrb.Spatial2DView | rrb.Spatial3DView


def past(*paths: str, seconds: float | None = None) -> dict[str, rrb.VisibleTimeRanges]:
    """Overrides of a view that show entities not only as they are at the cursor but the last `seconds` of them; None: all there
    is of them, also what is still to come."""
    at = rrb.TimeRangeBoundary
    begin = at.infinite() if seconds is None else at.cursor_relative(seconds=-seconds)
    window = rrb.VisibleTimeRange(
        "sim_time", start=begin, end=at.infinite() if seconds is None else at.cursor_relative()
    )
    return {path: rrb.VisibleTimeRanges([window]) for path in paths}


class Plots:
    """Makes the plots of one layout: all begin with the same time range [s] (`live`: the last `LIVE_S`) and share its zoom."""

    def __init__(self, start_s: float, end_s: float, live: bool = False, other: str = "") -> None:
        self.other = other
        self.legend = rrb.Corner2D.LeftTop if live else rrb.Corner2D.RightTop  # where nothing is going on
        at = rrb.TimeRangeBoundary.absolute
        window = rrb.TimeRange(start=at(seconds=start_s), end=at(seconds=end_s))
        if live:
            now = rrb.TimeRangeBoundary.cursor_relative
            window = rrb.TimeRange(start=now(seconds=-LIVE_S), end=now())
        self.time = rrb.TimeAxis(link=rrb.components.LinkAxis.Independent, view_range=window)

    def alone(self) -> Plots:
        """The same, for entities that only one run has."""
        out = copy(self)
        out.other = ""
        return out

    def plot(self, name: str, contents: list[str], span: Span | None = None, legend: bool = True) -> rrb.TimeSeriesView:
        """A plot of the named entities; `span` fixes the first vertical range; without legend where its name says all."""
        return rrb.TimeSeriesView(
            origin="/",
            contents=[*contents, *(f"{self.other}/{c}" for c in contents)] if self.other else contents,
            name=name,
            axis_x=self.time,
            axis_y=rrb.ScalarAxis(range=span, zoom_lock=False) if span else None,
            plot_legend=rrb.PlotLegend(corner=self.legend, visible=legend or bool(self.other)),
        )

    def wind(self, aircraft: str) -> list[rrb.TimeSeriesView]:
        """Wind north, east, down of an aircraft: truth, estimate, 3-sigma limits."""
        kinds = ("nav/{}/wind_3sigma/{}", "truth/{}/wind/{}", "nav/{}/wind/{}")
        return [
            self.plot(f"{aircraft} wind {label} [m/s]", [k.format(aircraft, a) for k in kinds])
            for a, label in (("n", "north"), ("e", "east"), ("d", "down"))
        ]


@dataclass(frozen=True)
class Look:
    """What is asked of a picture. span: time range [s] worth a first look; end_s: end of the run; near: the eye close up; live:
    the run goes on; other: root of a second run's entities, drawn beside the first's."""

    span: Span
    end_s: float
    near: bool = False
    live: bool = False
    other: str = ""

    def plots(self, span: Span | None = None) -> Plots:
        """Maker of plots that begin with a time range [s], `self.span` without one; of a run that goes on, with its last part."""
        return Plots(*(span or self.span), self.live, self.other)


@dataclass(frozen=True)
class Layout:
    """What a view puts on the screen beside what every run has.

    rank: how much the run is this mission's; the highest leads: its tabs come before the common ones, its scenes first, its
    `span` is the time range shown first (None: Look.span). A common tab is left out where a view has one of its name. wide:
    scenes along the top. lanes: entities of the state timeline. states: colours of their states and of the mission's phases.
    """

    rank: int = 0
    tabs: Sequence[Tab] = ()
    scenes: Sequence[Scene] = ()
    lanes: Sequence[str] = ()
    states: Mapping[str, Color] = field(default_factory=dict)
    span: Span | None = None
    wide: bool = False
