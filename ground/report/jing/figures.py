"""Figures of the windshear report; each function returns the PNG's bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ground.report.figures import SPARE, TRUTH, Array, new_figure, png_bytes
from ground.views.windshear.read import AL, VA, WH, WX, H, X

OURS = "#1f5fa8"
LIMIT = "#b3261e"


def encounter(tr: Mapping[str, Array]) -> bytes:
    """Errors of both winds with their 2-sigma bands, hazard index true and estimated, and the height, over time."""
    fig, axes = new_figure(13.2, 5.6, 2, 2, sharex=True)
    t, truth, x, sigma = tr["t"], tr["truth"], tr["x"], tr["sigma"]
    for ax, column, name in ((axes[0, 0], WX, "w_x"), (axes[1, 0], WH, "w_h")):
        known = np.isfinite(sigma[:, column])
        ax.fill_between(t[known], -2 * sigma[known, column], 2 * sigma[known, column], color=OURS, alpha=0.16, lw=0)
        ax.plot(t[known], (x - truth)[known, column], color=OURS, lw=0.9)
        ax.axhline(0.0, color=TRUTH, lw=0.6)
        ax.set_ylabel(f"error of {name} [m/s]", fontsize=9.5)
    ax = axes[0, 1]
    ax.plot(t, tr["F"], color=TRUTH, lw=1.0, label="true")
    ax.plot(t, tr["F_hat"], color=OURS, lw=0.8, label="estimated")
    ax.plot(t, tr["slow"], color="#5b8c2a", lw=1.1, label="4 s low-pass")
    ax.axhline(0.12, color=LIMIT, lw=0.9, ls="--", label="threshold")
    ax.set_ylabel("hazard index F [-]", fontsize=9.5)
    ax.legend(fontsize=8.5, frameon=False, ncols=4)
    axes[1, 1].plot(t, truth[:, H], color=TRUTH, lw=1.1)
    axes[1, 1].set_ylabel("height [m]", fontsize=9.5)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    return png_bytes(fig)


def escapes(tr: Mapping[str, Array], laws: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """Height and airspeed of every law over distance."""
    fig, axes = new_figure(13.2, 6.2, 2, 1, sharex=True)
    for k, law in enumerate(laws):
        truth = tr[f"{law}.ekf15.truth"]
        for ax, column in ((axes[0, 0], H), (axes[1, 0], VA)):
            ax.plot(truth[:, X], truth[:, column], color=SPARE[k % len(SPARE)], lw=1.3, label=labels.get(law, law))
    axes[0, 0].axhline(0.0, color="#8a6d3b", lw=1.2)
    axes[0, 0].set(ylabel="height [m]", xlim=(-1500.0, 3500.0), ylim=(-10.0, 260.0))
    axes[1, 0].set(ylabel="airspeed [m/s]", xlabel="distance from the core [m]")
    axes[0, 0].legend(fontsize=8.5, frameon=False, ncols=4)
    return png_bytes(fig)


def over_range(flights: Mapping[str, Mapping[str, Array]], winds: bool = False) -> bytes:
    """Height, incidence and airspeed of flights (label to traces) over distance; winds: w_x and w_h as well."""
    rows = 5 if winds else 3
    fig, axes = new_figure(13.2, 2.1 * rows, rows, 1, sharex=True)
    columns = ((H, 1.0, "height [m]"), (AL, 180.0 / np.pi, "incidence [deg]"), (VA, 1.0, "airspeed [m/s]"),
               (WX, 1.0, "w_x [m/s]"), (WH, 1.0, "w_h [m/s]"))  # fmt: skip
    for k, (label, tr) in enumerate(flights.items()):
        colour = TRUTH if k == 0 else SPARE[(k - 1) % len(SPARE)]
        for ax, (column, scale, text) in zip(axes[:, 0], columns, strict=False):
            ax.plot(tr["truth"][:, X], scale * tr["truth"][:, column], color=colour, lw=1.2, label=label)
            ax.set_ylabel(text, fontsize=9.5)
    axes[-1, 0].set_xlabel("distance from the core [m]", fontsize=9.5)
    axes[0, 0].legend(fontsize=8.5, frameon=False, ncols=4)
    return png_bytes(fig)
