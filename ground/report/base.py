"""What a report is: one HTML page with figures on the campaigns of one published work.

Reports are found by the entry points `wakefield.reports` (name = "package.module:REPORT").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Protocol

GROUP = "wakefield.reports"


class Build(Protocol):
    """Makes the page."""

    def __call__(self, folders: Sequence[Path], out: Path) -> Path:
        """Write the page and its PNG figures to `out` from campaign folders; returns the page. Raises ReportError."""


@dataclass(frozen=True)
class Report:
    """campaigns: the studies it reads, names or patterns ("this, that_*"); about: what the page shows; `build` imports what
    is slow to import."""

    campaigns: str
    about: str
    build: Build

    def reads(self, study: str) -> bool:
        """Whether a study is one of those."""
        return any(fnmatchcase(study, name) for name in self.campaigns.split(", "))
