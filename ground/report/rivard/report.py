"""The page on Rivard (1982)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.rivard.build import rivard_report  # slow to import: figures

    return rivard_report(folders, out)


REPORT = Report("rivard, rivard_6dof", "Rendezvous by range alone: printed, reproduced, improved.", _build)
