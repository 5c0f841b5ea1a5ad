"""Chapters of the rendezvous report: the printed tables, the gain, the improvements."""

from __future__ import annotations

from ground.report import page as p
from ground.report.cases import CaseOf, Cases
from ground.report.figures import Point
from ground.report.rivard import figures as f
from ground.report.rivard import page as d
from ground.report.rivard.cells import average, count, nm, number, percent, point, words

STATS = ("mean", "sigma", "rms")


def summary(cases: Cases) -> str:
    """Printed, reproduced, improved: RMS of both axes in one table."""
    rows = []
    for text, name in d.SUMMARY:
        c = cases.named(name)
        if c is None:
            continue
        printed = _printed(c)
        row = p.text(text) + p.plain(printed[2]) + nm(c, "x.rms_m") + p.plain(printed[5]) + nm(c, "y.rms_m")
        rows.append(
            row + nm(c, "x.p95_m") + nm(c, "y.p95_m") + percent(c, "unfinished") + percent(c, "outside") + count(c)
        )
    head = ["x RMS printed", "x RMS ours", "y RMS printed", "y RMS ours", "95 % of |x|", "95 % of |y|", "unfinished %",
            "outside 1 x 0.5 NM %", "rendezvous"]  # fmt: skip
    note = "NM. Printed figures are of 30 runs. Small: 95 % confidence interval."
    return p.table([("method", ""), *((h, "num") for h in head)], rows, note) if rows else ""


def _printed(c: CaseOf) -> tuple[float | None, ...]:
    return tuple(c.params.get("printed_nm") or (None,) * 6)


def _band(c: CaseOf | None, axis: str, stat: str) -> str:
    lo, hi = (average(c, f"{axis}.table30.{stat}_{e}_m") for e in ("lo", "hi"))
    if lo is None or hi is None or c is None:
        return p.blank()
    value = _printed(c)[STATS.index(stat) + (3 if axis == "y" else 0)]
    below = average(c, f"{axis}.table30.{stat}_below")
    inside = value is None or lo <= value * d.NM <= hi
    css = "" if value is None else "good" if inside else "bad"
    return words(f"{lo / d.NM:.2f} … {hi / d.NM:.2f}", css, "" if below is None else f"{100 * below:.1f} % below print")


def _table(cases: Cases, rows: tuple[tuple[str, str, str], ...], axis: str) -> str:
    out = []
    sign = -1.0 if axis == "y" else 1.0
    for text, a, b in rows:
        first = cases.named(a)
        if first is None:
            continue
        second = cases.named(b) if b else None
        printed = _printed(first)[3:] if axis == "y" else _printed(first)[:3]
        for i, stat in enumerate(STATS):
            if printed[i] is None:
                continue
            key = f"{axis}.{stat}_m"
            turn = sign if stat == "mean" else 1.0
            row = p.text(text if i == 0 or printed[0] is None else "") + p.text("RMS" if stat == "rms" else stat)
            row += p.plain(printed[i]) + nm(first, key, turn) + _band(first, axis, stat)
            out.append(row + nm(second, key, turn) + _band(second, axis, stat))
    head = [("row", ""), ("", ""), ("printed", "num"), ("ours, rule A", "num"), ("95 % of tables of 30, A", "num"),
            ("ours, rule B", "num"), ("95 % of tables of 30, B", "num")]  # fmt: skip
    return p.table(head, out) if out else ""


RULES = (
    "Rule A: the turn starts when the time to go is zero. Rule B: at the last ten-second update before. The text says "
    "A; of the two only B puts the cross-track mean where it was printed (0.89) and the miss with known state (0.17). "
    "Green: the print lies where 95 % of tables of 30 of our rendezvous fall; red: outside it."
)
SCATTER = (
    "Misses at roll-out of the first batch, with our and the printed mean and one-sigma ellipse. Shaded: sigmas that "
    "95 % of tables of thirty would show; dashed box: their means."
)
GUARD = (
    "The source prints a blow-up of the miss at large gains. It is not the law: a commanded radius that turns "
    "negative went through the arc tangent as a bank away from the receiver. With the guard (a radius below the least "
    "one is full bank) a larger gain trades x for y; without it our rendezvous blow up as well."
)


def tables(cases: Cases) -> str:
    """Tables 1 and 2 and the scatter of misses."""
    out = ""
    for title, rows in (("Table 1", d.TABLE1), ("Table 2: 2 NM wider, turn 5 s early", d.TABLE2)):
        for axis, name in (
            ("x", "x, along track: positive when the tanker is too far ahead"),
            ("y", "y, across track"),
        ):
            body = _table(cases, rows, axis)
            if body:
                out += f"<h3>{title}, {name} [NM]</h3>" + body
    if not out:
        return ""
    out += p.paragraph(RULES, "note")
    panels = [_cloud(cases, n, t) for n, t in CLOUDS]
    have = [c for c in panels if c is not None]
    if have:
        out += cases.pictures.add("scatter", f.clouds(have), SCATTER)
    return out


