"""The scan of what the print leaves out: window of the calculated wind by root of Q, the best setting of each case marked."""

from __future__ import annotations

import re
from html import escape

from ground.report import page as p
from ground.report.lee import page as lee
from ground.report.load import Campaign

STUDY = "lee_scan"
SETTING = re.compile(r"w(\d+)_q([\dp]+)\.wind\.magnitude_rms_pct")
MAGNITUDE = "wind.magnitude_rms_pct"
NOTE = (
    "RMS of the wind's magnitude [%] of the printed filter; below it the share inside 3 sigma. Green: the best of a case, found "
    "on the runs it is judged on. Extended: an EKF in its place with window 1 and root 0.33."
)


def chapter(c: Campaign) -> str:
    """A table per case; settings are read off the campaign's columns."""
    found = sorted(
        {(int(m[1]), m[2]) for k in c.columns if (m := SETTING.fullmatch(k))},
        key=lambda s: (s[0], float(s[1].replace("p", "."))),
    )
    windows, roots = sorted({w for w, _ in found}), list(dict.fromkeys(q for _, q in found))
    head = [("window [samples]", ""), *((f"root of Q {q.replace('p', '.')}", "num") for q in roots)]
    head += [("extended", "num"), ("our default", "num")]
    out = p.paragraph(str(c.meta.get("purpose", "")))
    for case in c.cases:
        values = {(w, q): c.stat(case, f"w{w}_q{q}.{MAGNITUDE}").value for w, q in found}
        known = [v for v in values.values() if v is not None]
        rows = []
        for w in windows:
            row = p.text(w)
            for q in roots:
                inside = c.stat(case, f"w{w}_q{q}.wind.inside_3sigma_pct").value
                v = values.get((w, q))
                row += p.plain(v, "good" if known and v == min(known) else "", "", f"{p.number(inside)} %")
            first = w == windows[0]
            row += p.cell(c.stat(case, f"ekf.{MAGNITUDE}")) if first else p.blank()
            rows.append(row + (p.cell(c.stat(case, f"default.{MAGNITUDE}")) if first else p.blank()))
        out += f"<h3>Case {escape(lee.CASE_LABELS.get(f'tanker_{case}', case))}</h3>" + p.table(head, rows, NOTE)
    return out
