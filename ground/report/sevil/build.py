"""The air-data report: chapters in order, acceptance figures first."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from ground.report import page as p
from ground.report import prints
from ground.report import verdicts as v
from ground.report.build import Pictures, load_all, provenance, warnings, write_page
from ground.report.cases import Cases
from ground.report.chapters import everything
from ground.report.load import Campaign, Stat
from ground.report.sevil import faults as sevil_faults
from ground.report.sevil import on_board as sevil_on_board
from ground.report.sevil import page as sevil
from ground.report.sevil import position as sevil_position
from ground.report.sevil import six_dof as sevil_six_dof

PAGE = "sevil.html"
LOOP = "sevil_loop"  # studies called so are closed-loop flights


def sevil_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/sevil.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    campaigns = list(load_all(folders, sevil.ORDER).values())
    return write_page(out, PAGE, lambda: _text(campaigns, Pictures(out)))


def _text(campaigns: list[Campaign], pictures: Pictures) -> str:
    cases = Cases(campaigns, pictures, sevil.CASE_LABELS)
    chapters = [
        ("acceptance", "Acceptance figures", acceptance(cases)),
        ("tables", "Fault detection: the printed tables", sevil_faults.tables(cases)),
        ("power", "Detection against theory", sevil_faults.sweeps(cases)),
        ("two", "Two faults in one variable", sevil_faults.two(cases)),
        ("static", "Position, static", sevil_position.static(cases)),
        ("sweeps", "Position, disturbance sweeps", sevil_position.sweeps(cases)),
        ("algorithms", "Algorithms 1-16", sevil_position.algorithms(cases)),
        ("dynamic", "Position in flight", sevil_position.dynamic(cases)),
        ("six_dof", "The printed methods on the full aircraft", sevil_six_dof.six_dof(cases)),
        ("on_board", "The printed position on board", sevil_on_board.on_board(cases)),
        ("mismatch", "Wake unlike the model", sevil_position.mismatch(cases)),
        ("integrated", "Detection and position together", sevil_faults.integrated(cases)),
    ]
    for c in campaigns:
        if c.study.startswith(LOOP):
            chapters.append((c.study, str(c.meta.get("title", c.study)), _closed_loop(c)))
    chapters.append(("prints", "The print line by line", prints.chapter("sevil", {c.study: c for c in campaigns})))
    chapters = [(a, t, body) for a, t, body in chapters if body]
    chapters.append(("figures", "All figures", "".join(_everything(c) for c in campaigns)))
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance(campaigns)))
    body = _headline(campaigns, cases) + "".join(warnings(c) for c in campaigns)
    body += "\n".join(p.section(*c) for c in chapters)
    return p.document(sevil.TITLE, sevil.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def judge(cases: Cases, t: sevil.Target) -> tuple[Stat | None, bool]:
    """The value of a target furthest from being met, and whether that meets it; None where no campaign has it."""
    case = cases.named(t.case)
    stat = v.worst([case.stat(x) for x in t.values] if case is not None else [], t)
    return stat, stat is not None and v.met(stat, t)


def acceptance(cases: Cases) -> str:
    """Every target with what was measured; of several values the worst."""
    rows = []
    for t in sevil.TARGETS:
        stat, met = judge(cases, t)
        if stat is None:
            continue
        n = len(t.values)
        row = p.text(t.what + (f" (worst of {n})" if n > 1 else "")) + p.text(t.text, "name")
        row += p.cell(stat, v.css(stat, met)) + v.verdict(stat, met)
        rows.append(row + p.plain(stat.n) + p.text(stat.key))
    head = [("figure", ""), ("demand", ""), ("measured", "num"), ("", ""), ("runs", "num"), ("summary key", "")]
    return p.table(head, rows, "Means or RMS over runs with 95 % confidence intervals.") if rows else ""


def _headline(campaigns: Sequence[Campaign], cases: Cases) -> str:
    runs = [r for c in campaigns for r in c.rows]
    failed = sum(r["status"] != "ok" for r in runs)
    verdicts = [met for t in sevil.TARGETS for stat, met in (judge(cases, t),) if stat is not None]
    cards = [p.card(str(len(runs)), "runs"), p.card(str(failed), "failed runs", "bad" if failed else "good")]
    cards += v.card(verdicts)
    return f'<div class="cards">{"".join(cards)}</div>'


def _closed_loop(c: Campaign) -> str:
    """A closed-loop campaign: every value of every case from its summary."""
    text = p.paragraph(str(c.meta.get("purpose", "")))
    head = [("value", ""), *((case.replace("_", " "), "num") for case in c.cases)]
    rows = []
    last = ""
    for value in sorted(c.columns):
        group, _, rest = value.partition(".")
        if rest and group != last:
            rows.append(p.group(sevil.label(group), len(head)))
            last = group
        rows.append(p.text(rest or value) + "".join(p.cell(c.stat(x, value)) for x in c.cases))
    return text + p.table(head, rows)


def _everything(c: Campaign) -> str:
    return f"<h3>{escape(c.study)}</h3>" + p.paragraph(str(c.meta.get("purpose", ""))) + everything(c)


READING = """
Every number is that of the campaign's summary.json under the key shown in the cell: for RMS values the RMS over runs, else the
mean; the small line below is the 95 % confidence interval over runs (Student's t; of an RMS from its mean square; of shares
after Wilson). Run i has the same seed in every case of a study.

Positions and errors are in the tanker's air-path axes, y right, z down, in metres; errors are distances in the y-z plane unless
an axis is named. A filter's errors count whether or not it calls itself valid.

Plant and onboard wake are separate sets of parameters and separate code, equal in value unless a case says so: such figures are
those of a perfect wake model and flatter every method that uses one. Judge by the chapter on wakes unlike the model.

The source does not print its wake's dimensions, its probe places, the time split of its manoeuvre or its weights; where the
printed tables depend on them a difference says nothing about the method.
"""
