"""The gust report: acceptance figures first, then the printed gain, flights, spectra, consistency, alleviation, adaptation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from ground.report import figures, prints
from ground.report import page as p
from ground.report.build import Pictures, load_all, provenance, warnings, write_page
from ground.report.chapters import everything
from ground.report.figures import Array
from ground.report.goals import Found, figure, judged
from ground.report.hoffmann import curves, found_goals
from ground.report.hoffmann import figures as f
from ground.report.hoffmann import page as hoffmann
from ground.report.hoffmann.found import sensors
from ground.report.hoffmann.loops import adaptation, alleviation, estimators, labels, robustness
from ground.report.hoffmann.page import label
from ground.report.load import Campaign

PAGE = "hoffmann.html"
# the print's figures of a case: states, errors, spectra
FIGURES = {"case1": ("Fig. 6. ", "Fig. 8.", "Fig. 9 and 10."), "case2": ("", "Fig. 12.", "Fig. 13 and 14.")}
UNITS = (("alpha_w", "alpha_W [deg]", "deg"), ("v_w", "V_W [m/s]", "mps"), ("bias", "bias [deg]", "deg"))


def hoffmann_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/hoffmann.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    found = load_all(folders, hoffmann.ORDER)
    return write_page(out, PAGE, lambda: _text(found, Pictures(out)))


def _text(found: Found, pictures: Pictures) -> str:
    table, cards = judged(found, (*hoffmann.GOALS, *found_goals.GOALS))
    chapters = [
        ("acceptance", "Acceptance figures", table),
        ("gains", "The printed gain", _gains(found.get("hoffmann_gains"), pictures)),
        ("cases", "Cases 1 and 2, and the nonlinear aircraft", _cases(found.get("hoffmann"), pictures)),
        ("spectra", "Spectra", _spectra(found.get("hoffmann_spectra"), pictures)),
        ("consistency", "Consistency", _consistency(found)),
        ("observability", "What can be observed", _observability(found.get("hoffmann_observability"))),
        ("alleviation", "Gust load alleviation", alleviation(found.get("hoffmann_alleviation"), pictures)),
        ("robustness", "On another aircraft than believed", robustness(found.get("hoffmann_robustness"))),
        ("sensors", "An aircraft that is not as believed", sensors(found.get("hoffmann_sensors"))),
        ("adaptation", "Turbulence that comes and goes", adaptation(found.get("hoffmann_adaptation"), pictures)),
        ("prints", "The print line by line", prints.chapter("hoffmann", found)),
    ]
    chapters = [c for c in chapters if c[2]]
    chapters.append(("figures", "All figures", "".join(p.details(s, everything(c)) for s, c in found.items())))
    chapters.append(("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))))
    chapters.append(("provenance", "Provenance", provenance(list(found.values()))))
    body = cards + "".join(warnings(c) for c in found.values())
    body += "\n".join(p.section(*c) for c in chapters)
    return p.document(hoffmann.TITLE, hoffmann.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _gains(c: Campaign | None, pictures: Pictures) -> str:
    if c is None:
        return ""
    head = [
        ("state", ""),
        *((f"{y}{what}", "num") for y in hoffmann.OUTPUTS for what in (", printed", ", computed", ", off")),
    ]
    rows = []
    for i, state in enumerate(hoffmann.STATES):
        row = p.text(state, "name")
        for j in range(len(hoffmann.OUTPUTS)):
            printed, ours = (c.stat("back_fitted", f"gain_{i + 1}_{j + 1}.{k}") for k in ("printed", "computed"))
            row += p.cell(printed) + p.cell(ours)
            if printed.value and ours.value is not None:
                off = 100.0 * (ours.value / printed.value - 1.0)
                rounded = (i, j) in hoffmann.ROUNDED
                row += p.plain(
                    off, "" if rounded else "good" if abs(off) <= 5.0 else "bad", " %", "rounded" if rounded else ""
                )
            else:
                row += p.blank()
        rows.append(row)
    out = p.paragraph(
        "The Riccati solution with the noise found from the gain itself, against the print: gain = + Sigma C' Theta^-1."
    )
    tr, other = c.traces("back_fitted"), c.traces("printed_noise")
    if {"K", "H_printed"} <= tr.keys() and "K" in other:
        png = f.gains(tr["K"], tr["H_printed"], other["K"])
        out += pictures.add("gains", png, "All 45 entries, row by row: computed over printed gain.")
    out += p.table(head, rows, "off: computed over printed less one; green within 5 %.")
    values = (("entries within 5 %", "within_5pct"), ("within 1 %", "within_1pct"), ("median deviation [%]", "median_pct"),
              ("negative gain within 5 %", "negative_sign_within_5pct"), ("covariances met, of 81", "sigma_entries_met"),
              ("sigma alpha_W [deg]", "sigma.alpha_w_deg"), ("sigma V_W [m/s]", "sigma.v_w_mps"),
              ("sigma bias [deg]", "sigma.bias_deg"), ("slowest pole [rad/s]", "slow_pole_1_radps"))  # fmt: skip
    rows = [p.text(text) + "".join(p.cell(c.stat(x, v)) for x in c.cases) for text, v in values]
    return out + p.table([("", ""), *((x.replace("_", " "), "num") for x in c.cases)], rows)


def _cases(c: Campaign | None, pictures: Pictures) -> str:
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    for case in c.cases:
        held = hoffmann.HELD_OUT.get(case, {})
        head, keys = [("estimator", "")], []
        for i, (what, name, unit) in enumerate(UNITS):
            for kind in ("rms", "mean", "std"):
                known = {a: r[i] for a, r in held.get(kind, {}).items() if r[i] is not None}
                keys.append((f"{what}.{kind}_{unit}", known))
                head += [(f"{name}: rms" if kind == "rms" else kind, "num")] + [("reference", "num")] * bool(known)
        rows = []
        for a in estimators(c, case, "alpha_w.rms_deg"):
            row = p.text(label(a), "name")
            for key, known in keys:
                row += p.cell(figure(c, case, f"{a}.{key}"), interval="rms" in key)
                if known:
                    row += p.plain(known[a]) if a in known else p.blank()
            if case == "nonlinear":
                row += p.cell(c.stat(case, f"{a}.nees_over_n")) + p.cell(c.stat(case, f"{a}.nis_over_m"))
            rows.append(row)
        if case == "nonlinear":
            head += [("NEES/9", "num"), ("NIS/m", "num")]
        out += f"<h3>{hoffmann.CASES.get(case, case)}</h3>" + p.table(head, rows, hoffmann.NOTES.get(case, ""))
        if case == "case2":
            out += _coherence(c, case)
        tr = c.traces(case)
        out += _as_printed(tr, case, pictures)
        shown = [a for a in ("printed", "discrete", "ekf") if f"{a}.x" in tr][-3:]
        if shown and "truth" in tr:
            out += pictures.add(
                f"flight_{case}", f.flight(tr, shown, labels(shown)), f"{hoffmann.CASES.get(case, case)}, first run."
            )
    return out


def _as_printed(tr: Mapping[str, Array], case: str, pictures: Pictures) -> str:
    """The print's own figures of cases 1 and 2: states, distributions of the errors, spectra."""
    if case not in FIGURES or not {"t", "y", "truth", "printed.x"} <= tr.keys():
        return ""
    shown = [a for a in ("printed", "discrete") if f"{a}.x" in tr]
    six, eight, nine = FIGURES[case]
    words = labels(shown)
    out = pictures.add(
        f"states_{case}",
        curves.states(tr, "printed", label("printed")),
        f"{six}Grey: measured, of alpha_K and V_K alpha and V_A. First run.",
    )
    out += pictures.add(
        f"errors_{case}", curves.distributions(tr, shown, words), f"{eight} Mean, deviation. First run."
    )
    return out + pictures.add(f"spectra_{case}", curves.spectra(tr, shown, words), f"{nine} First run.")


