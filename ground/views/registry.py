"""Views by name, from the entry points `wakefield.views` of this and of any other installed package."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import TypeVar

from flightsw.plugins import VIEWS, parts
from flightsw.strict import ConfigError
from ground.columns import Columns
from ground.views.base import View

T = TypeVar("T")


@cache
def views() -> dict[str, View]:
    """Every view by name, sorted. Raises ConfigError naming one that cannot be imported or is none."""
    return parts(VIEWS, View)  # type: ignore[type-abstract]


class ViewError(ValueError):
    """A view failed. The text names it, what it was asked for, and what happened."""


Failed = (
    list[str] | None
)  # what views failed with is added here, and the rest goes on; None: the first raises ViewError


def asked(name: str, what: str, answer: Callable[[], T], otherwise: T, failed: Failed) -> T:
    """What a view answers; where it fails `otherwise`, or ViewError: another's fault must not look like one of the run."""
    try:
        return answer()
    except ConfigError:
        raise
    except Exception as e:
        text = f"{VIEWS} = {name!r}: {what}: {type(e).__name__}: {e}"
        if failed is None:
            raise ViewError(text) from e
        failed.append(text)
        return otherwise


def found(tlm: Columns, failed: Failed = None) -> dict[str, View]:
    """The views that find their messages in this telemetry. Raises ViewError as `asked`."""
    return {
        name: view for name, view in views().items() if asked(name, "finds", partial(view.finds, tlm), False, failed)
    }


def usual_names() -> dict[int, str]:
    """System id -> name of an aircraft, as the views usually have them; the first view that says so decides."""
    out: dict[int, str] = {}
    for view in views().values():
        out = dict(view.aircraft) | out
    return out
