"""The print's trajectory of the tanker: the ground track of the cases that fly several turns."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape

import numpy as np

from ground.report import figures as f
from ground.report.chapters import Keeper
from ground.report.figures import TRUTH, Array
from ground.report.lee import page as lee
from ground.report.load import Campaign

NORTH, EAST = 9, 10  # columns of the state
EVERY_S = 100.0


def through_air(t: Array, over: Array, wind: Array) -> Array:
    """Way through the air [N,2] m from the start on: that over the ground [N,2] m less the air's own; wind [N,2] m/s, t [N] s."""
    drift = np.cumsum(0.5 * np.diff(t)[:, None] * (wind[1:] + wind[:-1]), axis=0)
    return np.asarray(over - over[0] - np.vstack([np.zeros(2), drift]))


def picture(tr: Mapping[str, Array]) -> bytes:
    """Track over the ground and through the air [km], a mark and the time every 100 s. PNG bytes.

    tr: t [N] s, state_true [N,>=11] with north and east [m], wind_true [N,3] m/s NED.
    """
    t, over = tr["t"], tr["state_true"][:, [NORTH, EAST]]
    ways = (("over the ground", over - over[0]), ("through the air", through_air(t, over, tr["wind_true"][:, :2])))
    fig, axes = f.new_figure(12.0, 4.8, 1, 2)
    marks = [int(np.searchsorted(t, s)) for s in np.arange(0.0, t[-1], EVERY_S)]
    for ax, (title, way) in zip(axes[0], ways, strict=True):
        km = way / 1000.0
        ax.plot(km[:, 1], km[:, 0], color=TRUTH, lw=1.2)
        ax.plot(km[marks, 1], km[marks, 0], "o", color=f.COLORS["default"], ms=3.5)
        for i in marks:
            place = (float(km[i, 1]), float(km[i, 0]))
            ax.annotate(f"{t[i]:.0f} s", place, xytext=(5, 3), textcoords="offset points", fontsize=8.0)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_title(title, fontsize=10, loc="left", color="#3a4550")
        ax.set_xlabel("east [km]", fontsize=9.5)
        ax.set_ylabel("north [km]", fontsize=9.5)
    return f.png_bytes(fig)


def chapter(c: Campaign, pictures: Keeper) -> str:
    """Figure 7.1, of the cases whose flight goes on after one turn and whose first run kept its states."""
    out = ""
    for case in c.cases:
        tr = c.traces(case) if c.meta["cases"][case].get("leg_s") else {}
        if {"t", "state_true", "wind_true"} <= tr.keys():
            name = re.sub(r"[^A-Za-z0-9_.-]", "_", case)
            text = f"Case {escape(lee.CASE_LABELS.get(case, case))}, first run; legs and turn rate of ours."
            out += pictures.add(f"{name}_track", picture(tr), f"Figure 7.1 of the print. {text}")
    return f"<h3>Trajectory of the tanker</h3>{out}" if out else ""
