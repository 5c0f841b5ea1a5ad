"""The page on the fault matrix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.integrity.build import integrity_report

    return integrity_report(folders, out)


REPORT = Report("integrity", "The fault matrix: one square a case, outcomes by the truth.", _build)
