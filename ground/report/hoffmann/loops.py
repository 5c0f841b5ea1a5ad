"""Chapters of the gust report on what is made of the estimate: alleviation, its robustness, and adaptation to the turbulence."""

from __future__ import annotations

from collections.abc import Sequence

from ground.report import page as p
from ground.report.build import Pictures
from ground.report.hoffmann import figures as f
from ground.report.hoffmann import page as hoffmann
from ground.report.hoffmann.page import label
from ground.report.load import Campaign

REDUCED = ("reduction_total_pct", "reduction_low_pct")


def estimators(c: Campaign, case: str, metric: str) -> list[str]:
    """Estimators or loops of a case, in the report's order."""
    order = list(hoffmann.LABELS)
    return sorted(c.actors(metric, [case]), key=lambda a: order.index(a) if a in order else 99)


def labels(names: Sequence[str]) -> dict[str, str]:
    """Label of each."""
    return {n: label(n) for n in names}


def alleviation(c: Campaign | None, pictures: Pictures) -> str:
    """Every loop against the hold, and what each difference between two of them is worth."""
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", ""))) + _in_words(c)
    head = [("loop, estimate", "")]
    head += [
        (h, "num")
        for h in ("a_z total [m/s²]", "below 2 Hz [m/s²]", "total reduced [%]", "reference", "below 2 Hz reduced [%]",
                  "reference", "height [m]", "flap [deg]")
    ]  # fmt: skip
    rows = []
    for case in c.cases:
        rows.append(p.group(case.replace("_", " "), len(head)))
        held = hoffmann.ALLEVIATION.get(case, {})
        for a in ["hold", *estimators(c, case, REDUCED[0])]:
            row = p.text(label(a), "name")
            row += "".join(p.cell(c.stat(case, f"{a}.{k}")) for k in ("a_z_rms_mps2", "a_z_low_rms_mps2"))
            for key, ref in zip(REDUCED, held.get(a, (None, None)), strict=True):
                row += p.cell(c.stat(case, f"{a}.{key}"), _sign(c, case, f"{a}.{key}"))
                row += p.plain(ref) if ref is not None else p.blank()
            rows.append(row + p.cell(c.stat(case, f"{a}.height_rms_m")) + p.cell(c.stat(case, f"{a}.flap_rms_deg")))
    out += p.table(head, rows, hoffmann.AGAINST_HOLD) + _steps(c)
    for case in c.cases:
        tr = c.traces(case)
        shown = [a for a in ("hold", "printed_joined", "default", "vertical", "bank_all") if f"{a}.a_z" in tr]
        if len(shown) > 1 and case in ("linear", "nonlinear"):
            out += pictures.add(
                f"loads_{case}", f.loads(tr, shown, labels(shown)), f"Loop {case.replace('_', ' ')}, first run."
            )
    return out


def _sign(c: Campaign, case: str, value: str) -> str:
    """Red for more a_z than with the hold."""
    v = c.stat(case, value).value
    return "bad" if v is not None and v < 0.0 else ""


def _in_words(c: Campaign) -> str:
    """What the printed gain achieves, held and joined, beside the sampled filters, in the first case."""
    said = []
    for a in ("printed", "printed_joined", "tuned_1", "default"):
        total, low = (c.stat(c.cases[0], f"{a}.{key}").value for key in REDUCED)
        if total is not None and low is not None:
            said.append(f"{label(a)}: {low:.0f} % below 2 Hz, {total:.0f} % in total")
    return p.paragraph(f"{hoffmann.PLAINLY} {'; '.join(said)}.") if said else ""


def _steps(c: Campaign) -> str:
    """Differences of reduction between loops that differ in one thing."""
    cases = [x for x in c.cases if any(c.stat(x, f"{a}.{REDUCED[0]}").value is not None for _, a, _ in hoffmann.STEPS)]
    rows = []
    for before, after, what in hoffmann.STEPS:
        row = p.text(what)
        for case in cases:
            for key in REDUCED[::-1]:
                x, y = (c.stat(case, f"{a}.{key}").value for a in (before, after))
                gain = None if x is None or y is None else round(y - x, 1) + 0.0  # no "-0"
                row += p.blank() if gain is None else p.plain(gain, "bad" if gain < 0.0 else "")
        rows.append(row)
    head = [("step", "")]
    head += [(f"{x.replace('_', ' ')}, {k}", "num") for x in cases for k in ("below 2 Hz", "total")]
    return "<h3>What each step is worth</h3>" + p.table(head, rows, "Points of reduction [%] gained; red: lost.")


def robustness(c: Campaign | None) -> str:
    """The mission's software on aircraft other than the one it believes in."""
    if c is None:
        return ""
    pilots = ("accelerometer", "no_accelerometer")
    head = [("aircraft", ""), ("hold, a_z [m/s²]", "num"), ("below 2 Hz", "num")]
    for a in pilots:
        head += [(f"{label(a)}: {h}", "num") for h in ("total reduced [%]", "below 2 Hz reduced [%]", "height [m]")]
    rows = []
    for case in c.cases:
        row = p.text(hoffmann.AIRCRAFT.get(case, case.replace("_", " ")), "name")
        row += "".join(p.cell(c.stat(case, f"hold.{k}")) for k in ("a_z_rms_mps2", "a_z_low_rms_mps2"))
        for a in pilots:
            row += "".join(p.cell(c.stat(case, f"{a}.{k}"), _sign(c, case, f"{a}.{k}")) for k in REDUCED)
            row += p.cell(c.stat(case, f"{a}.height_rms_m"))
        rows.append(row)
    return p.paragraph(str(c.meta.get("purpose", ""))) + p.table(head, rows, hoffmann.BELIEVED)


def adaptation(c: Campaign | None, pictures: Pictures) -> str:
    """Errors of fixed and adapting filters in calm, light and changing air."""
    if c is None:
        return ""
    out = p.paragraph(str(c.meta.get("purpose", "")))
    actors = [
        a
        for a in ("medium", "light", "matched", "bank", "bank_apart", "bank_ground")
        if any(v.startswith(f"{a}.") for v in c.columns)
    ]
    rows = []
    for case in c.cases:
        parts = sorted({v.split(".")[1] for v in c.columns if v.split(".")[1].startswith("part_")})
        for part in ["", *parts]:
            dot = f"{part}." if part else ""
            keys = [f"{a}.{dot}{k}" for a in actors for k in ("alpha_w.rms_deg", "v_w.rms_mps")]
            if c.stat(case, keys[0]).value is None:
                continue
            name = case.replace("_", " ") + (f", {part.replace('_', ' ')}" if part else "")
            rows.append(p.text(name, "name") + "".join(p.cell(c.stat(case, k)) for k in keys))
    head = [("air", ""), *((f"{label(a)}: {u}", "num") for a in actors for u in ("alpha_W [deg]", "V_W [m/s]"))]
    out += p.table(head, rows, hoffmann.CALM)
    tr = c.traces("changing") if "changing" in c.cases else {}
    shown = [a for a in ("medium", "light", "bank") if f"{a}.x" in tr]
    if shown:
        png = f.adaptation(tr, shown, labels(shown))
        out += pictures.add(
            "adaptation", png, "Calm, 0.3 of medium turbulence from 30 s to 60 s, calm again; first run."
        )
    return out
