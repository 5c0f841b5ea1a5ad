"""Chapters on faults: printed tables, residual portrait, sweeps against theory, two faults, detection with estimation."""

from __future__ import annotations

import math

from ground.report import figures as f
from ground.report import page as p
from ground.report.cases import CaseOf, Cases, matrix
from ground.report.sevil import figures as g
from ground.report.sevil.page import FDI_TABLES, VARIABLES, FdiTable, label

WHEN = (("before", "before"), ("during the fault", "fault"), ("after", "after"))
THRESHOLD = -2.0 * math.log(0.01)  # single sample, 1 %


def tables(cases: Cases) -> str:
    """Tables 6.1 to 6.5: printed, as printed, ours."""
    out = p.paragraph(
        "3000 s at 20 Hz, faults of 3 m/s on V of the left probe, 1 deg on sideslip of the nose and on incidence of the right "
        "one. Percent of samples. As printed: single sample at 1 %. Windowed: mean of five samples at 0.001 %."
    )
    shown = "".join(_table(cases, t) for t in FDI_TABLES)
    if not shown:
        return ""
    return out + shown + _negative(cases) + _portrait(cases) + _indices(cases)


def _table(cases: Cases, t: FdiTable) -> str:
    columns = [(h, c, d) for h, name, d in t.columns if (c := cases.named(name)) is not None]
    if not columns:
        return ""
    head = [("", ""), ("variable", ""), ("printed", "num"), *((h, "num") for h, _, _ in columns)]
    rows = []
    for name, value, *printed in t.rows:
        for i, var in enumerate(VARIABLES):
            row = p.text(name if i == 0 else "", "name") + p.text(var) + p.plain(printed[i])
            rows.append(row + "".join(p.cell(c.stat(f"{d}.{var}.{value}")) for _, c, d in columns))
    return f"<h3>Table {t.number}: {t.title}</h3>" + p.table(head, rows, t.note)


def _negative(cases: Cases) -> str:
    positive, negative = cases.named("fdi_refuelling"), cases.named("fdi_negative")
    if negative is None:
        return ""
    head = [("fault", ""), ("detector", ""), ("variable", ""), ("isolated as printed [%]", "num"), ("isolated, ours [%]", "num"),
            ("true alarms [%]", "num"), ("delay [samples]", "num")]  # fmt: skip
    rows = []
    for text, c in (("reads high", positive), ("reads low", negative)):
        for d in ("additive", "windowed") if c is not None else ():
            for var in VARIABLES:
                assert c is not None
                row = p.text(text, "name") + p.text(label(d), "name") + p.text(var)
                keys = ("isolated_printed_pct", "isolated_pct", "tap_pct", "delay_samples")
                rows.append(row + "".join(p.cell(c.stat(f"{d}.{var}.{k}")) for k in keys))
    note = (
        "As printed the smallest angle to +V_i decides, so a probe that reads low is not blamed; ours: largest |cos|."
    )
    return "<h3>Sign of the fault</h3>" + p.table(head, rows, note)


def _portrait(cases: Cases) -> str:
    c = cases.named("fdi_refuelling")
    tr = c.traces() if c else {}
    rows = [(n, t) for n, t in (("printed", "as printed"), ("additive", "additive")) if f"{n}.beta" in tr]
    if not rows:
        return ""
    text = (
        "Normalised parity residuals of a 3000 s run with turbulence, one in forty samples; circle: threshold at 1 %. "
    )
    text += "Outside the circle without a fault is a false alarm. The faulty probe's direction is 0, 120 or 240 deg."
    return cases.pictures.add("residuals", g.portrait(tr, rows, THRESHOLD), text)


def _indices(cases: Cases) -> str:
    c = cases.named("fdi_solo")
    tr = c.traces() if c else {}
    if "angle.V" not in tr:
        return ""
    out = cases.pictures.add(
        "solo_portrait", g.portrait(tr, [("plain", "solo flight")], THRESHOLD), "Solo flight, every second."
    )
    text = (
        "Solo flight, every second: the source's index of the angle between residual and direction of each probe (5.21), alarm, "
        "and the probe blamed (5.22). Shaded: the fault, on the left probe (V), the nose (sideslip), the right one (incidence)."
    )
    return "<h3>Indices over time</h3>" + out + cases.pictures.add("solo_indices", g.indices(tr), text)


