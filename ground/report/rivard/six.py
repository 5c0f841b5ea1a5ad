"""Chapter of the rendezvous report on the full aircraft: the onboard mission in the 6-DOF tanker beside its kinematic twin."""

from __future__ import annotations

from html import escape

from ground.report import page as p
from ground.report.cases import Cases
from ground.report.load import Campaign, Stat, finite
from ground.report.rivard.cells import scaled
from ground.report.rivard.figures import tracks
from ground.report.rivard.page import NM

STUDY = "rivard_6dof"
CASES = {"product": "as shipped", "seed": "source's filter and k = 3 law"}
KINDS = (
    ("six", "6-DOF tanker over the link"),
    ("kin", "kinematic twin, equal errors"),
    ("mc", "kinematic Monte Carlo"),
)


def _stat(c: Campaign, key: str) -> Stat:
    get = c.summary.get
    head, _, tail = key.rpartition("_m")
    return Stat(key, finite(get(key)), get(f"{head}_lo_m{tail}"), get(f"{head}_hi_m{tail}"))


def chapter(c: Campaign, cases: Cases) -> str:
    """RMS misses of the three kinds of each case, their ratios, and one flight from above."""
    rows = []
    out = p.paragraph(str(c.meta.get("purpose", "")))
    for case in c.cases:
        rows.append(p.group(CASES.get(case, case), 6))
        for kind, text in KINDS:
            row = (
                p.text(text)
                + scaled(_stat(c, f"{case}.{kind}.x.rms_m"), NM)
                + scaled(_stat(c, f"{case}.{kind}.y.rms_m"), NM)
            )
            for axis in "xy":
                row += scaled(Stat("", None), 1.0) if kind == "six" else _ratio(c, f"{case}.ratio.{kind}.{axis}")
            missing = c.summary.get(f"{case}.{kind}.unfinished")
            rows.append(row + p.plain(None if missing is None else int(missing)))
        tr = c.traces(case)
        if {"six.track", "kin.track"} <= tr.keys():
            text = f"First run, {CASES.get(case, case)}: tanker and receiver from above, 6-DOF (full) and kinematic (dashed)."
            out += cases.pictures.add(f"six_{case}", tracks(tr), text)
    head = [
        ("flown by", ""),
        *((h, "num") for h in ("x RMS [NM]", "y RMS [NM]", "6-DOF over it, x", "y", "unfinished")),
    ]
    runs = sum(c.runs(x) for x in c.cases)
    return out + p.table(head, rows, f"{runs} runs on record. Small: 95 % confidence interval.")


def _ratio(c: Campaign, key: str) -> str:
    v = finite(c.summary.get(key))
    return p.blank() if v is None else scaled(Stat(key, float(v)), 1.0, digits=2)


def other(c: Campaign) -> str:
    """Any other campaign: every number of its summary, folded away."""
    rows = [
        p.text(k) + f'<td class="num" data-key="{escape(k, quote=True)}" data-value="{v!r}">{p.number(v)}</td>'
        for k, v in sorted(c.summary.items())
        if isinstance(v, (int, float)) and not isinstance(v, bool)
    ]
    body = p.details(f"All {len(rows)} figures", p.table([("summary key", ""), ("value", "num")], rows))
    return p.paragraph(str(c.meta.get("purpose", ""))) + body
