"""The page on Lee (2011)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.lee.build import lee_report  # slow to import: figures

    return lee_report(folders, out)


REPORT = Report("lee, lee_*", "The dissertation's experiments: printed claim, printed method, our default.", _build)
