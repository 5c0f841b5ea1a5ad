"""The ground: record, watch, draw, judge. `from ground import Run` opens a run folder as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ground.data import Run as Run

__all__ = ["Run"]


def __getattr__(name: str) -> Any:
    if name == "Run":  # arrays are slow to import: the recorder and the monitor do without
        from ground.data import Run

        return Run
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
