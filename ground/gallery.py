"""`ground index FOLDER`: the runs and campaigns of a folder as one page that needs nothing else: a table for each scenario with
the figures it is judged by, to be sorted by a click, a small picture of each run, links into the folders.
"""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ground.columns import LogError, load
from ground.report.page import STYLE, number
from ground.tree import flatten
from ground.whole import scenario

COMMON = ("run.sim_s", "run.sim_s_per_wall_s", "loop.slips")
FEW = 8  # figures of a run that has no bounds
SIDE, POINTS, EDGE = 150, 240, 8  # of a small picture [px], points of a track in it
COLORS = ("#3282dc", "#1e9650", "#c85a6e", "#966ee1")
WIDTH = 420  # [px] of a picture put into the page
STYLES = """
main{max-width:1500px}th{cursor:pointer;user-select:none;white-space:nowrap}
th.up::after{content:" \\25B2"}th.down::after{content:" \\25BC"}
th:focus-visible{outline:2px solid var(--blue)}td svg,td img{display:block}td img{max-width:210px;height:auto}
.completed{color:var(--good)}.failed,.lost,.truncated{color:var(--bad)}.aborted,.none{color:var(--warn)}
input{font:inherit;padding:4px 8px;border:1px solid var(--line);border-radius:4px;min-width:260px;background:none;color:inherit}
@media (prefers-color-scheme:dark){:root{--ink:#e4e8ec;--soft:#9aa7b3;--line:#333c46;--wash:#1b222a;--blue:#6aa9ee;--good:#5cc486;
--bad:#ff8a80;--warn:#e0b050}body{background:#11161b}}
"""
SCRIPT = """
for(const th of document.querySelectorAll('th')){
 th.tabIndex=0;
 const go=()=>{const table=th.closest('table'),i=[...th.parentNode.children].indexOf(th),down=!th.classList.contains('down');
  for(const o of th.parentNode.children)o.classList.remove('up','down');th.classList.add(down?'down':'up');
  const key=r=>{const c=r.children[i],v=c.dataset.value;return v===undefined?c.textContent.trim():parseFloat(v)};
  const rows=[...table.tBodies[0].rows];
  rows.sort((a,b)=>{const x=key(a),y=key(b),e=v=>v===''||v!==v;
   if(e(x)||e(y))return e(x)-e(y);
   const d=typeof x==='number'&&typeof y==='number'?x-y:String(x).localeCompare(String(y));return down?-d:d});
  rows.forEach(r=>table.tBodies[0].append(r))};
 th.addEventListener('click',go);th.addEventListener('keydown',e=>{if(e.key==='Enter'||e.key===' '){e.preventDefault();go()}});
}
const box=document.getElementById('filter');
box.addEventListener('input',()=>{const w=box.value.toLowerCase();
 for(const r of document.querySelectorAll('tbody tr'))r.hidden=!r.textContent.toLowerCase().includes(w)});
"""


@dataclass(frozen=True)
class Entry:
    """A run or a campaign found below the folder. `figures`: flat, of summary.json; `bounds`: of the scenario, by key."""

    path: Path
    kind: str
    group: str  # scenario or study
    figures: dict[str, Any]
    facts: dict[str, Any]
    bounds: dict[str, Any] = field(default_factory=dict)


