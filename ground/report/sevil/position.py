"""Chapters on position: static tables and maps, algorithms, disturbance sweeps, flight, wake unlike the model."""

from __future__ import annotations

from ground.report import figures as f
from ground.report import page as p
from ground.report.cases import Cases, matrix, sweep_points
from ground.report.sevil import figures as g
from ground.report.sevil.page import label, labels

ESTIMATORS = ("A11", "A15", "abs", "diff", "diff_prior", "joint")
LEGS = ("observation", "down", "lateral", "forward", "contact")
FILTERS = ("fixed", "augmented", "height")
SHORT = {"fixed": "frozen", "augmented": "scales", "height": "scales and height"}  # in table heads


def static(cases: Cases) -> str:
    """Disturbance table, error maps, bound."""
    mine = cases.kind("static")
    if not mine:
        return ""
    columns = [(f"{label(e)}: RMS [m]", f"{e}.rms_m") for e in ESTIMATORS]
    columns += [(f"{label(e)}: found [%]", f"{e}.available_pct") for e in ("A11", "A15", "diff")]
    columns += [
        ("whole region searched: RMS [m]", "diff_wide.rms_m"),
        ("of it wrong by > 3 m [%]", "diff_wide.wrong_pct"),
    ]
    columns += [("ML, differences: median [m]", "diff.median_m"), ("CE, Algorithm 11 [m]", "A11.ce_m"),
                ("CE, ML [m]", "diff.ce_m")]  # fmt: skip
    out = p.paragraph(
        "441 random places of the small grid in every run, mean of 1 s of readings unless the case says otherwise. Turbulence "
        "and wind are common to the probes; the contour algorithms and the absolute readings take them for a shift of position, "
        "differences between probes do not see them. All search the small grid (ML: and 2 m around it); searched in the whole "
        "extended grid a few points in ten thousand end in a wrong place, which is what tracking is for."
    )
    out += matrix([c for c in mine if c.name.startswith("static_")] or mine, columns)
    for name in ("static_all", "static_turbulence", "static_noise"):
        c = cases.named(name)
        tr = c.traces() if c else {}
        found = {e: tr[f"{e}.position"] for e in ("A11", "A15", "abs", "diff") if f"{e}.position" in tr}
        if c and found:
            text = f"{c.label}: position error over the grid, first run; crosses: no position; red cross: contact."
            out += cases.pictures.add(f"map_{name}", g.error_maps(tr["points"], found, labels(list(found))), text)
    bound = [
        c
        for c in mine
        if c.name.startswith(("static_", "noise_", "window_")) and c.stat("diff.crlb_m").value is not None
    ]
    if bound:
        what = (("RMS [m]", "rms_m"), ("bound [m]", "crlb_m"), ("RMS / bound", "crlb_ratio"),
                ("bound at contact [m]", "crlb_contact_m"))  # fmt: skip
        columns = [(f"{label(e)}: {h}", f"{e}.{v}") for e in ("abs", "diff") for h, v in what]
        note = (
            "The bound of the absolute readings holds for white noise only, and means nothing with turbulence or wind. RMS and "
            "bound are radial, in the y-z plane."
        )
        out += "<h3>Cramér-Rao bound</h3>" + matrix(bound, columns, note=note)
    probes = cases.kind("probes")
    if probes:
        columns = [("RMS [m]", "diff.rms_m"), ("median [m]", "diff.median_m"), ("bound [m]", "diff.crlb_m"),
                   ("bound at contact [m]", "diff.crlb_contact_m")]  # fmt: skip
        note = "Maximum likelihood of differences. With few channels several places fit, and the RMS is theirs."
        out += "<h3>Fewer channels</h3>" + matrix(probes, columns, note=note)
    return out


SWEEPS = (
    ("turbulence", "turbulence [m/s]"), ("noise", "noise variance of the angles [deg²]; V in proportion"),
    ("window", "averaging window [s], noise and turbulence"), ("wind", "steady side wind [m/s]"),
)  # fmt: skip


def sweeps(cases: Cases) -> str:
    """Error and availability against each disturbance."""
    out = ""
    for prefix, xlabel in SWEEPS:
        family = cases.family(prefix, "static")
        if len(family) < 3:
            continue
        panels = [
            ("RMS [m]", sweep_points(family, ESTIMATORS, "rms_m")),
            ("points without a position [%]", sweep_points(family, ("A11", "A15", "diff"), "none_pct")),
        ]
        png = f.sweep(panels, xlabel, labels(ESTIMATORS))
        out += cases.pictures.add(f"sweep_{prefix}", png, f"Static error against {xlabel}; 95 % intervals over runs.")
        columns = [(f"{label(e)}: {h}", f"{e}.{k}") for e in ("A11", "A15", "abs", "diff")
                   for h, k in (("RMS [m]", "rms_m"), ("found [%]", "available_pct"))]  # fmt: skip
        out += p.details(f"Figures against {xlabel}", matrix([c for _, c in family], columns))
    return out


