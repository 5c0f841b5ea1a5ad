"""Identification from flights as a page: coverage of the 95 % intervals, over all and coefficient by coefficient."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report import page as p
from ground.report.build import load_all, provenance, warnings, write_page
from ground.report.load import Campaign, finite

PAGE = "identify.html"
TITLE = "Identified from flights: what the intervals hold"
PURPOSE = (
    "The tanker flies test inputs with every coefficient off from its file; the coefficients are identified from the link log by "
    "output error and compared with those flown."
)
ENDING = ".half_pct"
READING = """
Coverage is the share of 95 % intervals that hold what was flown, of those coefficients, or combinations with others, that the
flight identifies: whose interval is within 25 % of their size to each side. The first interval of the share is Wilson's, as if
all were independent; the second, by Student's t, is over flights: the coefficients of one flight share its noise.

In turbulence gusts are sought with the coefficients at knots of 1 s. What goes faster stays in the residuals; the intervals
allow for their correlation, but are lower bounds.
"""


def identify_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/identify.html from a campaign folder; returns the page. Raises ReportError."""
    found = load_all(folders, ("identify",))
    return write_page(out, PAGE, lambda: _text(next(iter(found.values()))))


def _text(c: Campaign) -> str:
    chapters = [("coverage", "Coverage", _coverage(c))]
    chapters += [(case, f"Coefficients, {case}", _coefficients(c, case)) for case in c.cases]
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance([c])))
    body = warnings(c) + "\n".join(p.section(*x) for x in chapters)
    return p.document(TITLE, PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _number(c: Campaign, key: str) -> float | None:
    return finite(c.summary.get(key))


def _coverage(c: Campaign) -> str:
    rows = []
    for case in c.cases:
        ends = [
            tuple(_number(c, f"{case}.coverage_{kind}_{end}") for end in ("lo", "hi")) for kind in ("wilson", "runs")
        ]
        small = "; ".join(f"{p.number(lo)} … {p.number(hi)}" for lo, hi in ends)
        rows.append(
            p.text(case, "name") + p.plain(_number(c, f"{case}.n")) + p.plain(_number(c, f"{case}.identified_per_run"))
            + p.plain(_number(c, f"{case}.coverage"), below=small)
        )  # fmt: skip
    return p.table(
        [("air", ""), ("flights", "num"), ("identified per flight", "num"), ("intervals that hold", "num")], rows
    )


def _coefficients(c: Campaign, case: str) -> str:
    names = [k.removeprefix(f"{case}.").removesuffix(ENDING) for k in c.summary if k.startswith(f"{case}.")]
    rows = []
    for name in (k for k in names if f"{case}.{k}{ENDING}" in c.summary):
        columns = ("identified", "alone", "coverage", "off_sigma_rms", "half_pct")
        rows.append(p.text(name, "name") + "".join(p.plain(_number(c, f"{case}.{name}.{k}")) for k in columns))
    head = ("identified in", "alone in", "intervals that hold", "error RMS, σ", "95 % half width, %")
    return p.table([("coefficient", ""), *((h, "num") for h in head)], rows)
