"""Chapters of the rendezvous report on other sensors, a world unlike the model, and the cases the source left open."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ground.report import figures as f
from ground.report import page as p
from ground.report.cases import CaseOf, Cases
from ground.report.figures import Bar, Point
from ground.report.rivard import figures as rf
from ground.report.rivard import page as d
from ground.report.rivard.cells import count, nm, percent, point, scaled

PRODUCT, SEED = "as shipped", "k = 3 law"


def sensors(cases: Cases) -> str:
    """What a bearing or a data link would add."""
    rows = [(c, t, k) for c, t, k in d.SENSORS if cases.named(c) is not None]
    if not rows:
        return ""
    out = ""
    for axis in "xy":
        series: dict[str, list[Bar]] = {PRODUCT: [], SEED: []}
        for name, _, other in rows:
            for key, case in ((PRODUCT, name), (SEED, other)):
                q = point(cases, case, f"{axis}.rms_m", 0.0)
                lost = q is not None and math.isnan(q.y)
                series[key].append(None if q is None else f.ALL_LOST if lost else (q.y, q.lo, q.hi))
        png = f.bars([t for _, t, _ in rows], series, f"RMS of {axis} [NM]", {})
        out += cases.pictures.add(f"sensors_{axis}", png, f"RMS miss in {axis} by sensor, with 95 % intervals.")
    body = []
    for name, text, other in rows:
        a, b = cases.named(name), cases.named(other)
        row = p.text(text) + nm(a, "x.rms_m") + nm(a, "y.rms_m") + nm(a, "x.p95_m") + nm(a, "y.p95_m") + count(a)
        body.append(row + nm(b, "x.rms_m") + nm(b, "y.rms_m"))
    head = ["x RMS", "y RMS", "95 % of |x|", "95 % of |y|", "rendezvous", "x RMS, k = 3 law", "y RMS, k = 3 law"]
    note = "NM. With more than range: eight-state filter with Gauss-Hermite update. The k = 3 law rolls at once."
    return out + p.table([("sensor", ""), *((h, "num") for h in head)], body, note)


def _pairs(cases: Cases, kind: str) -> list[tuple[str, CaseOf | None, CaseOf | None]]:
    """(name, seed's case, ours) of a kind, in the study's order."""
    names = list(dict.fromkeys(c.name.removesuffix("_seed") for c in cases.kind(kind)))
    return [(n, cases.named(f"{n}_seed"), cases.named(n)) for n in names if not n.endswith("_open")]


def _both(cases: Cases, kind: str, warn: bool) -> str:
    body = []
    ref = ("nominal", cases.named("k3_a"), cases.named("b7re"))
    pairs = _pairs(cases, kind)
    if not pairs:
        return ""
    for name, seed, ours in [ref, *pairs]:
        row = p.text(d.label(name))
        for c in (seed, ours):
            row += nm(c, "x.rms_m") + nm(c, "y.rms_m") + percent(c, "outside") + percent(c, "unfinished")
            row += percent(c, "alarm.any") if warn else ""
        body.append(row + count(seed) + count(ours))
    each = ["x RMS", "y RMS", "outside %", "unfinished %", *(["warned %"] if warn else [])]
    head = [f"{h}, source" for h in each] + [f"{h}, ours" for h in each] + ["n, source", "n, ours"]
    note = (
        "RMS in NM. Outside: not finished, or beyond 1 NM in x or 0.5 NM in y at roll-out. Source: its filter, k = 3."
    )
    return p.table([("", ""), *((h, "num") for h in head)], body, note)


def mismatch(cases: Cases) -> str:
    """The world's sigmas larger than the filters believe."""
    body = _both(cases, "mismatch", True)
    return body and p.paragraph("The truth is changed, the onboard parameters are not.") + body


def wind(cases: Cases) -> str:
    """Known wind, the same for both aircraft."""
    body = _both(cases, "wind", False)
    rows = []
    for kn in (30, 60):
        c = cases.named(f"crosswind_{kn}_open")
        if c is not None:
            rows.append(p.text(f"crosswind {kn} kn") + nm(c, "x.rms_m") + nm(c, "y.rms_m") + count(c))
    if rows:
        head = [("chart without correction", ""), ("x RMS [NM]", "num"), ("y RMS [NM]", "num"), ("rendezvous", "num")]
        body += "<h3>Present method</h3>" + p.table(head, rows)
    return body and p.paragraph("Offset in crosswind from the source's equation 55 at 25.46 deg of bank.") + body


LATE = (
    "A lost range is a missing update. A late range that carries its time of validity is fused at that time with the "
    "tanker's own position of then; without a stamp it is taken as new. Tanker errors are constant in a rendezvous "
    "and normal over rendezvous; wind errors likewise, per axis."
)


def undone(cases: Cases) -> str:
    """Lost and late ranges, wind and tanker unlike what the software believes."""
    body = _both(cases, "undone", True)
    if not body:
        return ""
    return p.paragraph(LATE) + body


def _series(cases: Cases, names: Sequence[tuple[float, str]], tail: str) -> list[Point]:
    out = [point(cases, f"{n}{tail}", "alarm.any", x, 1.0) for x, n in names]
    zero = point(cases, "k3_a" if tail else "b7re", "alarm.any", 0.0, 1.0)
    return [q for q in (zero, *out) if q is not None]


def manoeuvres(cases: Cases) -> str:
    """A receiver that turns or changes speed: what becomes of the rendezvous, and whether the crew is warned."""
    pairs = _pairs(cases, "manoeuvre")
    if not pairs:
        return ""
    turns: list[tuple[float, str]] = []
    speeds: list[tuple[float, str]] = []
    for name, _, _ in pairs:
        kind, _, tail = name.partition("_")
        if tail.lstrip("-").isdigit():
            size = float(tail)
            (turns if kind == "turn" else speeds).append((-size if kind == "slower" else size, name))
    panels = []
    for title, names, xlabel in (("turn at 60 s", turns, "heading change [deg], left positive"),
                                 ("change of speed from 60 s", speeds, "change of airspeed [kn]")):  # fmt: skip
        both = {"source's filter": _series(cases, names, "_seed"), "Gaussian sum": _series(cases, names, "")}
        panels.append((title, both, xlabel))
    text = (
        "Share of rendezvous in which the innovation test (mean square and drift of the last six normalised innovations) warned "
        "before roll-out; zero is a receiver that flies as planned."
    )
    out = cases.pictures.add("detection", rf.detection(panels), text)
    body = []
    for name, seed, ours in pairs:
        row = p.text(d.label(name))
        for c in (seed, ours):
            row += nm(c, "x.rms_m") + nm(c, "y.rms_m") + percent(c, "outside")
            row += percent(c, "alarm.late") + percent(c, "alarm.early")
            row += p.blank() if c is None else scaled(c.stat("alarm.delay_s"), 1.0, digits=0)
        body.append(row)
    each = ["x RMS", "y RMS", "outside %", "warned %", "before it %", "delay s"]
    head = [f"{h}, source" for h in each] + [f"{h}, ours" for h in each]
    note = (
        "RMS in NM. Warned: first warning at or after the manoeuvre; before it: a false one. Delay: median from the manoeuvre's "
        "start, mean over batches."
    )
    return out + p.table([("the receiver", ""), *((h, "num") for h in head)], body, note)
