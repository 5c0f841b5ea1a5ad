"""The page on Sevil (2013)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.sevil.build import sevil_report  # slow to import: figures

    return sevil_report(folders, out)


REPORT = Report("sevil, sevil_*", "Air-data position and fault detection: printed, reproduced, ours.", _build)