CLOUDS = (
    ("open", "present method, Table 1"), ("cross_b", "cross-track, rule B"), ("k2_b", "k = 2, rule B"),
    ("k3_b", "k = 3, rule B"), ("t2_open", "present method, Table 2"), ("t2_cross", "cross-track, Table 2"),
    ("t2_k3", "k = 3, Table 2"), ("b7re", "improved, same sensor"),
)  # fmt: skip


def _cloud(cases: Cases, name: str, title: str) -> f.Cloud | None:
    c = cases.named(name)
    miss = None if c is None else c.traces().get("miss_m")
    if c is None or miss is None:
        return None
    miss = miss / d.NM * [1.0, -1.0]

    def of(key: str) -> float:
        return (number(c, key) or 0.0) / d.NM

    def band(stat: str) -> tuple[tuple[float, float], tuple[float, float]]:
        x, y = ((of(f"{a}.table30.{stat}_lo_m"), of(f"{a}.table30.{stat}_hi_m")) for a in "xy")
        return x, y

    pr = _printed(c)
    known = pr[0] is not None and pr[1] is not None and pr[3] is not None and pr[4] is not None
    have = number(c, "x.table30.mean_lo_m") is not None
    return f.Cloud(
        title, miss, (of("x.mean_m"), -of("y.mean_m")), (of("x.sigma_m"), of("y.sigma_m")),
        (pr[0], pr[1], pr[3], pr[4]) if known else None,  # type: ignore[arg-type]
        band("mean") if have else None, band("sigma") if have else None,
    )  # fmt: skip


def gain(cases: Cases) -> str:
    """RMS against the gain with and without the guard."""
    series: dict[str, dict[str, list[Point]]] = {"guarded": {}, "without guard": {}}
    rows = []
    for c in cases.kind("gain"):
        free = c.name.startswith("gain_printed")
        for axis in "xy":
            pt = point(cases, c.name, f"{axis}.rms_m", float(c.params["gain"]))
            if pt is not None:
                series["without guard" if free else "guarded"].setdefault(axis, []).append(pt)
        text = f"k = {c.params['gain']}, " + ("no guard, rule B" if free else "guarded, rule A")
        rows.append(p.text(text) + nm(c, "x.rms_m") + nm(c, "y.rms_m") + percent(c, "unfinished") + count(c))
    if not rows:
        return ""
    series["printed (30 runs)"] = {
        axis: [Point(k, v[i]) for k, v in d.PRINTED_GAIN.items()] for i, axis in enumerate("xy")
    }
    out = p.paragraph(GUARD)
    out += cases.pictures.add("gain", f.gains(series), "RMS miss against the gain k of the closed loop.")
    head = [("case", ""), ("x RMS [NM]", "num"), ("y RMS [NM]", "num"), ("unfinished %", "num"), ("rendezvous", "num")]
    return out + p.table(head, rows)


def steps(cases: Cases) -> str:
    """The same sensor, one improvement after the other; unaided; one rendezvous from above."""
    out = ""
    for title, rows in (("Radar start at 30 NM", d.STEPS), ("No radar, or a far one", d.UNAIDED)):
        body = []
        for name, text in rows:
            c = cases.named(name)
            if c is not None:
                row = (
                    p.text(text)
                    + nm(c, "x.mean_m")
                    + nm(c, "x.rms_m")
                    + nm(c, "y.rms_m")
                    + nm(c, "x.p95_m")
                    + nm(c, "y.p95_m")
                )
                body.append(row + percent(c, "outside") + percent(c, "alarm.any") + count(c))
        head = ["x mean", "x RMS", "y RMS", "95 % of |x|", "95 % of |y|", "outside %", "false warning %", "rendezvous"]
        if body:
            out += f"<h3>{title} [NM]</h3>" + p.table([("", ""), *((h, "num") for h in head)], body)
    for name, title in (("b7re", "radar start at 30 NM"), ("unaided_best", "no radar, from 100 NM")):
        c = cases.named(name)
        tr = {} if c is None else c.traces()
        if "track" in tr:
            x, y = tr["miss"] / d.NM
            text = f"One rendezvous from above, {title}: rolls out {x:+.2f} NM in x and {y:+.2f} NM in y from where it should."
            out += cases.pictures.add(f"plan_{name}", f.plan_view(tr, title), text)
    return out
