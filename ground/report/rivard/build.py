"""The rendezvous report: acceptance figures, printed beside reproduced and improved, then chapter by chapter."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report import page as p
from ground.report import prints
from ground.report import verdicts as v
from ground.report.build import Pictures, load_all, provenance, warnings, write_page
from ground.report.cases import Cases
from ground.report.load import Campaign, Stat
from ground.report.rivard import chapters as rivard_chapters
from ground.report.rivard import filters as rivard_filters
from ground.report.rivard import open as rivard_open
from ground.report.rivard import page as rivard
from ground.report.rivard import six as rivard_six
from ground.report.rivard.cells import scaled

PAGE = "rivard.html"
MAIN = "rivard"


def rivard_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/rivard.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    found = load_all(folders)
    campaigns = [found[s] for s in sorted(found, key=lambda s: (s != MAIN, s))]
    return write_page(out, PAGE, lambda: _text(campaigns, Pictures(out)))


def _text(campaigns: list[Campaign], pictures: Pictures) -> str:
    cases = Cases(campaigns, pictures)
    chapters = [
        ("acceptance", "Acceptance figures", acceptance(cases)),
        ("summary", "Printed, reproduced, improved", rivard_chapters.summary(cases)),
        ("tables", "The printed tables", rivard_chapters.tables(cases)),
        ("gain", "Gain of the closed loop", rivard_chapters.gain(cases)),
        ("filters", "Do the filters know their error?", rivard_filters.filters(cases)),
        ("better", "Doing better with the same sensor", rivard_chapters.steps(cases)),
        ("sensors", "Other sensors", rivard_open.sensors(cases)),
        ("mismatch", "A world unlike the model", rivard_open.mismatch(cases)),
        ("wind", "Wind", rivard_open.wind(cases)),
        ("manoeuvre", "A receiver that turns or changes speed", rivard_open.manoeuvres(cases)),
        ("undone", "Lost and late ranges, wrong wind, tanker errors", rivard_open.undone(cases)),
    ]
    for c in campaigns:
        if c.study != MAIN:
            body = rivard_six.chapter(c, cases) if c.study == rivard_six.STUDY else rivard_six.other(c)
            chapters.append((c.study, str(c.meta.get("title", c.study)), body))
    chapters.append(("prints", "The print line by line", prints.chapter("rivard", {c.study: c for c in campaigns})))
    chapters = [(a, t, body) for a, t, body in chapters if body]
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance(campaigns)))
    body = _headline(campaigns, cases) + "".join(warnings(c) for c in campaigns)
    body += "\n".join(p.section(*c) for c in chapters)
    return p.document(rivard.TITLE, rivard.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def judge(cases: Cases, g: rivard.Goal) -> tuple[Stat | None, bool]:
    """The value of a goal furthest from being met, and whether that meets it; None where no campaign has it."""
    case = cases.named(g.case)
    stat = v.worst([case.stat(x) for x in g.values] if case is not None else [], g, g.scale)
    return stat, stat is not None and v.met(stat, g, g.scale)


def acceptance(cases: Cases) -> str:
    """Every goal with what was measured; of several values the worst."""
    rows = []
    for g in rivard.GOALS:
        stat, met = judge(cases, g)
        if stat is None:
            continue
        several = f" (worst of {len(g.values)})" if len(g.values) > 1 else ""
        row = p.text(g.what + several) + p.text(f"{g.text} {g.unit}".strip(), "name")
        row += scaled(stat, g.scale, css=v.css(stat, met)) + v.verdict(stat, met)
        rows.append(row + p.plain(stat.n) + p.text(stat.key))
    head = [("figure", ""), ("demand", ""), ("measured", "num"), ("", ""), ("rendezvous", "num"), ("summary key", "")]
    return p.table(head, rows, "With 95 % confidence intervals.") if rows else ""


def _headline(campaigns: Sequence[Campaign], cases: Cases) -> str:
    runs = [r for c in campaigns for r in c.rows]
    failed = sum(r["status"] != "ok" for r in runs)
    total = sum(int(c.summary.get(f"{x}.rendezvous") or 0) for c in campaigns for x in c.cases)
    verdicts = [met for g in rivard.GOALS for stat, met in (judge(cases, g),) if stat is not None]
    cards = [p.card(f"{total:,}".replace(",", " "), "rendezvous"), p.card(str(len(runs)), "batches")]
    cards.append(p.card(str(failed), "failed batches", "bad" if failed else "good"))
    cards += v.card(verdicts)
    for name, text in (("open", "RMS x / y of the present method"), ("b7re", "improved, same sensor")):
        c = cases.named(name)
        x, y = (None, None) if c is None else (c.stat("x.rms_m").value, c.stat("y.rms_m").value)
        if x is not None and y is not None:
            cards.append(p.card(f"{x / rivard.NM:.2f} / {y / rivard.NM:.2f} NM", text))
    return f'<div class="cards">{"".join(cards)}</div>'


READING = """
Each number is that of the campaign's summary.json under the key in its cell, divided by 1852 m where NM are shown. n counts
rendezvous, not batches: moments are summed over the batches and the 95 % interval comes from the summed moments (of shares after
Clopper and Pearson, of quantiles from the scatter of the batches). Batch i has the same seed in every case.

x is the miss along track at roll-out, positive when the tanker is too far ahead of the receiver; y is across track. Campaigns
store y as receiver minus tanker; the printed tables have tanker minus receiver, and the chapter on them follows the print.

The tables of thirty runs are resampled from our batches. A printed figure of thirty runs has a standard error of about 13 % for
an RMS; nothing is tuned to them.

"As shipped" is the Gaussian sum of eight-state filters with Gauss-Hermite updates, offset steering, the two-arc planner with roll
compensation at 5 deg/s, speed trim of 20 kn and a turn that starts 1 s late.
"""
