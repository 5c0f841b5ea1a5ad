"""Chapters on station keeping: position error at contact per controller, against a swept parameter or per case."""

from __future__ import annotations

from ground.report import figures as f
from ground.report import page as p
from ground.report.chapters import Keeper
from ground.report.lee import page as lee
from ground.report.lee.open_loop import case_label, label, labels, points
from ground.report.load import Campaign, Stat

AXES = ("x", "y", "z")
RMS = "contact.rms_m"
CEILING_M = 2.5  # [m] the figures' upper end: beyond the boom's limit it does not matter how far


def _lost(c: Campaign, case: str, actor: str) -> Stat:
    for key in (f"{actor}.lost", f"{actor}.contact.lost"):
        stat = c.stat(case, key)
        if stat.value is not None:
            return stat
    return Stat(key, None)


def chapter(c: Campaign, pictures: Keeper) -> str:
    """Figures and table of the position error; empty without such values."""
    actors = list(dict.fromkeys(a for x in AXES for a in c.actors(f"{RMS}.{x}")))
    if not actors:
        return ""
    known = lee.STUDIES.get(c.study)
    swept = c.swept(known.params if known else ())
    if len({x for x, _ in swept.values()}) >= 3:
        panels = [(f"{x}, RMS [m]", points(c, swept, f"{RMS}.{x}")) for x in AXES]
        names = {n for _, series in panels for n in series}
        limit = (lee.BOOM_LIMIT_M, "boom limit quoted by the source")
        png = f.sweep(panels, known.xlabel if known else "swept parameter", labels(names), limit, CEILING_M)
        caption = (
            f"Position error at contact over the runs with 95 % confidence intervals; arrows: beyond {CEILING_M} m; "
            "crosses: lost in all runs."
        )
    else:
        groups = [f"{case_label(case)}\n{x}" for case in c.cases for x in AXES]
        series = {}
        for a in actors:
            series[a] = [c.bar(case, f"{a}.{RMS}.{x}") for case in c.cases for x in AXES]
        png = f.bars(groups, series, "position error at contact, RMS [m]", labels(actors))
        caption = "Position error at contact per axis over the runs with 95 % confidence intervals."
    out = "<h3>Station keeping</h3>" + pictures.add(f"{c.study}_contact", png, caption)
    return out + _table(c, actors)


def _table(c: Campaign, actors: list[str]) -> str:
    head = [("case", ""), ("controller", ""), ("runs", "num"), ("share lost", "num")]
    head += [*((f"RMS {x} [m]", "num") for x in AXES)]
    head += [*((f"95th pct {x} [m]", "num") for x in AXES), *((f"max {x} [m]", "num") for x in AXES)]
    rows = []
    for case in c.cases:
        mine = [a for a in actors if any(c.stat(case, f"{a}.{RMS}.{x}").n or _lost(c, case, a).n for x in AXES)]
        for i, a in enumerate(mine):
            lost = _lost(c, case, a)
            row = p.text(case_label(case) if i == 0 else "", "name") + p.text(label(a), "name")
            row += p.plain(c.runs(case), below=f"{c.failed(case)} failed" if c.failed(case) else "")
            row += p.cell(lost, "bad" if lost.value else "")
            row += "".join(p.cell(c.stat(case, f"{a}.{RMS}.{x}")) for x in AXES)
            row += "".join(p.cell(c.stat(case, f"{a}.contact.p95_m.{x}"), interval=False) for x in AXES)
            rows.append(row + "".join(p.cell(c.stat(case, f"{a}.contact.max_m.{x}"), interval=False) for x in AXES))
    return p.table(
        head,
        rows,
        "Share lost: of the runs, in how many the receiver left the vicinity of the tanker; the other figures are of the rest. "
        "95th pct and max are means over runs.",
    )
