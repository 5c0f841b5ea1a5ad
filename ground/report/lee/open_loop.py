"""Chapters on wind estimates: the table cases of the tanker, and sweeps of a parameter."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from html import escape

from ground.report import figures as f
from ground.report import page as p
from ground.report.chapters import Keeper, everything
from ground.report.lee import page as lee
from ground.report.lee import states, track
from ground.report.load import Campaign

MAGNITUDE, DIRECTION = "wind.magnitude_rms_pct", "wind.direction_rms_deg"
AXES = "ned"
SHOWN_PLOT = ("default", "printed")  # more than two filters in one time history cannot be read


def label(actor: str) -> str:
    """Name of a filter or controller for the reader; variants of a sweep follow in brackets."""
    base, _, variant = actor.partition(" ")
    return lee.LABELS.get(base, base.replace("_", " ")) + (f" ({variant.replace('_', ' ')})" if variant else "")


def labels(actors: Iterable[str]) -> dict[str, str]:
    """Label of each actor."""
    return {a: label(a) for a in actors}


def case_label(case: str) -> str:
    """Name of a case for the reader."""
    return lee.CASE_LABELS.get(case, case.replace("_", " "))


def _claims(c: Campaign) -> dict[str, lee.Claim]:
    known = {k: v for k, v in lee.TANKER.items() if k in c.cases}
    return known | {k: lee.Claim(case_label(k), "", "") for k in c.cases if k not in known}


def _met(c: Campaign, case: str, claim: lee.Claim) -> list[bool]:
    pairs = [(c.stat(case, f"default.{MAGNITUDE}"), claim.target_pct)]
    pairs.append((c.stat(case, f"default.{DIRECTION}"), claim.target_deg))
    return [s.value is not None and s.value <= t for s, t in pairs if t is not None and (s.value is not None or s.why)]


def targets(c: Campaign) -> tuple[int, int]:
    """How many accuracy targets of the tanker cases the default filter meets, and of how many; lost in all runs: not met."""
    met = [m for case, claim in _claims(c).items() for m in _met(c, case, claim)]
    return sum(met), len(met)


def wins(c: Campaign) -> tuple[int, int]:
    """In how many cases the default has the smaller RMS error of magnitude than the printed method, and of how many."""
    pairs = [(c.stat(x, f"default.{MAGNITUDE}").value, c.stat(x, f"printed.{MAGNITUDE}").value) for x in c.cases]
    good = [(a, b) for a, b in pairs if a is not None and b is not None]
    return sum(a < b for a, b in good), len(good)


def tanker(c: Campaign, pictures: Keeper) -> str:
    """The tanker cases: overview, accuracy, consistency, limit, all filters, trajectory, time histories."""
    claims = _claims(c)
    return (
        p.paragraph(str(c.meta.get("purpose", "")))
        + _overview(c, claims, pictures)
        + "<h3>Accuracy</h3>" + _accuracy(c, claims)
        + "<h3>Consistency, convergence and the limit</h3>" + _consistency(c, claims)
        + everything(c, label, case_label)
        + track.chapter(c, pictures)
        + _histories(c, claims, pictures)
        + states.chapter(c, pictures)
    )  # fmt: skip


def _overview(c: Campaign, claims: dict[str, lee.Claim], pictures: Keeper) -> str:
    out = ""
    for metric, unit in ((MAGNITUDE, "magnitude error, RMS [%]"), (DIRECTION, "direction error, RMS [deg]")):
        actors = [a for a in c.actors(metric) if a in ("default", "printed", "cmw")]
        if not actors:
            continue
        series = {}
        for a in actors:
            series[a] = [c.bar(case, f"{a}.{metric}") for case in claims]
        goals = [x.target_pct if metric == MAGNITUDE else x.target_deg for x in claims.values()]
        names = [x.label.replace(", ", ",\n") for x in claims.values()]
        png = f.bars(names, series, unit, labels(actors), goals)
        caption = (
            f"Wind {unit}, over all runs of a case with 95 % confidence intervals; dashed: what our default is held to."
        )
        out += pictures.add(f"tanker_{unit.split()[0]}", png, caption)
    return out


def _accuracy(c: Campaign, claims: dict[str, lee.Claim]) -> str:
    head = [("case", ""), ("printed claim", ""), ("error", ""), ("as printed", "num"), ("our default", "num")]
    head += [(h, "num") for h in ("target", "printed / default", "95th pct", "runs")]
    rows = []
    for case, claim in claims.items():
        failed = f'<small class="bad">{c.failed(case)} failed</small>' if c.failed(case) else ""
        first = f'<td rowspan="2"><b>{escape(claim.label)}</b><small>{escape(claim.what)}</small></td>'
        first += f'<td class="claim" rowspan="2">{escape(claim.printed)}</td>'
        runs = f'<td class="num" rowspan="2">{c.runs(case)}{failed}</td>'
        magnitude = p.text("magnitude [%]", "name") + _line(c, case, MAGNITUDE, claim.target_pct)
        direction = p.text("direction [deg]", "name") + _line(c, case, DIRECTION, claim.target_deg)
        rows += [first + magnitude + runs, direction]
    return p.table(
        head,
        rows,
        "95th pct: of the default's error, the figure to hold against the source's claims, which are bounds read off its "
        "figures; its direction claims are in per cent of an angle it does not name.",
    )


def _line(c: Campaign, case: str, metric: str, goal: float | None) -> str:
    ours = c.stat(case, f"default.{metric}")
    css = "" if goal is None or ours.value is None else "good" if ours.value <= goal else "bad"
    verdict = {"": "", "good": "met", "bad": "not met"}[css]
    row = p.cell(c.stat(case, f"printed.{metric}")) + p.cell(ours, css) + p.plain(goal, css, below=verdict)
    return row + _ratio(c, case, metric) + p.cell(c.stat(case, f"default.{metric.replace('_rms_', '_p95_')}"))


def _ratio(c: Campaign, case: str, metric: str) -> str:
    a, b = f"default.{metric}", f"printed.{metric}"
    ours, printed = c.stat(case, a).value, c.stat(case, b).value
    if not ours or printed is None:
        return p.blank()
    better, of = c.better(case, a, b)
    return p.plain(printed / ours, "good" if printed > ours else "bad", below=f"better in {better} of {of}")


def _consistency(c: Campaign, claims: dict[str, lee.Claim]) -> str:
    head = [("case and filter", ""), ("inside 3 sigma [%]", "num"), ("NEES", "num"), ("NEES in band [%]", "num")]
    head += [(f"RMS / bound {x.upper()}", "num") for x in AXES] + [(f"converged {x.upper()} [s]", "num") for x in AXES]
    rows = []
    for case, claim in claims.items():
        rows.append(p.group(f"{claim.label}{': ' + claim.what if claim.what else ''}", len(head)))
        for a in [a for a in c.actors(MAGNITUDE, [case]) if a in ("default", "printed")]:
            inside = c.stat(case, f"{a}.wind.inside_3sigma_pct")
            css = "" if inside.value is None else "good" if inside.value >= lee.TARGET_INSIDE_PCT else "bad"
            row = p.text(label(a), "name") + p.cell(inside, css)
            row += p.cell(c.stat(case, f"{a}.nees.mean")) + p.cell(c.stat(case, f"{a}.nees.inside_pct"))
            bounded = case in lee.BOUNDED
            row += "".join(_against(c, case, f"{a}.pcrb_ratio.{x}", lee.TARGET_PCRB if bounded else None) for x in AXES)
            limit = None if "coloured" in case else lee.TARGET_CONVERGENCE_S
            rows.append(row + "".join(_against(c, case, f"{a}.wind.convergence_s.{x}", limit) for x in AXES))
        if any(v is not None for v in claim.convergence):
            times = "".join(p.plain(v) for v in claim.convergence)
            rows.append(p.text("printed claim", "name soft") + p.blank() * 6 + times)
    return p.table(
        head,
        rows,
        f"Aims for the default: inside 3 sigma at least {lee.TARGET_INSIDE_PCT:.0f} %, RMS / Cramer-Rao bound at most "
        f"{lee.TARGET_PCRB} in cases I to III, convergence within {lee.TARGET_CONVERGENCE_S:.0f} s in white noise.",
    )


def _against(c: Campaign, case: str, value: str, limit: float | None) -> str:
    stat = c.stat(case, value)
    bad = limit is not None and value.startswith("default.") and stat.value is not None and stat.value > limit
    return p.cell(stat, "bad" if bad else "")


def _histories(c: Campaign, claims: dict[str, lee.Claim], pictures: Keeper) -> str:
    out = ""
    for case, claim in claims.items():
        tr = c.traces(case)
        actors = [a for a in SHOWN_PLOT if f"{a}.wind" in tr] or [k[:-5] for k in sorted(tr) if k.endswith(".wind")][:2]
        if not actors or not {"t", "wind_true"} <= tr.keys():
            continue
        what = f"Case {claim.label}{': ' + claim.what if claim.what else ''}. First run."
        name = re.sub(r"[^A-Za-z0-9_.-]", "_", case)
        out += f"<h3>Case {escape(claim.label)}</h3>"
        text = f"{what} Wind components; band and dashes are each filter's own 3-sigma bounds."
        out += pictures.add(f"{name}_wind", f.wind_components(tr, actors, labels(actors)), text)
        png = f.errors_over_time(tr, actors, labels(actors), claim.magnitude_pct)
        out += pictures.add(f"{name}_errors", png, f"{what} Errors of wind magnitude and direction over time.")
    return out


def sweep(c: Campaign, pictures: Keeper) -> str:
    """Wind errors against the swept parameter, or per case where nothing is swept; empty without wind values."""
    actors = c.actors(MAGNITUDE)
    if not actors:
        return ""
    known = lee.STUDIES.get(c.study)
    swept = c.swept(known.params if known else ())
    metrics = [(MAGNITUDE, "magnitude error, RMS [%]"), (DIRECTION, "direction error, RMS [deg]")]
    xlabel = known.xlabel if known else "swept parameter"
    if len({x for x, _ in swept.values()}) >= 3:
        panels = [(title, points(c, swept, metric)) for metric, title in metrics]
        names = {n for _, series in panels for n in series}
        picture = f.sweep(panels, xlabel, labels(names))
    else:
        series = {a: [c.bar(x, f"{a}.{MAGNITUDE}") for x in c.cases] for a in actors}
        picture = f.bars([case_label(x) for x in c.cases], series, metrics[0][1], labels(actors))
    out = "<h3>Wind estimate</h3>" + pictures.add(
        f"{c.study}_wind", picture, "Wind error over the runs, with 95 % confidence intervals."
    )
    head = [("case", ""), ("error", ""), *((label(a), "num") for a in actors)]
    rows = [
        p.text(case_label(x), "name")
        + p.text(t.replace(" error, RMS", ""), "name")
        + "".join(p.cell(c.stat(x, f"{a}.{m}")) for a in actors)
        for x in c.cases
        for m, t in metrics
    ]
    return out + p.table(head, rows)


def points(c: Campaign, swept: dict[str, tuple[float, str]], metric: str) -> dict[str, list[f.Point]]:
    """Sweep series of a metric: one per filter or controller and variant of the cases; NaN where all runs were lost."""
    out: dict[str, list[f.Point]] = {}
    for actor in c.actors(metric):
        for case, (x, variant) in swept.items():
            s = c.stat(case, f"{actor}.{metric}")
            lost = c.stat(case, f"{actor}.lost").value or c.stat(case, f"{actor}.contact.lost").value or 0.0
            if s.value is None and not s.why:
                continue
            name = f"{actor} {variant}" if variant else actor
            out.setdefault(name, []).append(f.Point(x, math.nan if s.value is None else s.value, s.lo, s.hi, lost))
    return out