def _coherence(c: Campaign, case: str) -> str:
    """Coherence of estimate and truth where nearly all of the record has no turbulence to estimate."""
    records = (("alpha_w", "alpha_W"), ("alpha_w_ramp", "alpha_W, ramp included"), ("v_w", "V_W"))
    head = [("estimator", "")]
    for _, name in records:
        hz = [f"{x.replace('p', '.')} Hz" for x in hoffmann.RATIO_HZ]
        head += [(f"{name}: {hz[0]}", "num"), *((x, "num") for x in hz[1:])]
    rows = [
        p.text(label(a), "name")
        + "".join(
            p.cell(figure(c, case, f"{a}.{what}.coherence_{hz}hz")) for what, _ in records for hz in hoffmann.RATIO_HZ
        )
        for a in estimators(c, case, "alpha_w.rms_deg")
    ]
    return p.table(head, rows, hoffmann.NO_COHERENCE)


def _spectra(c: Campaign | None, pictures: Pictures) -> str:
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    panels = []
    for what, name in (("alpha_w", "alpha_W"), ("v_w", "V_W")):
        head = [("turbulence, estimator", "")]
        head += [
            (f"{k} {hz.replace('p', '.')} Hz", "num")
            for k in ("ratio", "phase [deg]", "coherence")
            for hz in hoffmann.RATIO_HZ
        ]
        rows = []
        points: dict[str, list[figures.Point]] = {}
        for case in c.cases:
            for a in estimators(c, case, "alpha_w.rms_deg"):
                row = p.text(f"{case.replace('_', ' ').replace('p', '.')}, {label(a)}", "name")
                for key in ("ratio_{}hz", "phase_{}hz_deg", "coherence_{}hz"):
                    row += "".join(p.cell(figure(c, case, f"{a}.{what}.{key.format(hz)}")) for hz in hoffmann.RATIO_HZ)
                rows.append(row)
                for hz in hoffmann.RATIO_HZ:
                    s = figure(c, case, f"{a}.{what}.ratio_{hz}hz")
                    if s.value is not None or s.why:
                        x, y = float(hz.replace("p", ".")), math.nan if s.value is None else s.value
                        points.setdefault(f"{a} {case}", []).append(figures.Point(x, y, s.lo, s.hi))
        out += f"<h3>{name}</h3>" + p.table(head, rows)
        panels.append((f"{name}: amplitude ratio", points))
    names = {n for _, series in panels for n in series}
    text = {n: f"{label(n.split(' ')[0])}, {n.split(' ')[1].replace('_', ' ').replace('p', '.')}" for n in names}
    png = figures.sweep(panels, "frequency [Hz]", text)
    return out + pictures.add("spectra", png, "Amplitude ratio of estimate and truth over frequency.")


