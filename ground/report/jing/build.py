"""The windshear report: acceptance figures, the filters, 10 % wrong lift and drag, escape laws, survival, alerts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ground.report import figures, prints
from ground.report import page as p
from ground.report.build import Pictures, load_all, provenance, warnings, write_page
from ground.report.chapters import everything
from ground.report.goals import Found, judged
from ground.report.jing import figures as f
from ground.report.jing import page as jing
from ground.report.jing import sensors
from ground.report.load import Campaign

PAGE = "jing.html"


def jing_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/jing.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    found = load_all(folders, jing.ORDER)
    return write_page(out, PAGE, lambda: _text(found, Pictures(out)))


def _text(found: Found, pictures: Pictures) -> str:
    table, cards = judged(found, (*jing.GOALS, *sensors.GOALS))
    chapters = [
        ("acceptance", "Acceptance figures", table),
        (
            "nominal",
            "Exact model: which filter?",
            _filters(found.get(jing.NOMINAL), pictures, "ekf15") + _over_range(found, pictures),
        ),
        (
            "error",
            "Lift and drag 10 % wrong",
            _filters(found.get(jing.ERROR), pictures, "ukf13_printed_noise", "ekf15"),
        ),
        ("escape", "Escape laws in the named microbursts", _escape(found.get(jing.ESCAPE), pictures)),
        ("survival", "Survival over drawn microbursts", _survival(found.get(jing.SURVIVAL), pictures)),
        ("alerts", "Cautions and aborts in turbulence", _alerts(found.get(jing.ALERTS))),
        ("sensors", "Sensors as they are", sensors.chapter(found.get(jing.SENSORS))),
        ("prints", "The print line by line", prints.chapter("jing", found)),
    ]
    chapters = [c for c in chapters if c[2]]
    chapters.append(("figures", "All figures", "".join(p.details(s, everything(c)) for s, c in found.items())))
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance(list(found.values()))))
    body = cards + "".join(warnings(c) for c in found.values())
    body += "\n".join(p.section(*c) for c in chapters)
    return p.document(jing.TITLE, jing.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _filters(c: Campaign | None, pictures: Pictures, *drawn: str) -> str:
    """Every estimator in the loop: errors, consistency, flight path; reference figures below ours."""
    if c is None:
        return ""
    held = jing.HELD_OUT[c.study]
    rows = []
    for case in sorted(c.cases, key=lambda x: list(jing.LABELS).index(x) if x in jing.LABELS else 99):
        remedy = jing.REMEDY.get(case, "") if c.study == jing.ERROR else ""
        rows.append(
            p.text(jing.label(case), "name") + p.text(remedy) + "".join(p.cell(c.stat(case, v)) for v in jing.VALUES)
            + p.cell(c.stat(case, "height_min_m"))
        )  # fmt: skip
        if case in held:
            cells = "".join(p.blank() if v is None else p.plain(v) for v in held[case])
            rows.append(p.text("reference") + p.text("") + cells + p.blank())
    head = [
        ("estimator in the loop", ""),
        ("remedy", ""),
        *((h, "num") for h in jing.HEADS),
        ("least height [m]", "num"),
    ]
    out = p.paragraph(str(c.meta.get("purpose", ""))) + p.table(head, rows)
    for case in drawn:
        tr = c.traces(case)
        if "truth" in tr and "x" in tr:
            caption = f"{jing.label(case)}: first run. White path: truth; bands: 2 sigma."
            out += pictures.add(f"{c.study}_{case}", f.encounter(tr), caption.replace("White path", "Black"))
    return out


def _over_range(found: Found, pictures: Pictures) -> str:
    """The print's figures 2, 3, 6 and 8: flights laid over each other at the same range, first run of each."""
    exact, wrong = found.get(jing.NOMINAL), found.get(jing.ERROR)
    out, known = "", exact.traces("perfect") if exact is not None else {}
    for name, c, cases, text in (
        (
            "fig2",
            exact,
            ("ekf13", "ukf13", "ekf15"),
            "Figures 2 and 3 of the print, exact model; winds are those along each flight",
        ),
        ("fig6", wrong, ("ukf13",), "Figure 6, lift and drag 10 % wrong, no remedy"),
        ("fig8", wrong, ("ukf13_printed_noise", "ukf13_noise_accel_1", "ekf15"), "Figure 8, the same with remedies"),
    ):
        flights = {jing.label(x): c.traces(x) for x in cases} if c is not None else {}
        flights = {label: tr for label, tr in flights.items() if "truth" in tr}
        if flights and "truth" in known:
            png = f.over_range({"perfect state, exact model": known} | flights, winds=name == "fig2")
            out += pictures.add(f"range_{name}", png, f"{text}.")
    return out


