"""The page on Hoffmann and Luckner."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.hoffmann.build import hoffmann_report  # slow to import: figures

    return hoffmann_report(folders, out)


REPORT = Report("hoffmann, hoffmann_*", "Wind felt by a small UAV: printed gain, ours, alleviation.", _build)