def _consistency(found: Found) -> str:
    c = found.get("hoffmann_consistency")
    if c is None:
        return ""
    head = [("turbulence", ""), *((h, "num") for h in ("NEES/9", "before 12 s", "after", "NIS/5"))]
    keys = ("nees_over_n", "nees_over_n_early", "nees_over_n_late", "nis_over_m")
    rows = [
        p.text(x.replace("_", " ").replace("p", "."), "name") + "".join(p.cell(c.stat(x, k)) for k in keys)
        for x in c.cases
    ]
    return p.paragraph(str(c.meta.get("purpose", ""))) + p.table(
        head, rows, "1 is what a filter with the right noise has."
    )


def _observability(c: Campaign | None) -> str:
    if c is None:
        return ""
    sets = sorted({v.split(".")[0] for v in c.columns}, key=lambda s: (s.startswith("no_"), s))
    head = [
        ("outputs", ""),
        *(
            (h, "num")
            for h in ("rank", "least singular value", "rank in constant wind", "sigma alpha_W [deg]", "sigma V_W [m/s]")
        ),
    ]
    keys = ("rank", "least_singular", "constant_wind_rank", "sigma.alpha_w_deg", "sigma.v_w_mps")
    rows = [
        p.text(s.replace("_", " "), "name") + "".join(p.cell(c.stat(c.cases[0], f"{s}.{k}")) for k in keys)
        for s in sets
    ]
    note = (
        "ground and a_z: the five printed outputs with GNSS speed or vertical accelerometer; no ...: without that one."
    )
    return p.paragraph(str(c.meta.get("purpose", ""))) + p.table(head, rows, note)


READING = """
Every number is that of the campaign's summary.json under the key shown in the cell: for RMS values the RMS over runs, for
standard deviations, ratio, phase and coherence that of all runs pooled, else the mean; the small line below is the 95 %
confidence interval over runs. Run i has the same seed in every case of a study.

alpha_W is the incidence taken away by sinking air, V_W the tail wind, both as the aircraft feels them; truth is the plant's wind
along the flight. The first two seconds of a flight are left out, the bias counts from 25 s on.

Reference columns are figures computed once, before this program was written, with another implementation of the same equations
(hoffmann.md), each beside the same statistic of this program; the source itself prints a gain, a covariance and no accuracy.

Plant and onboard model are separate code. They hold the same published numbers unless a case says so: what that flatters is in
the chapter on another aircraft than believed. The flap and the servos are assumptions; the source has none.
"""