def sweeps(cases: Cases) -> str:
    """True alarms against theory, ROC, noisy position."""
    out = ""
    for prefix, what in (("fault", "fault in V [m/s]; angles: a tenth of it in deg"),
                         ("noise", "noise variance relative to the source's; fault 3 m/s, 0.3 deg")):  # fmt: skip
        family = _fdi_family(cases, prefix)
        if len(family) < 3:
            continue
        points = {}
        for var in VARIABLES:
            rows = [(x, c.stat(f"{var}.tap_pct").value, c.stat(f"{var}.tap_theory_pct").value) for x, c in family]
            points[var] = [(x, a, b) for x, a, b in rows if a is not None and b is not None]
        text = f"True alarms against {what}; single sample, 1 % false alarms, turbulence on, at contact."
        out += cases.pictures.add(f"power_{prefix}", g.power(points, what), text)
    curves = []
    for x, c in _fdi_family(cases, "fault"):
        if x in (0.5, 1.0, 1.5, 2.0):
            curves.append((f"{x:g} m/s, 1 sample", c.traces()))
    for x, c in _fdi_family(cases, "window"):
        if x > 1:
            curves.append((f"1.5 m/s, {x:.0f} samples", c.traces()))
    curves = [(t, tr) for t, tr in curves if "V.tap" in tr]
    if curves:
        text = "Receiver operating curves of V: dots measured in one run, dashed noncentral chi-square."
        out += cases.pictures.add("roc", g.roc(curves), text)
    mine = cases.kind("fdi_sweep")
    if mine:
        columns = [(f"{v}: {h}", f"{v}.{k}") for v in VARIABLES for h, k in (
            ("true alarms [%]", "tap_pct"), ("theory", "tap_theory_pct"), ("false alarms [%]", "fap_pct"))]  # fmt: skip
        out += p.details("Sweep figures", matrix(mine, [*columns, ("theory, false alarms", "V.fap_theory_pct")]))
    noisy = cases.kind("fdi_position")
    if noisy:
        lines = []
        for c in noisy:
            for d in ("without", "with_jpj"):
                for var in VARIABLES:
                    row = p.text(c.label, "name") + p.text(label(d), "name") + p.text(var)
                    keys = ("fap_before_pct", "fap_during_pct", "fap_after_pct", "tap_pct")
                    lines.append(row + "".join(p.cell(c.stat(f"{d}.{var}.{k}")) for k in keys))
        head = [("position sigma [m]", ""), ("covariance", ""), ("variable", ""), ("false alarms before [%]", "num"),
                ("during", "num"), ("after", "num"), ("true alarms [%]", "num")]  # fmt: skip
        note = "Additive test, single sample at 1 %, turbulence on; white position errors of sigma per axis."
        out += "<h3>Noisy position</h3>" + p.table(head, lines, note)
    return out


def _fdi_family(cases: Cases, prefix: str) -> list[tuple[float, CaseOf]]:
    return cases.family(prefix, "fdi_sweep")


def two(cases: Cases) -> str:
    """Two faults in one variable."""
    mine = cases.kind("two_faults")
    if not mine:
        return ""
    text = (
        "Three probes leave two dimensions: two equal faults look like one of the other sign on the third. The predicted common "
        "value (inertial velocity and wind estimate) as a virtual sensor tells them apart. "
        "Each run: 20 000 independent windows; a set of suspects is refused at 0.03 %."
    )
    columns = [("right, with virtual sensor [%]", "virtual.correct_pct"),
               ("the same at 0.01 % [%]", "virtual_strict.correct_pct"),
               ("three probes alone [%]", "three_probes.correct_pct"),
               ("as printed [%]", "printed.correct_pct")]  # fmt: skip
    return p.paragraph(text) + matrix(mine, columns)


def integrated(cases: Cases) -> str:
    """Detection and position estimation together."""
    mine = cases.full("integrated")
    if not mine:
        return ""
    out = p.paragraph(
        "The monitor tests the readings at the filter's own prediction (J P Jᵀ of its covariance), keeps blamed channels from it "
        "and lets them back in after quiet samples. No other position sensor. Faults last 60 s at contact or 40 s across."
    )
    series = {when: [c.bar(f"with_fdi.{k}.rms_m") for c in mine] for when, k in WHEN}
    png = f.bars([c.label.replace(" ", "\n") for c in mine], series, "RMS [m]", {when: when for when, _ in WHEN})
    text = (
        "Position error with exclusion: 40 s before, during, and from 10 s after the fault; 95 % intervals over runs."
    )
    out += cases.pictures.add("integrated", png, text)
    w, o = "with_fdi", "without_fdi"
    columns = [("before: RMS [m]", f"{w}.before.rms_m"), ("during: RMS [m]", f"{w}.fault.rms_m"),
               ("during: 95th pct [m]", f"{w}.fault.p95_m"), ("after: RMS [m]", f"{w}.after.rms_m"),
               ("isolated (share of runs)", f"{w}.isolated"), ("delay [samples]", f"{w}.delay_samples"),
               ("kept out during fault [%]", f"{w}.kept_out_pct"), ("back in at the end", f"{w}.readmitted"),
               ("runs with a false exclusion", f"{w}.false_exclusion"), ("of time [%]", f"{w}.false_excluded_pct"),
               ("restarts", f"{w}.restarts"),
               ("without: a position [%]", f"{o}.fault.available_pct"), ("without: valid [%]", f"{o}.fault.valid_pct"),
               ("without: after, RMS [m]", f"{o}.after.rms_m"), ("without: restarts", f"{o}.restarts")]  # fmt: skip
    note = (
        "Without exclusion the filter refuses the readings, loses the position and starts anew when the fault is over. "
    )
    out += matrix(mine, columns, note=note + "Delay: samples until every faulty channel is out. Samples at 20 Hz.")
    for c in mine:
        tr = c.traces()
        if c.params.get("faults") and "excluded" in tr and ("nose" in c.name or "two" in c.name):
            text = f"{c.label}: channels faulty and excluded, and position error, first run."
            out += cases.pictures.add(f"exclusion_{c.name.replace('+', '')}", g.exclusions(tr), text)
    none = next((c for c in mine if c.stat("single.V.fap_contact_pct").value is not None), None)
    if none is not None:
        legs = ("observation", "down", "lateral", "forward", "contact")
        rows = [
            p.text(v, "name") + "".join(p.cell(none.stat(f"single.{v}.fap_{leg}_pct")) for leg in legs)
            for v in VARIABLES
        ]
        note = "No fault: single-sample test at 1 % with the filter's own position and covariance."
        out += "<h3>False alarms at the filter's position [%]</h3>"
        out += p.table([("variable", ""), *((leg, "num") for leg in legs)], rows, note)
    return out
