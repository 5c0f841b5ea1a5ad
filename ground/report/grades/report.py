"""The page on grades of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.grades.build import grades_report

    return grades_report(folders, out)


REPORT = Report("grades", "The refuelling by grade of sensors and turbulence: outcomes, accuracy, consistency.", _build)