def _escape(c: Campaign | None, pictures: Pictures) -> str:
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    columns = [(case, state) for case in c.cases for state in ("perfect", "ekf15")
               if any(v.endswith(f"{state}.height_min_m") and c.stat(case, v).value is not None for v in c.columns)]  # fmt: skip
    head = [("law", "")] + [
        (
            f"{case.replace('_pair_light', ', turbulence').replace('_', ' ')} m, {jing.label(state)}".replace(
                ", turbulence m", " m, turbulence"
            ),
            "num",
        )
        for case, state in columns
    ]
    rows = []
    for law, name in jing.LAWS.items():
        row = p.text(name, "name")
        for case, state in columns:
            lost, least = (c.stat(case, f"{law}.{state}.{k}") for k in ("lost", "height_min_m"))
            if lost.value is None:
                row += p.blank()
            elif lost.value >= 1.0:
                row += p.text("ground contact", "bad")
            else:
                share = f"{100.0 * lost.value:.0f} % lost" if lost.value > 0.0 else ""
                row += p.plain(least.value, "bad" if share else "good", " m", share)
        rows.append(row)
    out += p.table(
        head, rows, "Least height; mean over runs. Quick abort and still air, or the pair and light turbulence."
    )
    for case in c.cases:
        tr = c.traces(case)
        laws = [law for law in jing.LAWS if f"{law}.ekf15.truth" in tr]
        if laws and case.startswith("severe_350"):
            caption = f"{case.replace('_', ' ')}: height and airspeed over distance, first run, filter in the loop."
            out += pictures.add(f"escape_{case}", f.escapes(tr, laws, jing.LAWS), caption)
    return out


def _survival(c: Campaign | None, pictures: Pictures) -> str:
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    for case in c.cases:
        laws = [law for law in jing.LAWS if c.bar(case, f"{law}.survived") is not None]
        rows = []
        for law in laws:
            row = p.text(jing.LAWS[law], "name")
            for i, (of, _) in enumerate(jing.CLASSES):
                row += p.cell(c.stat(case, f"{law}.{of}survived"))
                row += p.plain(jing.SURVIVED[law][i]) if law in jing.SURVIVED else p.blank()
            close = c.stat(case, f"{law}.close")
            rows.append(row + (p.cell(close) if close.value is not None else p.blank()))
        counts = [c.stat(case, f"{laws[0]}.{of}survived").n for of, _ in jing.CLASSES] if laws else []
        head = [("escape law", "")]
        for (_, text), n in zip(jing.CLASSES, counts, strict=False):
            head += [(f"{text} ({n})", "num"), ("reference", "num")]
        head.append(("survived below 10 m", "num"))
        out += f"<h3>{jing.SURVIVAL_CASES.get(case, case)}</h3>" + p.table(head, rows, SHARES)
        series = {jing.LAWS[law]: [c.bar(case, f"{law}.{of}survived") for of, _ in jing.CLASSES] for law in laws}
        if series:
            png = figures.bars([t for _, t in jing.CLASSES], series, "share survived", {n: n for n in series})
            out += pictures.add(f"survival_{case}", png, "Share survived per class of peak F, Wilson intervals.")
    return out


def _alerts(c: Campaign | None) -> str:
    if c is None:
        return ""
    keys = (("approaches", None), ("aborted", "aborted"), ("cautioned", "cautioned"),
            ("share of time in caution", "caution_share"), ("quick F, largest", "quick_max"), ("slow F, largest", "slow_max"),
            ("abort at x [m]", "abort_x_m"), ("caution at x [m]", "caution_x_m"), ("w_x RMS [m/s]", "w_x.rms_mps"),
            ("w_h RMS [m/s]", "w_h.rms_mps"))  # fmt: skip
    rows = []
    for case in c.cases:
        air, sigma, *tag = case.split("_", 2)
        sigma = sigma.replace("p", ".")
        where = "no microburst" if air == "clear" else "the source's microburst"
        row = p.text(f"{where}, {sigma} m/s", "name") + p.text(ALERTING["".join(tag)])
        row += p.plain(float(c.runs(case))) + "".join(p.cell(c.stat(case, k)) for _, k in keys if k)
        rows.append(row)
    head = [("air", ""), ("alerting", ""), *((t, "num") for t, _ in keys)]
    return p.paragraph(str(c.meta.get("purpose", ""))) + p.table(head, rows, SHARES)


ALERTING = {
    "": "caution and abort pair",
    "quick": "quick abort, the source's filter",
    "default_quick": "quick abort, default filter",
    "source_pair": "pair, the source's filter",
}
SHARES = "Shares with 95 % Wilson intervals."
READING = """
Every number is that of the campaign's summary.json under the key shown in the cell: for RMS values the RMS over runs, else the
mean; the small line below is the 95 % confidence interval over runs. Run i has the same seed in every case of a study, and in the
survival study all laws fly on from the same flight up to the alert.

w_x is the wind along the flight (+ from behind), w_h the wind up; truth is the plant's at the aircraft. F is the hazard index by
the energy the wind costs. "Height apart" compares with the same encounter flown on perfect state feedback, at the same place.

Reference lines are figures computed once, before this program was written, with another implementation of the same equations
(jing.md); the source prints pictures and no tables. "Printed" remedies are fictitious process noise Q_f; "repaired" ones also
stop believing the accelerometers' model; "ours" have no use for an exact aerodynamic model or learn its scales.

Ground contact counts as loss. The managed laws go down to 35 or 45 m for speed: terrain clearance is left to the operator.
"Largest" height apart is the mean over runs of each run's largest: with the source's climb law it is made by the moment of the
abort, a tenth of a second either way.
"""
