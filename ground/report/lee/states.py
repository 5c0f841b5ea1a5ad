"""The print's state figures: what is measured, estimated and true of the tanker, errors with 3 sigma; four figures a case."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from html import escape

import numpy as np

from ground.report import figures as f
from ground.report import page as p
from ground.report.chapters import Keeper
from ground.report.figures import TRUTH, Array
from ground.report.lee import page as lee
from ground.report.load import Campaign

DEG = 180.0 / math.pi
# what a figure shows: file name, title, columns of the state with unit and scale
GROUPS = (
    ("air", "Airspeed, sideslip, incidence", ((0, "V [m/s]", 1.0), (1, "beta [deg]", DEG), (2, "alpha [deg]", DEG))),
    ("rates", "Angular rates", ((3, "p [deg/s]", DEG), (4, "q [deg/s]", DEG), (5, "r [deg/s]", DEG))),
    ("euler", "Euler angles", ((6, "psi [deg]", DEG), (7, "theta [deg]", DEG), (8, "phi [deg]", DEG))),
    ("position", "Position", ((9, "north [m]", 1.0), (10, "east [m]", 1.0), (11, "down [m]", 1.0))),
)
FIGURES = {"tanker_I": 4, "tanker_II": 10, "tanker_III": 16, "tanker_III_no_aero": 22, "tanker_IV_no_aero": 28,
           "tanker_II_coloured": 35, "tanker_III_coloured": 42}  # fmt: skip
DRAWN = (("default", "#1f5fa8"), ("printed", "#b8860b"))
HEADING = 6


def _error(column: int, est: Array, truth: Array) -> Array:
    d = est[:, column] - truth[:, column]
    return (d + math.pi) % (2.0 * math.pi) - math.pi if column == HEADING else d


def picture(tr: Mapping[str, Array], columns: tuple[tuple[int, str, float], ...], names: Mapping[str, str]) -> bytes:
    """Left: measured, estimated, true; right: errors of the estimates with their 3 sigma. PNG bytes."""
    fig, axes = f.new_figure(12.0, 5.4, 3, 2, sharex=True)
    t, truth = tr["t"], tr["state_true"]
    for row, (k, text, scale) in enumerate(columns):
        left, right = axes[row]
        left.plot(t, scale * tr["state_read"][:, k], color="#c3cad2", lw=0.6, label="measured")
        for name, colour in DRAWN:
            if f"{name}.state" not in tr:
                continue
            left.plot(t, scale * tr[f"{name}.state"][:, k], color=colour, lw=0.8, label=names[name])
            band = 3.0 * scale * tr[f"{name}.state_sigma"][:, k]
            right.fill_between(t, -band, band, color=colour, alpha=0.14, lw=0)
            right.plot(t, scale * _error(k, tr[f"{name}.state"], truth), color=colour, lw=0.7)
            late = band[len(band) // 4 :]
            top = 2.0 * float(np.nanmax(late)) if np.isfinite(late).any() else 1.0
            low, high = right.get_ylim() if name != DRAWN[0][0] else (-top, top)
            right.set_ylim(min(low, -top), max(high, top))
        left.plot(t, scale * truth[:, k], color=TRUTH, lw=0.8, label="true")
        left.set_ylabel(text, fontsize=9.5)
    axes[0, 0].legend(fontsize=8.0, frameon=False, ncols=4)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    return f.png_bytes(fig)


def chapter(c: Campaign, pictures: Keeper) -> str:
    """The 28 figures, of the cases whose first run kept its states."""
    out = ""
    for case, first in FIGURES.items():
        tr = c.traces(case) if case in c.cases else {}
        if not {"t", "state_true", "state_read", "default.state"} <= tr.keys():
            continue
        body = ""
        for i, (name, title, columns) in enumerate(GROUPS):
            file = re.sub(r"[^A-Za-z0-9_.-]", "_", f"{case}_{name}")
            caption = f"Figure 7.{first + i} of the print. {title}, first run; bands: 3 sigma of each filter."
            body += pictures.add(file, picture(tr, columns, lee.LABELS), caption)
        out += p.details(f"Case {escape(lee.CASE_LABELS.get(case, case))}: states", body)
    return f"<h3>States, measured and estimated</h3>{out}" if out else ""
