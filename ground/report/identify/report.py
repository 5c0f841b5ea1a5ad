"""The page on identification from flights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.identify.build import identify_report

    return identify_report(folders, out)


REPORT = Report(
    "identify", "Coefficients identified from flights: how often their intervals hold what was flown.", _build
)