def _json(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def find(folder: Path) -> list[Entry]:
    """Runs and campaigns in a folder and in its folders, newest first. Raises LogError if it is none."""
    if not folder.is_dir():
        raise LogError(f"{str(folder)!r} is no folder")
    out = []
    for meta_path in sorted([*folder.glob("meta.json"), *folder.glob("*/meta.json"), *folder.glob("*/*/meta.json")]):
        path, meta = meta_path.parent, _json(meta_path)
        summary = _json(path / "summary.json")
        if "study" in meta:
            facts = {"started": meta.get("started", meta.get("created", "")), "seed": meta.get("master_seed")}
            out.append(
                Entry(
                    path,
                    "campaign",
                    str(meta["study"]),
                    flatten(summary),
                    facts | {"cases": len(meta.get("cases", []))},
                )
            )
        elif "scenario" in meta:
            facts = {"started": meta.get("started", ""), "seed": meta.get("seed"), "mode": meta.get("mode", "")}
            bounds = flatten_bounds(scenario(path).get("expect", {}))
            out.append(Entry(path, "run", str(meta["scenario"]), summary, facts, bounds))
    return sorted(out, key=lambda e: str(e.facts["started"]), reverse=True)


def flatten_bounds(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Bounds of a scenario as flat keys: an upper limit, [low, high], {min, max}, or a value to be met."""
    out: dict[str, Any] = {}
    for k, v in tree.items():
        if isinstance(v, dict) and not set(v) <= {"min", "max"}:
            out |= flatten_bounds(v, f"{prefix}{k}.")
        else:
            out[prefix + k] = v
    return out


def within(bound: Any, value: Any) -> bool | None:
    """Whether a figure is within its bound; None where that cannot be said."""
    if isinstance(bound, (bool, str)):
        return bool(bound == value)
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value):
        return None
    low, high = -math.inf, math.inf
    if isinstance(bound, dict):
        low, high = bound.get("min", low), bound.get("max", high)
    elif isinstance(bound, list):
        low, high = bound
    else:
        high = bound
    return bool(low <= value <= high)


def track(run: Path) -> str:
    """The true tracks of a run from above, north up, as SVG; "" without a truth that can be read."""
    try:
        truth = load(run / "truth.tlog") if (run / "truth.tlog").is_file() else None
    except (LogError, OSError):
        return ""
    paths = (
        [t["pos_n"][:: max(1, len(t) // POINTS), :2] for (_, m), t in sorted(truth.tables.items()) if m == "TRUTH"]
        if truth
        else []
    )
    if not paths:
        return ""
    every = np.concatenate(paths)
    low, high = every.min(axis=0), every.max(axis=0)
    scale = (SIDE - 2 * EDGE) / max(float((high - low).max()), 1.0)
    middle = 0.5 * (low + high)
    lines = []
    for i, p in enumerate(paths):
        xy = np.stack([SIDE / 2 + scale * (p[:, 1] - middle[1]), SIDE / 2 - scale * (p[:, 0] - middle[0])], axis=1)
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in xy)
        color = COLORS[i % len(COLORS)]
        x, y = xy[-1]
        lines.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>')
        lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{color}"/>')
    return f'<svg width="{SIDE}" height="{SIDE}" role="img" aria-label="tracks, north up">{"".join(lines)}</svg>'


def picture(run: Path) -> str:
    """The newest PNG of a folder, made small, as an image in the page; "" without one."""
    found = sorted(run.glob("*.png"), key=lambda p: p.stat().st_mtime)
    if not found:
        return ""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(found[-1]) as image:
            small = image.convert("RGB")
            small.thumbnail((WIDTH, WIDTH))
            out = io.BytesIO()
            small.save(out, "JPEG", quality=82)
    except (OSError, UnidentifiedImageError):
        return ""
    data = base64.b64encode(out.getvalue()).decode()
    return f'<img alt="{escape(found[-1].name)}" src="data:image/jpeg;base64,{data}">'


def _columns(entries: Sequence[Entry]) -> list[str]:
    """Figures worth a column: those a scenario is judged by, else the first that all have."""
    keys = list(dict.fromkeys(k for e in entries for k in e.bounds))
    if not keys:
        numbers = (
            k for e in entries for k, v in e.figures.items() if isinstance(v, (int, float)) and not k.startswith("run.")
        )
        keys = list(dict.fromkeys(numbers))[:FEW]
    return [*(k for k in COMMON if k not in keys), *keys]


def _value(entry: Entry, key: str) -> str:
    value = entry.figures.get(key)
    ok = within(entry.bounds[key], value) if key in entry.bounds else None
    css = {True: " good", False: " bad", None: ""}[ok]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return f'<td class="{css.strip()}">{escape("" if value is None else str(value))}</td>'
    title = f' title="bound: {escape(str(entry.bounds[key]), quote=True)}"' if key in entry.bounds else ""
    return f'<td class="num{css}" data-value="{value!r}"{title}>{number(value)}</td>'


def _links(entry: Entry, folder: Path) -> str:
    """Name of the entry as a link to its folder, and links to what in it can be opened."""
    base = entry.path.relative_to(folder).as_posix()
    names = [p.name for p in sorted(entry.path.iterdir()) if p.suffix in (".rrd", ".html", ".png", ".json", ".parquet")]
    more = " ".join(f'<a href="{escape(f"{base}/{n}", quote=True)}">{escape(n)}</a>' for n in names)
    return f'<a href="{escape(base, quote=True)}/">{escape(entry.path.resolve().name)}</a><small>{more}</small>'


def _rows(entries: Iterable[Entry], columns: Sequence[str], folder: Path) -> list[str]:
    out = []
    for e in entries:
        outcome = str(e.figures.get("run.outcome") or ("" if e.kind == "campaign" else "none"))
        seed, started = e.facts["seed"], str(e.facts["started"])[:19].replace("T", " ")
        shown = "" if e.kind == "campaign" else f"<td>{track(e.path)}</td>"
        cells = [f"<td>{_links(e, folder)}</td>", shown, f"<td>{picture(e.path)}</td>"]
        cells.append(f'<td class="{escape(outcome)}">{escape(outcome)}</td>')
        cells.append(
            f'<td class="num" data-value="{seed}">{escape(str(seed))}</td><td class="name">{escape(started)}</td>'
        )
        out.append("<tr>" + "".join(cells) + "".join(_value(e, k) for k in columns) + "</tr>")
    return out


def page(folder: Path) -> tuple[str, int, int]:
    """The page of a folder, and how many runs and campaigns are on it. Raises LogError if it is no folder."""
    entries = find(folder)
    runs, campaigns = ([e for e in entries if e.kind == kind] for kind in ("run", "campaign"))
    parts = []
    for found, what in ((runs, "run"), (campaigns, "campaign")):
        for group in sorted({e.group for e in found}):
            some = [e for e in found if e.group == group]
            columns = _columns(some)
            head = [what, *(["tracks"] if what == "run" else []), "picture", "outcome", "seed", "started", *columns]
            cells = "".join(f"<th>{escape(h)}</th>" for h in head)
            rows = "\n".join(_rows(some, columns, folder))
            plural = f"{len(some)} {what}{'s' if len(some) > 1 else ''}"
            parts.append(
                f"<h2>{escape(group)} <small class='soft'>{plural}</small></h2>\n"
                f"<div class='scroll'><table><thead><tr>{cells}</tr></thead><tbody>\n{rows}\n</tbody></table></div>"
            )
    title = f"Runs of {escape(folder.resolve().name)}"
    lead = f"{len(runs)} runs, {len(campaigns)} campaigns. A heading sorts its table; green and red: within and beyond its bound."
    body = "\n".join(parts) or "<p>Neither a run nor a campaign is here.</p>"
    html = (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
        f"<title>{title}</title><style>{STYLE}{STYLES}</style></head><body><main><header><h1>{title}</h1>"
        f"<p class='lead'>{lead}</p><input id='filter' type='search' placeholder='only rows with ...' aria-label='filter'>"
        f"</header>\n{body}\n</main><script>{SCRIPT}</script></body></html>\n"
    )
    return html, len(runs), len(campaigns)
