"""Views by name, from the entry points `wakefield.views` of this and of any other installed package."""

from __future__ import annotations

from functools import cache

from flightsw.plugins import VIEWS, parts
from ground.columns import Columns
from ground.views.base import View


@cache
def views() -> dict[str, View]:
    """Every view by name, sorted. Raises ConfigError naming one that cannot be imported or is none."""
    return parts(VIEWS, View)  # type: ignore[type-abstract]


def found(tlm: Columns) -> dict[str, View]:
    """The views that find their messages in this telemetry."""
    return {name: view for name, view in views().items() if view.finds(tlm)}


def usual_names() -> dict[int, str]:
    """System id -> name of an aircraft, as the views usually have them; the first view that says so decides."""
    out: dict[int, str] = {}
    for view in views().values():
        out = dict(view.aircraft) | out
    return out
