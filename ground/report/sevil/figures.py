"""Figures of the air-data report that other reports do not have; each function returns the PNG's bytes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.patches import Circle
from scipy.stats import ncx2

from ground.report.figures import SPARE, TRUTH, Array, new_figure, png_bytes

COLORS = {
    "A11": "#d1581b", "A15": "#b8860b", "abs": "#8b949e", "diff": "#1f5fa8", "joint": "#7b4bb0",
    "diff_prior": "#6b4c3b", "joint_gust": "#1a9a95",
    "ml": "#5b8c2a", "fixed": "#d1581b", "augmented": "#1a9a95", "height": "#1f5fa8",
    "V": "#1f5fa8", "beta": "#d1581b", "alpha": "#5b8c2a",
}  # fmt: skip
GREEK = {"V": "V", "beta": "sideslip", "alpha": "incidence"}


def error_maps(points: Array, found: Mapping[str, Array], labels: Mapping[str, str]) -> bytes:
    """Position error over the y-z grid: points [n,2] m, estimates [n,2] m by estimator (NaN: none, drawn as crosses)."""
    fig, axes = new_figure(13.2, 3.9, 1, len(found), sharey=True, sharex=True)
    picture: Any = None
    for ax, (name, est) in zip(axes[0], found.items(), strict=True):
        e = np.hypot(*(est - points).T)
        have = np.isfinite(e)
        ax.scatter(*points[~have].T, s=9, marker="x", color="#b9c1c9", lw=0.8)
        picture = ax.scatter(
            *points[have].T, c=np.maximum(e[have], 1e-4), s=14, cmap="viridis", norm=LogNorm(0.01, 5.0), lw=0
        )
        ax.plot(0.0, 8.5, marker="+", ms=12, color="#b3261e", mew=1.6)
        ax.set_title(f"{labels.get(name, name)}: {100 * have.mean():.0f} % found", fontsize=9.5, loc="left")
        ax.set_xlabel("y [m]", fontsize=9.5)
    axes[0, 0].set_ylabel("z [m], down", fontsize=9.5)
    axes[0, 0].invert_yaxis()
    fig.colorbar(picture, ax=list(axes[0]), label="error [m]", pad=0.01, extend="both")
    return png_bytes(fig)


def ranking(cases: Mapping[str, Mapping[str, tuple[float, float]]]) -> bytes:
    """Each algorithm's share of points without estimate [%] and cumulative error [m], one panel per case."""
    fig, axes = new_figure(13.2, 4.2, 1, len(cases))
    for ax, (title, values) in zip(axes[0], cases.items(), strict=True):
        at: dict[tuple[float, float], list[str]] = {}
        for name, (none, ce) in values.items():
            at.setdefault((round(none, 1), float(f"{ce:.2g}")), []).append(name)
        for (none, ce), names in at.items():
            ours = names == ["diff"]
            ax.plot(
                none, max(ce, 1e-3), "o", ms=6, color="#1f5fa8" if ours else "#d1581b" if "A11" in names else "#8b949e"
            )
            ax.annotate(", ".join("ML" if n == "diff" else n[1:] for n in names), (none, max(ce, 1e-3)), (4, 3), fontsize=8,
                        textcoords="offset points")  # fmt: skip
        ax.set_yscale("log")
        ax.margins(0.12)
        ax.set_title(title, fontsize=10, loc="left", color="#3a4550")
        ax.set_xlabel("points without a position [%]", fontsize=9.5)
    axes[0, 0].set_ylabel("cumulative error CE [m]", fontsize=9.5)
    return png_bytes(fig)


