"""One line of the table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One measured figure. `goal` is what the project wants, as text; empty if it has no goal."""

    key: str
    what: str
    value: float
    unit: str
    goal: str = ""
