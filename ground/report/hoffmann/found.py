"""Chapter of the gust report on an aircraft that is not as believed."""

from __future__ import annotations

from ground.report import page as p
from ground.report.load import Campaign

REDUCED = ("reduction_total_pct", "reduction_low_pct")
NOTE = (
    "Reductions of the RMS of a_z against the hold in the same gusts with the same fault; red: more than the hold. Bank of "
    "intensities: the estimator that takes its servos from the aircraft file. Hold: share of the flight from 4 s on in which the "
    "hold flew and said why."
)


def sensors(c: Campaign | None) -> str:
    """The bank of servo models on other servos, lift, sensors and with faults."""
    if c is None:
        return ""
    head = [("case", "")]
    for name in ("bank of intensities", "bank of servo models"):
        head += [(f"{name}: total reduced [%]", "num"), ("below 2 Hz reduced [%]", "num"), ("hold [%]", "num")]
    head += [
        (h, "num")
        for h in (
            "servos found [rad/s]",
            "samples late",
            "lift inside 2 sigma [%]",
            "alpha_W RMS [deg]",
            "left after [s]",
        )
    ]
    rows = []
    for case in c.cases:
        row = p.text(case.replace("_", " "), "name")
        for a in ("bank", "servo_bank"):
            for key in REDUCED:
                v = c.stat(case, f"{a}.{key}")
                row += p.cell(v, "bad" if v.value is not None and v.value < 0.0 else "")
            row += p.cell(c.stat(case, f"{a}.hold_pct"))
        keys = ("servo_wn_radps", "late_samples", "lift.inside_2sigma_pct", "alpha_w.rms_deg", "left_after_s")
        rows.append(row + "".join(p.cell(c.stat(case, f"servo_bank.{k}")) for k in keys))
    return p.paragraph(str(c.meta.get("purpose", ""))) + p.table(head, rows, NOTE)