def track(tr: Mapping[str, Array], name: str, dots: Mapping[str, Array], labels: Mapping[str, str]) -> bytes:
    """Path y, z with a filter and its 2 sigma, and errors enlarged. tr: t [N], true [N,2], "<name>.position" and ".sigma" [N,2];
    dots: estimates [k,2] at tr["second"]."""
    t, true = tr["t"], tr["true"]
    pos, sigma = tr[f"{name}.position"], tr[f"{name}.sigma"]
    fig, axes = new_figure(13.2, 6.2, 2, 2, sharex=True)
    at = np.clip(np.searchsorted(t, tr.get("second", t[:0])), 0, len(t) - 1)
    for i, axis in enumerate("yz"):
        left, right = axes[i]
        left.plot(t, true[:, i], color=TRUTH, lw=1.2, label="true", zorder=4)
        left.plot(t, pos[:, i], color=COLORS.get(name, SPARE[0]), lw=1.1, label=labels.get(name, name), zorder=3)
        for k, (other, est) in enumerate(dots.items()):
            c = COLORS.get(other, SPARE[k])
            left.plot(tr["second"], est[:, i], ".", ms=3, color=c, label=labels.get(other, other), zorder=2)
            right.plot(tr["second"], est[:, i] - true[at, i], ".", ms=3, color=c)
        right.fill_between(t, -2 * sigma[:, i], 2 * sigma[:, i], color="#1f5fa8", alpha=0.18, lw=0, label="2 sigma")
        right.plot(t, pos[:, i] - true[:, i], color=COLORS.get(name, SPARE[0]), lw=0.9)
        span = float(np.nanmax(true[:, i]) - np.nanmin(true[:, i]))
        left.set_ylim(np.nanmin(true[:, i]) - 0.25 * span - 1, np.nanmax(true[:, i]) + 0.25 * span + 1)
        late = sigma[t > 0.6 * t[-1], i]
        right.set_ylim(*(np.array([-1, 1]) * max(4.0, 6.0 * float(np.nanmedian(late)))))
        left.set_ylabel(f"{axis} [m]", fontsize=9.5)
        right.set_ylabel(f"error of {axis} [m]", fontsize=9.5)
    for ax in axes[1]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    handles = axes[0, 0].get_legend_handles_labels()
    band = axes[0, 1].get_legend_handles_labels()
    fig.legend(
        handles[0] + band[0], handles[1] + band[1], loc="outside upper right", ncols=6, frameon=False, fontsize=9
    )
    return png_bytes(fig)


def portrait(tr: Mapping[str, Array], rows: Sequence[tuple[str, str]], threshold: float) -> bytes:
    """Parity residuals with the threshold circle: one row per (detector, label), one column per variable."""
    fig, axes = new_figure(11.5, 3.5 * len(rows), len(rows), 3)
    for line, (name, text) in zip(axes, rows, strict=True):
        for ax, var in zip(line, ("V", "beta", "alpha"), strict=True):
            x, bad = tr[f"{name}.{var}"], tr[f"faulty.{var}"].astype(bool)
            reach = max(6.0, float(np.percentile(np.abs(x), 99.9)) * 1.1)
            ax.plot(*x[~bad].T, ".", ms=2.5, color="#1f5fa8", alpha=0.5, label="no fault")
            ax.plot(*x[bad].T, ".", ms=2.5, color="#d1581b", alpha=0.5, label="faulty probe")
            ax.add_patch(Circle((0, 0), math.sqrt(threshold), fill=False, color="#b3261e", lw=1.5, zorder=5))
            ax.set_xlim(-reach, reach)
            ax.set_ylim(-reach, reach)
            ax.set_aspect("equal")
            ax.set_title(f"{text}, {GREEK[var]}", fontsize=9.5, loc="left", color="#3a4550")
    handles = axes[0, 0].get_legend_handles_labels()
    fig.legend(*handles, loc="outside upper right", ncols=2, frameon=False, fontsize=9, markerscale=4)
    return png_bytes(fig)


def indices(tr: Mapping[str, Array]) -> bytes:
    """Angle index per probe, alarm and probe blamed over time, one column per variable. tr: t [n] s, "angle.<v>" [n,3],
    "alarm.<v>", "suspect.<v>" and "faulty.<v>" [n]."""
    fig, axes = new_figure(13.2, 5.6, 3, 3, sharex=True, sharey="row", height_ratios=(2.2, 0.8, 1.2))
    t = tr["t"]
    for col, var in zip(axes.T, ("V", "beta", "alpha"), strict=True):
        bad = t[tr[f"faulty.{var}"].astype(bool)]
        for ax in col:
            ax.axvspan(bad[0], bad[-1], color="#d1581b", alpha=0.10, lw=0)
        for i, name in enumerate(("nose", "left", "right")):
            col[0].plot(t, tr[f"angle.{var}"][:, i], ".", ms=1.6, color=SPARE[(0, 3, 4)[i]], label=name)
        col[0].set_title(GREEK[var], fontsize=10, loc="left", color="#3a4550")
        col[1].plot(t, tr[f"alarm.{var}"], ".", ms=2, color="#1f5fa8")
        col[2].plot(t, tr[f"suspect.{var}"], ".", ms=2, color="#1f5fa8")
        col[2].set_xlabel("time [s]", fontsize=9.5)
    axes[0, 0].set_ylabel("angle index", fontsize=9.5)
    axes[1, 0].set_ylabel("alarm", fontsize=9.5)
    axes[1, 0].set_yticks((0, 1))
    axes[2, 0].set_ylabel("probe blamed", fontsize=9.5)
    axes[2, 0].set_yticks(range(4), ("none", "nose", "left", "right"))
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3, frameon=False, fontsize=9,
               markerscale=5)  # fmt: skip
    return png_bytes(fig)


