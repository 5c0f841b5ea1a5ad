"""Chapter of the rendezvous report on the filters: consistency over time, sampling, bias, observability."""

from __future__ import annotations

from scipy.stats import chi2

from ground.report import page as p
from ground.report.cases import CaseOf, Cases
from ground.report.figures import Point
from ground.report.rivard import figures as f
from ground.report.rivard import page as d
from ground.report.rivard.cells import number, point, scaled, times


def filters(cases: Cases) -> str:
    """Consistency over time, sampling, bias, observability."""
    series: dict[str, list[Point]] = {}
    least = 0
    for name, text in d.FILTERS.items():
        c = cases.named(name)
        if c is None:
            continue
        pts = [point(cases, name, f"t{t:.0f}.nees3", t, 1.0) for t in times(c, "nees3")]
        good = [q for q in pts if q is not None]
        if good:
            series[text] = good
            n = c.stat(f"t{good[0].x:.0f}.nees3").n
            least = n if least == 0 else min(least, n)
    if not series:
        return ""
    lo, hi = (float(v) for v in chi2.ppf([0.025, 0.975], 3 * max(least, 1)) / (3 * max(least, 1)))
    text = (
        f"Normalised error squared of x, v_x, y over 3; 1 for a filter that knows its error. Dark: where 95 % of the "
        f"means of {least} independent rendezvous of a consistent filter lie."
    )
    out = cases.pictures.add("consistency", f.consistency(series, (lo, hi)), text)
    shown = {"source's filter": "filter", "Gaussian sum": "b7re"}
    parts = {text: _sigmas(cases.named(n)) for text, n in shown.items() if cases.named(n) is not None}
    if parts:
        out += cases.pictures.add(
            "sigmas", f.sigmas(parts), "Actual error and what the filter predicts, radar start at 30 NM."
        )
    return out + _filter_table(cases) + _claims(cases) + _observability(cases)


def _sigmas(c: CaseOf | None) -> dict[str, list[tuple[float, float, float]]]:
    out: dict[str, list[tuple[float, float, float]]] = {}
    if c is None:
        return out
    for key, unit, scale in (("x", "m", d.NM), ("vx", "mps", d.KN), ("y", "m", d.NM)):
        for t in times(c, f"{key}.sigma_{unit}"):
            a, b = (number(c, f"t{t:.0f}.{key}.{what}_{unit}") for what in ("sigma", "predicted"))
            if a is not None and b is not None:
                out.setdefault(key, []).append((t, a / scale, b / scale))
    return out


def _filter_table(cases: Cases) -> str:
    c = cases.named("filter")
    if c is None:
        return ""
    rows = []
    for t in (20, 60, 120, 160, 180):
        k = f"t{t}"
        row = p.text(f"{t} s")
        for key, unit, scale in (("x", "m", d.NM), ("vx", "mps", d.KN), ("y", "m", d.NM)):
            row += scaled(c.stat(f"{k}.{key}.sigma_{unit}"), scale) + scaled(
                c.stat(f"{k}.{key}.predicted_{unit}"), scale
            )
        rows.append(row + scaled(c.stat(f"{k}.nees3"), 1.0, digits=2))
    head = ["x [NM]", "predicted", "v_x [kn]", "predicted", "y [NM]", "predicted", "NEES/3"]
    note = "The source's filter beside a turn flown on the true state (10 s between ranges)."
    return "<h3>The source's filter</h3>" + p.table([("time", ""), *((h, "num") for h in head)], rows, note)


BIAS = (("bias", "filter"), ("none", "filter_no_bias"))
TEN, TWO = ("10 s", "filter"), ("2 s", "filter_2s")
LOOPS = (("10 s", "k3_a"), ("2 s", "loop_2s"))
FAR = (("source's filter", "unaided_seed"), ("Gaussian sum", "unaided_best"))
CLAIMS = (
    ("2 s between ranges are no better: sigma of y at 80 s [NM]", (TEN, TWO), "t80.y.sigma_m"),
    ("... NEES/3 at 180 s is worse (the constant bias is taken as white)", (TEN, TWO), "t180.nees3"),
    ("... closed loop k = 3, x RMS [NM]", LOOPS, "x.rms_m"),
    ("... closed loop k = 3, y RMS [NM]", LOOPS, "y.rms_m"),
    ("Without bias the filter is the same: sigma of y at 80 s [NM]", BIAS, "t80.y.sigma_m"),
    ("R as printed (0.101 NM2): NEES/3 at 80 s", (("0.0103", "filter"), ("0.101", "filter_r_printed")), "t80.nees3"),
    ("100 NM unaided, error of y at 310 s is about 4 NM: sigma [NM]", FAR, "t310.y.sigma_m"),
    ("... and what the filter says [NM]", FAR, "t310.y.predicted_m"),
)  # fmt: skip


def _claims(cases: Cases) -> str:
    rows = []
    for text, both, value in CLAIMS:
        row = p.text(text)
        for name, case in both:
            c = cases.named(case)
            cell = p.blank() if c is None else scaled(c.stat(value), d.NM if value.endswith("_m") else 1.0)
            row += p.text(name) + cell
        rows.append(row)
    head = [("statement of the source", ""), ("", ""), ("", "num"), ("", ""), ("", "num")]
    return "<h3>Sampling, bias, no radar</h3>" + p.table(head, rows)


def _observability(cases: Cases) -> str:
    rows = []
    for name, text, t in (
        ("seven_unaided", "seven states, 100 NM unaided", 480),
        ("eight_30", "eight states, 30 NM", 180),
    ):
        c = cases.named(name)
        if c is None:
            continue
        cells = "".join(scaled(c.stat(f"state.t{t}.{s}.ratio"), 1.0) for s, _ in d.STATES)
        rows.append(p.text(f"{text}, at {t} s") + cells)
        cells = "".join(scaled(c.stat(f"state.t{t}.{s}.predicted_ratio"), 1.0) for s, _ in d.STATES)
        rows.append(p.text("as the filter believes") + cells)
    if not rows:
        return ""
    head = [("filter", ""), *((h, "num") for _, h in d.STATES)]
    note = "Error over the error before any range: 1 means the ranges say nothing about the state."
    return "<h3>What the ranges say about the other states</h3>" + p.table(head, rows, note)
