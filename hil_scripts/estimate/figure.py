"""The picture: wind components, airspeed residual, spectra."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from hil_scripts.estimate.columns import FlightLog
from hil_scripts.estimate.compare import spectra
from hil_scripts.estimate.offline import Track, implied_air, triangle

TRI, LOGGED, EST = "#666666", "#d95f02", "#1f4e9c"
NAMES = ("north", "east", "down")


def draw(log: FlightLog, tr: Track, path: Path) -> None:
    """Write the figure as PNG."""
    t = log.t - log.t[0]
    tri = triangle(log)
    fig = plt.figure(figsize=(13.0, 13.5), dpi=110, layout="constrained")
    grid = fig.add_gridspec(5, 3, height_ratios=(1.25, 1.25, 1.25, 1.0, 1.25))
    first: Axes | None = None
    for i in range(3):
        ax = fig.add_subplot(grid[i, :], sharex=first)
        first = first or ax
        ax.plot(t, tri[:, i], color="k", lw=0.45, alpha=0.75, label="wind triangle, raw", zorder=2.5)
        lo, hi = tr.wind[:, i] - 3 * tr.sigma[:, i], tr.wind[:, i] + 3 * tr.sigma[:, i]
        ax.fill_between(t, lo, hi, color=EST, alpha=0.13, lw=0, label="estimate ± 3 sigma", zorder=0)
        if log.wind_n is not None:
            note = ""
            if float(np.ptp(log.wind_n[:, i])) == 0.0:
                note = f" (constant {log.wind_n[0, i]:g}: not estimated)"
            ax.plot(t, log.wind_n[:, i], color=LOGGED, lw=1.4, label="logged onboard" + note, zorder=3)
        ax.plot(t, tr.wind[:, i], color=EST, lw=1.3, label="estimate", zorder=2)
        both = np.concatenate([tri[:, i], lo[np.isfinite(lo)], hi[np.isfinite(hi)]])
        pad = 0.05 * float(np.ptp(both))
        ax.set_ylim(float(both.min()) - pad, float(both.max()) + pad)
        ax.set_ylabel(f"wind {NAMES[i]} [m/s]")
        ax.legend(loc="upper right", ncols=4, fontsize=8.5, framealpha=0.9)
        ax.tick_params(labelbottom=False)
    ax = fig.add_subplot(grid[3, :], sharex=first)
    if log.wind_n is not None:
        ax.plot(
            t,
            log.air[:, 0] - implied_air(log, log.wind_n)[:, 0],
            color=LOGGED,
            lw=0.9,
            label="read − |v − W|, logged wind",
        )
    read = implied_air(log, tr.wind)[:, 0]
    ax.plot(t, log.air[:, 0] - read, color=EST, lw=1.0, label="read − |v − W|, estimate")
    ax.plot(
        t, log.air[:, 0] - read * (1.0 + tr.probe[:, 0]), color="k", lw=0.7, label="estimate, its scale error taken out"
    )
    ax.axhline(0.0, color="k", lw=0.5)
    ax.set_ylabel("airspeed residual [m/s]")
    ax.set_xlabel("time [s]")
    ax.set_xlim(0.0, float(t[-1]))
    ax.legend(loc="upper right", ncols=3, fontsize=8.5)
    good = np.isfinite(tr.wind).all(axis=1)
    winds = {"triangle": tri[good], "estimate": tr.wind[good]}
    if log.wind_n is not None:
        winds["logged"] = log.wind_n[good]
    psd = spectra(log, winds)
    style = {"triangle": (TRI, 0.9), "estimate": (EST, 1.3), "logged": (LOGGED, 1.2)}
    for i in range(3):
        ax = fig.add_subplot(grid[4, i])
        for name, (f, s) in psd.items():
            if float(s[:, i].max()) > 0.0:
                ax.loglog(f, s[:, i], color=style[name][0], lw=style[name][1], label=name)
        f, s = psd["estimate"]
        k = (f > 0.2) & (f < 2.0)
        c = np.exp(np.mean(np.log(s[k, i]) + 5.0 / 3.0 * np.log(f[k])))
        band = np.array([0.15, 8.0])
        ax.loglog(band, 2.5 * c * band ** (-5.0 / 3.0), "k--", lw=0.9, label="slope −5/3")
        ax.set_ylim(1e-6, 1e2)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel("PSD [m²/s²/Hz]" if i == 0 else "")
        ax.set_title(f"wind {NAMES[i]}", fontsize=10)
        ax.legend(fontsize=8, loc="lower left")
    for a in fig.axes:
        a.grid(True, which="major", color="#dddddd", lw=0.5)
    fig.suptitle(f"{log.name}: wind from air data, attitude and ground velocity; no independent truth", fontsize=12)
    fig.savefig(path)
    plt.close(fig)
