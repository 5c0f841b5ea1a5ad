"""The page on Jing et al."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.jing.build import jing_report  # slow to import: figures

    return jing_report(folders, out)


REPORT = Report("jing, jing_*", "A jet in a microburst: filters, wrong model, escape laws, survival.", _build)
