"""Rendezvous from anywhere as a page: misses at the roll-out and after the leg, what was announced and what of it was false."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report import page as p
from ground.report.build import load_all, provenance, warnings, write_page
from ground.report.load import Campaign
from ground.report.rivard.cells import scaled
from ground.report.rivard.page import NM

PAGE = "geometry.html"
TITLE = "Rendezvous from anywhere"
PURPOSE = (
    "A tanker that knows its receiver by TACAN range, and by bearing or data link where it has them, meets it in wind, from "
    "starts nobody planned, when the receiver turns or is too fast, and with a faulty set. Misses are along and across the "
    "course the receiver truly flies."
)
CHAPTERS = {
    "plan": "As planned",
    "wind": "Crosswind and wind error",
    "start": "Starts off the plan",
    "forbidden": "What geometry forbids",
    "speed": "A receiver faster or slower than the trim",
    "authority": "With more speed authority",
    "turn": "A receiver that turns",
    "fault": "Faults of the set",
}
MISSES = (("rollout.x.rms_m", "x"), ("rollout.y.rms_m", "y"), ("end.x.rms_m", "x after the leg"), ("end.y.rms_m", "y"))
SHARES = (
    ("rollout.outside", "outside at roll-out, %"),
    ("end.outside", "outside after the leg, %"),
    ("leg", "leg flown, %"),
    ("warned", "ranges do not fit, %"),
    ("told.before", "told before the turn, %"),
    ("told.outside", "of those outside at roll-out, %"),
    ("false.turn", "false before the turn, %"),
    ("false.speed", "speed false, %"),
    ("false.end", "false at the end, %"),
    ("silent.any", "outside and nothing said, %"),
)
READING = """
x is positive when the tanker is too far ahead; RMS in NM. Outside is beyond 1 NM along or 0.5 NM across. The leg follows a turn
that does not end in place and lasts at most 300 s (600 s where it gains, in the cases `_own`); figures after it are of all
meetings, with or without one. `_own`: bearing or data link at a rate of its own, not with the ranges.

Told before the turn: the innovations had warned, or the prediction of the turn had been announced, by its first second. A
prediction counts as false where the true miss is inside 0.7 of the box, a receiver said to be faster or slower than the tanker
can trim where it is not. Nothing said: neither before the turn nor at the end,
no warning of the innovations and no lost set.
"""


def geometry_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/geometry.html from a campaign folder; returns the page. Raises ReportError."""
    found = load_all(folders, ("rivard_geometry",))
    return write_page(out, PAGE, lambda: _text(next(iter(found.values()))))


def _text(c: Campaign) -> str:
    kinds = {case: c.meta["cases"][case]["kind"] for case in c.cases}
    chapters = [
        (kind, title, _table(c, [case for case in c.cases if kinds[case] == kind]))
        for kind, title in CHAPTERS.items()
        if kind in kinds.values()
    ]
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance([c])))
    body = warnings(c) + "\n".join(p.section(*x) for x in chapters)
    return p.document(TITLE, PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _table(c: Campaign, cases: Sequence[str]) -> str:
    """A row per case."""
    rows = []
    for case in cases:
        n = c.summary.get(f"{case}.meetings")
        cells = p.text(case, "name") + (p.blank() if n is None else p.plain(int(n)))
        cells += "".join(scaled(c.stat(case, value), NM) for value, _ in MISSES)
        rows.append(cells + "".join(scaled(c.stat(case, value), 0.01, digits=2) for value, _ in SHARES))
    head = [("case", ""), ("meetings", "num"), *((w, "num") for _, w in (*MISSES, *SHARES))]
    return p.table(head, rows)
