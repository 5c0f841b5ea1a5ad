"""Acceptance figures that name a study's case: judged over the campaigns found, as a table and headline cards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ground.report import page as p
from ground.report import verdicts as v
from ground.report.load import Campaign, Stat, finite

Found = Mapping[str, Campaign]


@dataclass(frozen=True)
class Goal(v.Target):
    """An acceptance figure of one study's case (case names repeat between studies)."""

    study: str = ""


def figure(c: Campaign, case: str, value: str) -> Stat:
    """Statistic of a value: that of all runs pooled where the study has one, else the statistic over runs."""
    key = f"{case}.{value}.pooled"
    if key not in c.summary:
        return c.stat(case, value)
    found = finite(c.summary[key])
    why = "" if found is not None else c.fate(case, value) or "not finite"
    return Stat(key, found, n=c.runs(case) - c.failed(case), why=why)


def judge(found: Found, t: Goal) -> tuple[Stat | None, bool]:
    """The value of a goal furthest from being met, and whether that meets it; None where no campaign has it."""
    c = found.get(t.study)
    stat = v.worst([figure(c, t.case, x) for x in t.values] if c is not None else [], t)
    return stat, stat is not None and v.met(stat, t)


def judged(found: Found, goals: Sequence[Goal]) -> tuple[str, str]:
    """Table of the goals with what was measured, of several values the worst; and the headline cards."""
    rows, verdicts = [], []
    for t in goals:
        stat, met = judge(found, t)
        if stat is not None:
            verdicts.append(met)
            row = p.text(t.what) + p.text(t.text, "name") + p.cell(stat, v.css(stat, met)) + v.verdict(stat, met)
            rows.append(row + p.plain(stat.n) + p.text(f"{t.study}: {stat.key}"))
    head = [("figure", ""), ("demand", ""), ("measured", "num"), ("", ""), ("runs", "num"), ("summary key", "")]
    runs = [r for c in found.values() for r in c.rows]
    failed = sum(r["status"] != "ok" for r in runs)
    cards = [p.card(str(len(runs)), "runs"), p.card(str(failed), "failed runs", "bad" if failed else "good")]
    cards += v.card(verdicts)
    table = p.table(head, rows, "Means or RMS over runs with 95 % confidence intervals.") if rows else ""
    return table, f'<div class="cards">{"".join(cards)}</div>'
