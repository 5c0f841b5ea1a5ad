"""The fault matrix as a page: counts per outcome and moment, then one square a case."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from ground.report import page as p
from ground.report.build import load_all, provenance, warnings, write_page
from ground.report.load import Campaign

PAGE = "integrity.html"
TITLE = "The fault matrix: what one fault does to the flying system"
PURPOSE = (
    "One fault at a time is put into copies of one flight of two aircraft; the truth says what becomes of it. A square is one "
    "case, split by its runs: the colour is the outcome."
)
OUTCOMES = {  # key, colour: name, meaning
    "kept": ("#2f8f57", "kept", "on station, never beyond the limit"),
    "left": ("#7fbf6a", "left in time", "announced before the limit was passed, station left, keep-out respected"),
    "late": ("#e3b23c", "late", "announced or left only after the limit was passed, within 1 s"),
    "silent": ("#e0702c", "silent", "beyond the limit for 1 s and nothing announced"),
    "keep_out": (
        "#c2379a",
        "keep-out violated",
        "less than 5 m between the airframes, or above the boom's pivot behind it",
    ),
    "upset": ("#7a4fc4", "upset", "either aircraft beyond 70° of bank or its own limits for 1 s"),
    "lost": ("#a3161f", "lost", "on the ground, broken, out of control or collided"),
}
STYLE = """
:root{color-scheme:light dark}
.sq{display:inline-flex;width:26px;height:20px;border-radius:3px;overflow:hidden;margin:1px 2px;vertical-align:middle;
border:1px solid var(--line)}.sq.lies{border:3px solid #e5484d}.sq i{display:block;flex:1;height:100%}
table.matrix td,table.matrix th{padding:2px 8px}table.matrix td.name{font-size:13px}
.legend{display:flex;flex-wrap:wrap;gap:6px 20px;margin:10px 0;font-size:13.5px}.legend span{white-space:nowrap}
@media (prefers-color-scheme:dark){:root{--ink:#e4e8ec;--soft:#9aa7b3;--line:#333c46;--wash:#1b222a;--blue:#6aa9ee;--good:#5cc486;
--bad:#f0867d;--warn:#e0b45a}body{background:#12171c}tr.group td{background:#1b222a}}
"""


def integrity_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/integrity.html from a campaign folder; returns the page. Raises ReportError."""
    found = load_all(folders, ("integrity",))
    return write_page(out, PAGE, lambda: _text(next(iter(found.values()))))


def _text(c: Campaign) -> str:
    rows = [r for r in c.rows if r["status"] == "ok"]
    chapters = [
        ("counts", "Counts per outcome", _counts(c, rows)),
        ("matrix", "One square a case", _legend() + _matrix(c, rows)),
        ("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))),
        ("provenance", "Provenance", provenance([c])),
    ]
    body = f"<style>{STYLE}</style>" + _cards(rows) + warnings(c) + "\n".join(p.section(*x) for x in chapters)
    return p.document(TITLE, PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _which(row: dict[str, Any]) -> str:
    return list(OUTCOMES)[int(row["outcome"])]


def _cards(rows: list[dict[str, Any]]) -> str:
    out = p.card(str(len({r["case"] for r in rows})), "cases") + p.card(str(len(rows)), "runs")
    for key, (_, name, _) in OUTCOMES.items():
        n = sum(_which(r) == key for r in rows)
        out += p.card(str(n), name, "good" if key in ("kept", "left") else "bad" if n else "good")
    return f'<div class="cards">{out}</div>'


def _moments(c: Campaign) -> list[str]:
    return list(dict.fromkeys(c.meta["cases"][x]["moment"] for x in c.cases))


def _counts(c: Campaign, rows: list[dict[str, Any]]) -> str:
    """Runs per outcome at each moment, with the Wilson interval of the share in percent."""
    lines = []
    for moment in [*_moments(c), "all"]:
        here = [r for r in rows if moment in ("all", c.meta["cases"][r["case"]]["moment"])]
        cells = "".join(_share(sum(_which(r) == key for r in here), len(here)) for key in OUTCOMES)
        bounded = [r for r in here if _honest(r) is not None]
        cells += _share(sum(bool(_honest(r)) for r in bounded), len(bounded))
        lines.append(p.text(moment, "name") + p.plain(len(here)) + cells)
    head = [
        ("moment", ""),
        ("runs", "num"),
        *((name, "num") for _, name, _ in OUTCOMES.values()),
        ("honest bound", "num"),
    ]
    return p.table(head, lines, "Runs; below, the share of them in percent with its 95 % Wilson interval.")


def _honest(row: dict[str, Any]) -> bool | None:
    """Whether the bound on the position held, None for a run that gave none."""
    x = row.get("honest")
    return None if x is None or x != x else x > 0.0


def _share(k: int, n: int) -> str:
    """A count of n runs and its share [%] with the Wilson (1927) interval at 95 %."""
    if not n:
        return p.blank()
    z, q = 1.959964, k / n
    middle, half = (
        (q + z * z / (2 * n)) / (1 + z * z / n),
        z / (1 + z * z / n) * (q * (1 - q) / n + z * z / (4 * n * n)) ** 0.5,
    )
    return p.plain(
        k, below=f"{100 * q:.1f} ({100 * max(0.0, middle - half):.1f} … {100 * min(1.0, middle + half):.1f})"
    )


def _legend() -> str:
    spans = (
        f'<span><span class="sq"><i style="background:{colour}"></i></span>{escape(name)}: {escape(words)}</span>'
        for colour, name, words in OUTCOMES.values()
    )
    return f'<div class="legend">{"".join(spans)}</div>'


def _matrix(c: Campaign, rows: list[dict[str, Any]]) -> str:
    """Rows: sensor and kind; columns: moments, in each the sizes from small to large."""
    by_case: dict[str, list[dict[str, Any]]] = {}
    for r in rows:
        by_case.setdefault(r["case"], []).append(r)
    moments, lines = _moments(c), []
    places: dict[str, dict[str, dict[str, list[str]]]] = {}
    for case in c.cases:
        where = c.meta["cases"][case]
        places.setdefault(where["group"], {}).setdefault(where["row"], {}).setdefault(where["moment"], []).append(case)
    for group, kinds in places.items():
        lines.append(p.group(group, 1 + len(moments)))
        for kind, at in kinds.items():
            cells = "".join(
                f"<td>{''.join(_square(c.meta['cases'][x], by_case.get(x, [])) for x in _sorted(c, at.get(m, [])))}</td>"
                for m in moments
            )
            lines.append(p.text(kind, "name") + cells)
    table = p.table([("sensor, kind", ""), *((m, "") for m in moments)], lines)
    return table.replace("<table>", '<table class="matrix">', 1)


def _sorted(c: Campaign, cases: list[str]) -> list[str]:
    return sorted(cases, key=lambda x: int(c.meta["cases"][x]["rank"]))


def _square(where: dict[str, Any], runs: list[dict[str, Any]]) -> str:
    """A case: a strip for each run, from bad to good; the words are in its title."""
    worst = sorted(runs, key=lambda r: -r["outcome"])
    strips = "".join(f'<i style="background:{OUTCOMES[_which(r)][0]}"></i>' for r in worst)
    words = (
        ", ".join(f"{OUTCOMES[_which(r)][1]} (off {r['off_max_m']:.1f} m, gap {r['gap_min_m']:.1f} m)" for r in worst)
        or "no run"
    )
    title = f"{where['group']} {where['row']} {where['size']}, {where['moment']}: {words}"
    lies = " lies" if any(_honest(r) is False for r in runs) else ""
    title += ", bound passed" if lies else ""
    return f'<span class="sq{lies}" title="{escape(title, quote=True)}">{strips}</span>'


READING = """
Every run starts from a copy of one flight of its seed at a named moment: in contact on the straight leg, in contact in the turn,
at pre-contact, and in contact with air data of three good probes. The fault begins there; 25 s are flown. The limit is 2 m from
the contact point in contact, 3 m from the pre-contact point. Within a row, sizes grow from left to right; point at a square for
its words.

Announced means a text of warning or worse from either aircraft, or the receiver's phase leaving the one it was in. Of several
outcomes the worst counts: lost, upset, keep-out violated, silent, late, left in time, kept. A fault that moves nobody counts as
kept whether or not it was announced.

Where the receiver bounds its position (INTEGRITY_STATUS), a run is honest if the true error lay within the bound in every one it
sent from the fault until the fault was announced. A run that was not has a red frame.
"""
