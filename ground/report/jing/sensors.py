"""The chapter on sensors as they are: the campaign `jing_sensors` against its acceptance figures, as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ground.report import page as p
from ground.report.goals import Goal
from ground.report.jing.page import SENSORS as STUDY
from ground.report.load import Campaign

TACTICAL, PAPER = "tactical", "paper"
GOALS: tuple[Goal, ...] = (
    Goal("tactical sensors, drawn microbursts: managed law survives", "drawn_tactical", ("managed.survived",), ">=", 0.92,
         study=STUDY),
    Goal("tactical sensors: w_h inside 2 sigma", "drawn_tactical", ("w_h.inside_2sigma",), "within", 0.945, 0.0351, STUDY),
    Goal("w_x inside 2 sigma, as a share over runs", "drawn_tactical", ("w_x.inside_2sigma",), "within", 0.945, 0.0351, STUDY),
    Goal("clean approach: ground contact", "clean_tactical", ("lost",), "<=", 0.0, study=STUDY),
    Goal("clean approach: aborted for nothing", "clean_tactical", ("aborted",), "<=", 0.01, study=STUDY),
    Goal("engine out at the abort: lost", "engine_abort", ("lost",), "<=", 0.05, study=STUDY),
    Goal("engine out at 30 s: lost", "engine_30s", ("lost",), "<=", 0.2, study=STUDY),
    Goal("engine out: w_x about its mean [m/s]", "engine_abort", ("w_x.about_mean",), "<=", 0.35, study=STUDY),
)  # fmt: skip
SHARES = (50, 95, 99, 100)
FIXED = ("lost", "height_min_m.apart", "slope_max_m.apart", "w_h.rms")


def chapter(c: Campaign | None) -> str:
    """Tables of what was flown; nothing without the campaign."""
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    return out + "".join(t for t in (_approach(c), _drawn(c), _fixed(c), _engine(c), _faults(c)) if t)


def _values(c: Campaign, case: str, key: str) -> dict[int, float]:
    """Finite values of a case by run."""
    rows: list[dict[str, Any]] = [r for r in c.rows if r["case"] == case and r["status"] == "ok"]
    return {int(r["run"]): float(r[key]) for r in rows if r.get(key) is not None and math.isfinite(r[key])}


def _approach(c: Campaign) -> str:
    """The clean approach with both grades of sensors."""
    rows = []
    for name in (TACTICAL, PAPER):
        off = list(_values(c, f"clean_{name}", "slope_max_m").values())
        if not off:
            continue
        row = p.text(name, "name") + "".join(p.plain(float(np.percentile(off, q)), "", " m") for q in SHARES)
        cells = (c.stat(f"clean_{name}", key) for key in ("lost", "aborted", "w_x.rms", "w_h.rms", "w_h.inside_2sigma"))
        rows.append(row + "".join(p.cell(s) for s in cells) + p.plain(len(off)))
    head = [("sensors", ""), *((f"{q} %" if q < 100 else "largest", "num") for q in SHARES)]
    head += [(t, "num") for t in ("ground", "aborted", "w_x RMS [m/s]", "w_h RMS [m/s]", "w_h inside 2 sigma", "runs")]
    note = "Largest distance from the slope of each approach, over the approaches."
    return "<h3>Clean approaches</h3>" + p.table(head, rows, note) if rows else ""


def _drawn(c: Campaign) -> str:
    """Survival per law, and the paired difference to paper sensors."""
    case, laws = "drawn_tactical", {"managed": "managed height", "pitch": "pitch 15°"}
    ours, paper = (_values(c, f"drawn_{name}", "managed.survived") for name in (TACTICAL, PAPER))
    if not ours:
        return ""
    rows = [p.text(f"tactical, {word}", "name") + p.cell(c.stat(case, f"{law}.survived")) for law, word in laws.items()]
    if paper:
        rows.append(p.text("paper sensors, managed height", "name") + p.cell(c.stat("drawn_paper", "managed.survived")))
        both = ours.keys() & paper.keys()
        apart = float(np.mean([ours[k] - paper[k] for k in both])) if both else math.nan
        rows.append(
            p.text("tactical less paper, the same bursts and luck", "name")
            + p.plain(apart, "", "", f"{len(both)} pairs")
        )
    for key in ("w_x.inside_2sigma", "w_h.inside_2sigma", "w_x.rms", "w_h.rms", "distrusted"):
        rows.append(p.text(key, "name") + p.cell(c.stat(case, key)))
    return "<h3>Drawn microbursts</h3>" + p.table([("", ""), ("share or value", "num")], rows)


def _fixed(c: Campaign) -> str:
    """Fixed errors against the flight without, on the same luck."""
    out = ""
    for air in ("clean", "severe"):
        case = f"fixed_{air}"
        names = _parts(c, case, ".slope_max_m.apart")
        rows = []
        for name in names:
            largest = [max(_values(c, case, f"{name}.{k}").values(), default=math.nan) for k in FIXED[1:3]]
            row = p.text(name.replace("_", " "), "name") + p.cell(c.stat(case, f"{name}.lost"))
            row += "".join(p.plain(v, "bad" if v > 2.0 else "good", " m") for v in largest)
            rows.append(row + p.cell(c.stat(case, f"{name}.w_h.rms")))
        head = [("error", ""), ("lost", "num"), ("least height apart, largest", "num"), ("slope apart, largest", "num")]
        head.append(("w_h RMS [m/s]", "num"))
        out += f"<h3>Fixed errors, {air}</h3>" + p.table(head, rows) if rows else ""
    return out


def _engine(c: Campaign) -> str:
    rows = []
    for case in ("engine_abort", "engine_30s"):
        after = list(_values(c, case, "announced_s").values())
        if after:
            keys = ("lost", "height_min_m", "speed_min_mps", "w_x.about_mean", "w_x.rms")
            row = p.text(case.replace("_", " "), "name") + p.plain(
                max(after), "good" if max(after) <= 3.0 else "bad", " s"
            )
            rows.append(row + "".join(p.cell(c.stat(case, key)) for key in keys) + p.plain(len(after)))
    head = [("engine stops", ""), ("announced, latest", "num"), ("lost", "num"), ("least height [m]", "num")]
    head += [(t, "num") for t in ("least airspeed [m/s]", "w_x about its mean", "w_x RMS", "runs")]
    return "<h3>One engine out in the severe microburst</h3>" + p.table(head, rows) if rows else ""


def _faults(c: Campaign) -> str:
    rows = []
    for case in (x for x in c.cases if x.startswith("fault_")):
        row = p.text(case.removeprefix("fault_").replace("_", " "), "name")
        for air in ("clean", "severe"):
            row += "".join(
                p.cell(c.stat(case, f"{air}.{k}"), interval=False) for k in ("lost", "harmless", "announced")
            )
            silent = c.stat(case, f"{air}.silent").value
            row += p.plain(silent, "bad" if silent else "good") + p.cell(c.stat(case, f"{air}.after_s"), interval=False)
        rows.append(row)
    heads: Sequence[str] = ("lost", "harmless", "announced", "silent", "after [s]")
    head = [("fault from 25 s on", ""), *((f"{air}: {t}", "num") for air in ("clean", "severe") for t in heads)]
    note = "Silent: lost, beyond 20 m of the slope or aborted without a warning before it."
    return "<h3>Faults of every sensor</h3>" + p.table(head, rows, note) if rows else ""


def _parts(c: Campaign, case: str, end: str) -> list[str]:
    """Names before `end` among the values a case has."""
    found = [k.removesuffix(end) for k in c.columns if k.endswith(end)]
    return [n for n in found if c.stat(case, f"{n}{end}").value is not None]