def algorithms(cases: Cases) -> str:
    """Ranking of Algorithms 1 to 16 on each map."""
    mine = cases.kind("algorithms")
    if not mine:
        return ""
    names = [*(f"A{i}" for i in range(1, 17)), "A11_gated", "diff"]
    out = p.paragraph(
        "CE: sum of errors over the points with a position; ER: share of points with one (1 is best); WCE, WER: weighted by "
        "closeness to contact, WER as printed over N and over the sum of weights. Ordered by CE. The source prints "
        "this as figures; its best ones are 11 and 15."
    )
    shown = [c for c in mine if c.name in ("small_off_node", "small_noise", "small_turbulence", "small_all")]
    data = {}
    for c in shown:
        values = {a: (c.stat(f"{a}.none_pct").value, c.stat(f"{a}.ce_m").value) for a in names if a != "A11_gated"}
        data[c.label] = {a: (n, e) for a, (n, e) in values.items() if n is not None and e is not None and n < 90.0}
    if data:
        text = "Cumulative error against points without a position; best is lower left. Numbers: algorithms; ML: differences. "
        text += "Algorithms that find less than a tenth of the points are left out."
        out += cases.pictures.add("ranking", g.ranking(data), text)
    head = [("", ""), *((h, "num") for h in ("CE [m]", "ER", "none [%]", "WCE [m]", "WER printed", "WER normalised",
                                             "RMS [m]", "median [m]", "worst [m]"))]  # fmt: skip
    keys = ("ce_m", "er", "none_pct", "wce_m", "wer", "wer_normalised", "rms_m", "median_m", "worst_m")
    for c in mine:
        have = [a for a in names if c.stat(f"{a}.er").value is not None]
        have.sort(key=lambda a, c=c: (c.stat(f"{a}.ce_m").value or 0.0, -(c.stat(f"{a}.er").value or 0.0)))  # type: ignore[misc]
        rows = []
        for a in have:
            name = label(a) if not a[1:].isdigit() else f"Algorithm {a[1:]}"
            rows.append(p.text(name, "name") + "".join(p.cell(c.stat(f"{a}.{k}"), interval=False) for k in keys))
        out += p.details(f"{c.label}: all algorithms", p.table(head, rows))
    return out


def dynamic(cases: Cases) -> str:
    """Errors per leg of every estimator, tracks, consistency."""
    mine = cases.kind("dynamic")
    if not mine:
        return ""
    out = p.paragraph(
        "60 s at observation, 30 s down, 80 s across, 40 s forward, 120 s at contact, with turbulence 0.39 m/s, unknown wind "
        "(2, 1, 0.5) m/s, attitude and accelerometer errors; no position sensor. RMS in the y-z plane."
    )
    head = [("estimator", ""), *((f"{leg}: RMS [m]", "num") for leg in LEGS), ("contact: 95th pct [m]", "num")]
    head += [(f"{leg}: found [%]", "num") for leg in LEGS]
    head += [("contact: NIS of 9", "num"), ("inside 2 sigma [%]", "num")]
    rows = []
    for c in mine:
        if c.name == "all" and cases.named("dynamic_all") is not None:
            continue
        rows.append(p.group(c.label, len(head)))
        for a in ("A11", "A15", "ml", *FILTERS):
            if c.stat(f"{a}.contact.available_pct").value is None and c.stat(f"{a}.contact.rms_m").value is None:
                continue
            row = p.text(label(a), "name")
            row += "".join(p.cell(c.stat(f"{a}.{leg}.rms_m")) for leg in LEGS)
            row += p.cell(c.stat(f"{a}.contact.p95_m"))
            row += "".join(p.cell(c.stat(f"{a}.{leg}.available_pct"), interval=False) for leg in LEGS)
            rows.append(row + p.cell(c.stat(f"{a}.contact.nis")) + p.cell(c.stat(f"{a}.contact.inside_2sigma_pct")))
    note = "Found: for filters, the share of fixes that claim to be valid. Guess: first guess off by so many metres (1 sigma)."
    out += p.table(head, rows, note)
    c = cases.named("dynamic_all") or mine[0]
    tr = c.traces()
    name = next((n for n in reversed(FILTERS) if f"{n}.position" in tr), None)
    if name:
        dots = {d: tr[f"{d}.position"] for d in ("A11", "ml") if f"{d}.position" in tr}
        png = g.track(tr, name, dots, labels([name, *dots]))
        text = "One flight: path and errors. Band: the filter's own 2 sigma. Dots: once a second from 1 s means."
        out += cases.pictures.add("dynamic_track", png, text)
    return out


def mismatch(cases: Cases) -> str:
    """Contact error where plant and onboard wake differ."""
    mine = cases.full("mismatch")
    if not mine:
        return ""
    actors = ("static", *FILTERS)
    series = {a: [c.bar("static.rms_m" if a == "static" else f"{a}.contact.rms_m") for c in mine] for a in actors}
    png = f.bars([c.label.replace(" ", "\n", 1) for c in mine], series, "RMS at contact [m]", labels(actors))
    out = p.paragraph(
        "The plant's wake is changed, the onboard model is not told. NIS hardly moves: it cannot serve as the alarm for a wrong "
        "wake. A lift of the whole wake cannot be told from own height by any air data."
    )
    out += cases.pictures.add(
        "mismatch", png, "Position error at contact with a wake unlike the model; 95 % intervals."
    )
    columns = [(f"{SHORT[a]}: contact RMS [m]", f"{a}.contact.rms_m") for a in FILTERS]
    columns += [(f"{SHORT[a]}: 95th pct [m]", f"{a}.contact.p95_m") for a in FILTERS[1:]]
    columns += [("static ML, no noise [m]", "static.rms_m")]
    columns += [(f"{SHORT['height']}: lateral RMS [m]", "height.lateral.rms_m")]
    columns += [(f"{SHORT[a]}: NIS of 9", f"{a}.contact.nis") for a in ("fixed", "height")]
    for true, what in (("scale_wing", "wing"), ("scale_tail", "tail")):
        columns += [
            (f"{what} scale: true", f"true.{true}"),
            *((f"{what}: {SHORT[a]}", f"{a}.{true}") for a in FILTERS[1:]),
        ]
    columns.append(("height learnt [m]", "height.height_m"))
    return out + matrix(mine, columns)
