"""The report on state and wind estimation in refuelling: chapters in order, one per study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report import page as p
from ground.report import prints
from ground.report.build import Pictures, load_all, provenance, warnings, write_page
from ground.report.chapters import everything
from ground.report.lee import closed_loop, open_loop, scan
from ground.report.lee import page as lee
from ground.report.load import Campaign

PAGE = "lee.html"


def lee_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/lee.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    campaigns = load_all(folders, ["lee", *lee.STUDIES])
    return write_page(out, PAGE, lambda: _text(campaigns, Pictures(out)))


def _text(campaigns: dict[str, Campaign], pictures: Pictures) -> str:
    chapters: list[tuple[str, str, str]] = []  # anchor, title, body
    for study, c in campaigns.items():
        body = open_loop.tanker(c, pictures) if study == "lee" else _study(c, pictures)
        title = (
            "Tanker cases" if study == "lee" else lee.STUDIES[study].title if study in lee.STUDIES else c.meta["title"]
        )
        chapters.append((study, str(title), warnings(c) + body))
    chapters.append(("prints", "The print line by line", prints.chapter("lee", campaigns)))
    chapters.append(("reading", "How to read this", _reading()))
    chapters.append(("provenance", "Provenance", provenance(list(campaigns.values()))))
    body = _headline(campaigns) + "\n".join(p.section(*c) for c in chapters)
    return p.document(lee.TITLE, lee.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _study(c: Campaign, pictures: Pictures) -> str:
    if c.study == scan.STUDY:
        return scan.chapter(c)
    known = lee.STUDIES.get(c.study)
    body = p.paragraph(str(c.meta.get("purpose", "")))
    if known is not None:
        body += claims(c, known)
    loop, wind = closed_loop.chapter(c, pictures), open_loop.sweep(c, pictures)
    return body + (loop + wind or "") + everything(c, open_loop.label, open_loop.case_label)


def claims(c: Campaign, known: lee.Sweep) -> str:
    """What the source printed, each claim with the noise it is for, and whether a case here has that noise."""
    coloured = {bool(c.meta["cases"][x].get("tau_s")) for x in c.cases}
    out = p.paragraph(f"Printed: {known.printed}.", "soft") if known.printed else ""
    for kind, text in ((False, known.white), (True, known.coloured)):
        if text:
            noise = "coloured" if kind else "white"
            here = "" if kind in coloured else f" No case here has {noise} noise: nothing below can be held against it."
            out += p.paragraph(f"Printed, {noise} noise: {text}.{here}", "soft")
    return out


def _headline(campaigns: dict[str, Campaign]) -> str:
    rows = [r for c in campaigns.values() for r in c.rows]
    failed = sum(r["status"] != "ok" for r in rows)
    cards = [p.card(str(len(rows)), "runs"), p.card(str(failed), "failed runs", "bad" if failed else "good")]
    if "lee" in campaigns:
        met, of = open_loop.targets(campaigns["lee"])
        won, cases = open_loop.wins(campaigns["lee"])
        if of:
            cards.append(p.card(f"{met} of {of}", "accuracy targets met", "good" if met == of else "bad"))
        if cases:
            text = "cases where the default beats the printed method"
            cards.append(p.card(f"{won} of {cases}", text, "good" if won == cases else "bad"))
    return f'<div class="cards">{"".join(cards)}</div>'


READING = """
Wind magnitude error is (estimate - truth) / truth of the magnitude; direction error is the horizontal angle. Of errors the
RMS over the runs is given, of other figures the mean; the small line below is the 95 % confidence interval over runs
(Student's t; of an RMS from its mean square; of shares after Wilson).

Run i has the same seed in every case and for every filter, so the filters of one case are compared on the same noise;
"better in" counts the runs in which the default had the smaller error.

Consistency: a filter that knows its own error has it inside its 3-sigma bounds at least 97 % of the time, and its normalised
error squared (NEES) inside the chi-square band. Limit: RMS error over the posterior Cramer-Rao bound along the true
trajectory; on average no unbiased estimator gets below 1.

The source prints neither its process noise nor its gains; "as printed" means its equations with values of our own.
"""


def _reading() -> str:
    return "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))
