"""The report on the study: one table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report.base import Report

FIGURES = ("wind_rms_mps.n", "wind_rms_mps.e", "wind_rms_mps.d", "wind_inside_3sigma_pct", "course_median_deg")


def _build(folders: Sequence[Path], out: Path) -> Path:
    from ground.report.load import ReportError, load
    from ground.report.page import cell, document, section, table, text

    campaigns = [load(f) for f in folders]
    for c in campaigns:
        if c.study != "example":
            raise ReportError(f"{c.folder}: a campaign of {c.study!r}; allowed: example")
    rows = [text(case) + "".join(cell(c.stat(case, f)) for f in FIGURES) for c in campaigns for case in c.cases]
    head = [("case", ""), *((f, "num") for f in FIGURES)]
    body = section("figures", "Figures", table(head, rows, "over runs, 95 % interval below"))
    page = document("Wind by the triangle", "A light aircraft on a course.", [("figures", "Figures")], body)
    out.mkdir(parents=True, exist_ok=True)
    (out / "example.html").write_text(page, encoding="utf-8")
    return out / "example.html"


REPORT = Report("example", "Wind by the triangle against the time constant of its average.", _build)