def power(points: Mapping[str, Sequence[tuple[float, float, float]]], xlabel: str) -> bytes:
    """True-alarm percentage, measured (dots) and noncentral chi-square (dashed), per variable: (x, measured, theory)."""
    fig, axes = new_figure(13.2, 3.9, 1, len(points), sharey=True)
    for ax, (var, rows) in zip(axes[0], points.items(), strict=True):
        x, got, theory = np.array(sorted(rows)).T
        ax.plot(x, theory, "--", color="#20262e", lw=1.2, label="noncentral chi-square")
        ax.plot(x, got, "o", ms=5, color=COLORS[var], label="measured")
        ax.set_title(GREEK[var], fontsize=10, loc="left", color="#3a4550")
        ax.set_xlabel(xlabel, fontsize=9.5)
    axes[0, 0].set_ylabel("true alarms [%]", fontsize=9.5)
    axes[0, 0].set_ylim(-3, 103)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False, fontsize=9)
    return png_bytes(fig)


def roc(curves: Sequence[tuple[str, Mapping[str, Array]]], var: str = "V") -> bytes:
    """True against false alarms, measured and theory, one curve per (label, traces of a sweep case)."""
    fig, axes = new_figure(8.5, 4.6, 1, 1)
    ax = axes[0, 0]
    p = np.logspace(-6, 0, 121)
    for k, (text, tr) in enumerate(curves):
        c = SPARE[k % len(SPARE)]
        lam = float(tr[f"{var}.lambda"][0])
        theory = p if lam == 0.0 else ncx2.sf(-2.0 * np.log(p), 2, lam)
        ax.plot(100 * p, 100 * theory, "--", color=c, lw=1)
        seen = tr[f"{var}.fap"] >= 1e-3  # fewer false alarms say little in one run
        ax.plot(100 * tr[f"{var}.fap"][seen], 100 * tr[f"{var}.tap"][seen], ".", ms=5, color=c, label=text)
    ax.set_xscale("log")
    ax.set_xlim(1e-3, 100)
    ax.set_xlabel("false alarms per sample [%]", fontsize=9.5)
    ax.set_ylabel("true alarms [%]", fontsize=9.5)
    fig.legend(*ax.get_legend_handles_labels(), loc="outside right center", frameon=False, fontsize=9)
    return png_bytes(fig)


def exclusions(tr: Mapping[str, Array]) -> bytes:
    """Faulty (grey) and excluded (blue) channels over time, and the position error beside the filter's without exclusion."""
    fig, axes = new_figure(13.2, 5.2, 2, 1, sharex=True)
    top, bottom = axes[:, 0]
    t = tr["t"]
    if np.any(tr["faulty"] != 0):
        at = t[tr["faulty"] != 0]
        bottom.set_xlim(max(t[0], at[0] - 40.0), min(t[-1], at[-1] + 60.0))
    names = [f"{v} {q}" for v in ("V", "beta", "alpha") for q in ("nose", "left", "right")]
    for c in range(9):
        for key, color, size in (("faulty", "#c9d0d7", 9), ("excluded", "#1f5fa8", 4)):
            on = (tr[key].astype(int) >> c) & 1 == 1
            top.plot(t[on], np.full(int(on.sum()), c), "|", ms=size, color=color, label=key if c == 0 else None)
    top.plot([], [], "s", color="#c9d0d7", label="faulty")
    top.plot([], [], "s", color="#1f5fa8", label="excluded")
    top.set_yticks(range(9), names, fontsize=8)
    top.set_ylim(8.6, -0.6)
    for name, color, text in (("with_fdi", "#1f5fa8", "with exclusion"), ("without_fdi", "#d1581b", "without")):
        e = np.hypot(*(tr[f"{name}.position"] - tr["true"]).T)
        bottom.plot(t, e, color=color, lw=1.0, label=text)
    bottom.set_yscale("log")
    bottom.set_ylim(0.02, 60)
    bottom.set_ylabel("position error [m]", fontsize=9.5)
    bottom.set_xlabel("time [s]", fontsize=9.5)
    handles = dict(zip(*reversed(top.get_legend_handles_labels()), strict=True))
    handles |= dict(zip(*reversed(bottom.get_legend_handles_labels()), strict=True))
    fig.legend(list(handles.values()), list(handles), loc="outside upper right", ncols=4, frameon=False, fontsize=9)
    return png_bytes(fig)
