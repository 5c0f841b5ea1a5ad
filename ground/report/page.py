"""Pieces of a report page: escaped text, tables, numbers that carry their summary key, figures as base64, one document.

A number cell holds `data-key` and `data-value`, so that a script (and a test) can check the page against summary.json.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape

from ground.report.load import Stat

STYLE = """
:root{--ink:#1c2530;--soft:#5b6875;--line:#d8dee5;--wash:#f4f6f8;--blue:#1f5fa8;--good:#1b7a43;--bad:#b3261e;--warn:#8a5a00}
*{box-sizing:border-box}
body{margin:0;color:var(--ink);background:#fff;font:15px/1.5 system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif}
main{max-width:1220px;margin:0 auto;padding:28px 32px 80px}
header{border-bottom:3px solid var(--blue);margin-bottom:20px;padding-bottom:14px}
h1{font-size:27px;line-height:1.2;margin:0 0 8px}
h2{font-size:20px;margin:46px 0 8px;padding-top:10px;border-top:1px solid var(--line)}
h3{font-size:16px;margin:28px 0 6px}
p,li{max-width:86ch}.lead{font-size:16px}.soft,.note{color:var(--soft)}.note{font-size:13px;margin:6px 0 0}
nav{background:var(--wash);border-radius:6px;padding:8px 14px;margin:14px 0;font-size:14px}
nav a{color:var(--blue);text-decoration:none;margin-right:18px;white-space:nowrap}
.cards{display:flex;flex-wrap:wrap;gap:12px;margin:16px 0}
.card{border:1px solid var(--line);border-left:4px solid var(--blue);border-radius:5px;padding:9px 16px;min-width:150px}
.card.bad{border-left-color:var(--bad)}.card.good{border-left-color:var(--good)}
.card b{display:block;font-size:22px;line-height:1.2;font-variant-numeric:tabular-nums}
.card span{font-size:13px;color:var(--soft)}
.scroll{overflow-x:auto;margin:10px 0}
table{border-collapse:collapse;font-size:13.5px;font-variant-numeric:tabular-nums}
th{text-align:left;font-weight:600;background:var(--wash);vertical-align:bottom}
th,td{padding:5px 9px;border-bottom:1px solid var(--line)}
td{vertical-align:top}td.num,th.num{text-align:right}td.num{white-space:nowrap}td.text{max-width:34ch}td.claim{min-width:24ch}td.name{white-space:nowrap}
tr.group td{background:#fafbfc;font-weight:600}
td small{display:block;color:var(--soft);font-size:11.5px;font-weight:400}td.num small{white-space:nowrap}
.good{color:var(--good)}.bad{color:var(--bad)}.warn{color:var(--warn)}td.good,td.bad{font-weight:600}
figure{margin:14px 0 22px}figure img{max-width:100%;height:auto;display:block}
figcaption{font-size:13px;color:var(--soft);max-width:100ch;margin-top:4px}
details{margin:10px 0}summary{cursor:pointer;color:var(--blue);font-size:14px}
code{font:12.5px ui-monospace,Menlo,Consolas,monospace;background:var(--wash);padding:1px 4px;border-radius:3px;
overflow-wrap:anywhere}
@media print{nav{display:none}main{padding:0}figure,tr{break-inside:avoid}details>*{display:block}}
"""


def number(value: float | None) -> str:
    """Whole for an int, else three significant digits without exponent between 0.0001 and a million; a dash for no number."""
    if value is None or not math.isfinite(value):
        return "–"
    if isinstance(value, int) or value == 0.0:
        return f"{value:.0f}"
    if not 1e-4 <= abs(value) < 1e6:
        return f"{value:.2e}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def text(value: object, css: str = "") -> str:
    """A text cell."""
    return f'<td class="{("text " + css).strip()}">{escape(str(value))}</td>'


def blank(why: str = "") -> str:
    """A number cell without a number, and why if that is known. It has no colour of a verdict."""
    return f'<td class="num soft">–{f"<small>{escape(why)}</small>" if why else ""}</td>'


def cell(stat: Stat, css: str = "", interval: bool = True, unit: str = "") -> str:
    """A number cell with its 95 % interval below it, and which runs are not in it. Without a number `css` is not used."""
    if stat.value is None or not math.isfinite(stat.value):
        return blank(stat.why)
    ci = ""
    if interval and stat.lo is not None and stat.hi is not None and number(stat.lo) != number(stat.hi):
        ci = f"<small>{number(stat.lo)} … {number(stat.hi)}</small>"
    data = f'data-key="{escape(stat.key, quote=True)}" data-value="{stat.value!r}"'
    ci += f"<small>{escape(stat.why)}</small>" if stat.why else ""
    return f'<td class="{("num " + css).strip()}" {data}>{number(stat.value)}{unit}{ci}</td>'


def plain(value: float | None, css: str = "", after: str = "", below: str = "") -> str:
    """A number cell for a derived number, with an optional small line below. Without a number: a blank one."""
    if value is None or not math.isfinite(value):
        return blank()
    small = f"<small>{escape(below)}</small>" if below else ""
    return f'<td class="{("num " + css).strip()}">{number(value)}{escape(after)}{small}</td>'


def table(head: Sequence[tuple[str, str]], rows: Sequence[str], note: str = "") -> str:
    """A table. head: (text, "num" or "") per column; rows: ready cells of each row, or a whole `<tr>`."""
    top = "".join(f'<th class="{css}">{escape(h)}</th>' for h, css in head)
    body = "".join(r if r.startswith("<tr") else f"<tr>{r}</tr>" for r in rows)
    foot = f'<p class="note">{escape(note)}</p>' if note else ""
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>{foot}'


def group(label: str, columns: int) -> str:
    """A row that heads the rows below it."""
    return f'<tr class="group"><td colspan="{columns}">{escape(label)}</td></tr>'


def figure(png: bytes, caption: str) -> str:
    """A picture inside the page."""
    data = base64.b64encode(png).decode()
    return (
        f'<figure><img alt="{escape(caption, quote=True)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def card(value: str, label: str, css: str = "") -> str:
    """A headline figure."""
    return f'<div class="card {css}"><b>{escape(value)}</b><span>{escape(label)}</span></div>'


def paragraph(body: str, css: str = "") -> str:
    """A paragraph of plain text."""
    return f'<p class="{css}">{escape(body)}</p>' if css else f"<p>{escape(body)}</p>"


def section(anchor: str, title: str, body: str) -> str:
    """A chapter."""
    return f'<section id="{escape(anchor, quote=True)}"><h2>{escape(title)}</h2>{body}</section>'


def details(title: str, body: str) -> str:
    """Something to unfold."""
    return f"<details><summary>{escape(title)}</summary>{body}</details>"


def document(title: str, lead: str, contents: Sequence[tuple[str, str]], body: str) -> str:
    """The whole page: no script, nothing loaded from anywhere."""
    links = " ".join(f'<a href="#{escape(a, quote=True)}">{escape(t)}</a>' for a, t in contents)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{escape(title)}</title>'
        f'<style>{STYLE}</style></head>\n<body><main><header><h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p>'
        f"</header><nav>{links}</nav>\n{body}\n</main></body></html>\n"
    )
