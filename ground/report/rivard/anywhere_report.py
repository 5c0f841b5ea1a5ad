"""The page on rendezvous from anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.rivard.anywhere import geometry_report

    return geometry_report(folders, out)


REPORT = Report(
    "rivard_geometry",
    "Rendezvous from anywhere: wind, starts, speeds, turning receivers, faulty sets; what is reached and announced.",
    _build,
)
