"""Figures of the rendezvous report; each function returns the PNG's bytes. Lengths come in as NM unless a name says otherwise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, Rectangle

from ground.report.figures import SPARE, TRUTH, Array, Point, mark_lost, new_figure, png_bytes

NM = 1852.0
OURS, PRINT = "#1f5fa8", "#d1581b"


@dataclass(frozen=True)
class Cloud:
    """Misses of one case [n,2] (x, y_T - y); our mean and sigma per axis; the print and the 95 % band of tables of thirty.

    printed: mean, sigma of x, mean, sigma of y, None where not printed. mean_band, sigma_band: (lo, hi) of x, of y.
    """

    title: str
    miss: Array
    mean: tuple[float, float]
    sigma: tuple[float, float]
    printed: tuple[float, float, float, float] | None = None
    mean_band: tuple[tuple[float, float], tuple[float, float]] | None = None
    sigma_band: tuple[tuple[float, float], tuple[float, float]] | None = None


def _ring(ax: Axes, c: Cloud) -> None:
    """Between the one-sigma ellipses of the least and the largest sigma a table of thirty may show."""
    if c.sigma_band is None or c.mean_band is None:
        return
    (xl, xh), (yl, yh) = c.sigma_band
    a = np.linspace(0.0, 2.0 * math.pi, 121)
    co, si = np.cos(a), np.sin(a)
    outer = np.column_stack([c.mean[0] + xh * co, c.mean[1] + yh * si])
    inner = np.column_stack([c.mean[0] + xl * co, c.mean[1] + yl * si])[::-1]
    label = "sigma of 95 % of tables of 30"
    ax.fill(*np.vstack([outer, inner]).T, color=OURS, alpha=0.22, lw=0, zorder=2, label=label)
    (a0, a1), (b0, b1) = c.mean_band
    box = Rectangle((a0, b0), a1 - a0, b1 - b0, fill=False, ls="--", lw=1.3, color=TRUTH, zorder=5)
    box.set_label("mean of 95 % of tables of 30")
    ax.add_patch(box)


def clouds(panels: Sequence[Cloud], reach: float = 4.0) -> bytes:
    """Roll-out misses with our and the printed one-sigma ellipse and where tables of thirty runs fall."""
    cols = 4
    rows = -(-len(panels) // cols)
    fig, axes = new_figure(13.2, 3.6 * rows + 0.4, rows, cols, sharex=True, sharey=True)
    for ax, c in zip(axes.flat, panels, strict=False):
        ax.plot(*c.miss.T, ".", ms=1.8, color="#8b949e", alpha=0.5, zorder=1, label="our misses")
        _ring(ax, c)
        both = [(c.mean, c.sigma, OURS, "ours: mean, one sigma")]
        if c.printed is not None:
            mx, sx, my, sy = c.printed
            both.append(((mx, my), (sx, sy), PRINT, "printed: mean, one sigma"))
        for mean, sigma, color, text in both:
            e = Ellipse(mean, 2.0 * sigma[0], 2.0 * sigma[1], fill=False, lw=1.7, color=color, zorder=6, label=text)
            ax.add_patch(e)
            ax.plot(*mean, "+", ms=8, mew=1.7, color=color, zorder=7)
        ax.set_title(c.title, fontsize=9.5, loc="left", color="#3a4550")
        ax.set_xlim(-reach, reach)
        ax.set_ylim(-reach, reach)
        ax.set_aspect("equal")
    for ax in axes.flat[len(panels) :]:
        ax.set_visible(False)
    for ax in axes[-1]:
        ax.set_xlabel("x [NM], tanker too far ahead", fontsize=9)
    for ax in axes[:, 0]:
        ax.set_ylabel("y [NM], as printed", fontsize=9)
    handles: dict[str, Any] = {}
    for ax in axes.flat:
        handles |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    fig.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    return png_bytes(fig)


def gains(series: Mapping[str, Mapping[str, Sequence[Point]]]) -> bytes:
    """RMS of x and y against the gain k: {name: {"x": points, "y": points}}, logarithmic."""
    fig, axes = new_figure(13.2, 4.2, 1, 2)
    style = {"guarded": (OURS, "o-"), "without guard": ("#7b4bb0", "s--"), "printed (30 runs)": (PRINT, "D")}
    for ax, axis in zip(axes[0], "xy", strict=True):
        for i, (name, both) in enumerate(series.items()):
            pts = sorted(both.get(axis, ()), key=lambda p: p.x)
            color, fmt = style.get(name, (SPARE[i], "^-"))
            y = np.array([p.y for p in pts])
            lo, hi = (
                np.array([p.y if v is None else v for p, v in ((q, getattr(q, a)) for q in pts)]) for a in ("lo", "hi")
            )
            bar = np.maximum(np.vstack([y - lo, hi - y]), 0.0)
            ax.errorbar([p.x for p in pts], y, bar, fmt=fmt, color=color, ms=5, lw=1.6, capsize=2.5, label=name)
            mark_lost(ax, [p.x for p in pts if math.isnan(p.y)], color)
        ax.set_yscale("log")
        ax.set_ylim(0.2, 15.0)
        ax.set_yticks([0.2, 0.5, 1, 2, 5, 10], ["0.2", "0.5", "1", "2", "5", "10"])
        ax.set_xlabel("gain k", fontsize=9.5)
        ax.set_ylabel(f"RMS of {axis} [NM]", fontsize=9.5)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3, frameon=False, fontsize=9)
    return png_bytes(fig)


def consistency(series: Mapping[str, Sequence[Point]], chi_square: tuple[float, float]) -> bytes:
    """Mean NEES/3 over time with intervals; the chi-square band of the mean and the wanted 0.9 to 1.1."""
    fig, axes = new_figure(13.2, 4.6, 1, 1)
    ax = axes[0, 0]
    ax.axhspan(0.9, 1.1, color="#1b7a43", alpha=0.22, lw=0, label="wanted: 0.9 to 1.1")
    ax.axhspan(*chi_square, color="#20262e", alpha=0.28, lw=0, label="chi-square, 95 % of the mean")
    colors = (PRINT, "#b8860b", "#7b4bb0", "#1a9a95", OURS, "#5b8c2a", "#8b949e")
    for i, (name, pts) in enumerate(series.items()):
        t = [p.x for p in pts]
        y = np.array([p.y for p in pts])
        c = colors[i % len(colors)]
        ax.plot(t, y, "o-", ms=3, lw=1.4, color=c, label=name)
        ax.fill_between(t, [p.lo or p.y for p in pts], [p.hi or p.y for p in pts], color=c, alpha=0.2, lw=0)
    ax.set_yscale("log")
    ax.set_yticks([0.5, 1, 2, 5, 10, 20, 50, 100], ["0.5", "1", "2", "5", "10", "20", "50", "100"])
    ax.set_xlabel("time since the first range [s]", fontsize=9.5)
    ax.set_ylabel("mean NEES / 3", fontsize=9.5)
    fig.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    return png_bytes(fig)


def sigmas(series: Mapping[str, Mapping[str, Sequence[tuple[float, float, float]]]]) -> bytes:
    """Actual (full) and predicted (dashed) sigma over time: {filter: {"x", "vx", "y": [(t, actual, predicted)]}}; NM, kn."""
    fig, axes = new_figure(13.2, 3.9, 1, 3)
    names = {"x": "sigma of x [NM]", "vx": "sigma of the speed along track [kn]", "y": "sigma of y [NM]"}
    for ax, (key, text) in zip(axes[0], names.items(), strict=True):
        for i, (name, parts) in enumerate(series.items()):
            if not parts.get(key):
                continue
            t, actual, said = np.array(parts[key]).T
            c = (PRINT, OURS, "#5b8c2a")[i % 3]
            ax.plot(t, actual, "-", lw=1.7, color=c, label=f"{name}: actual")
            ax.plot(t, said, "--", lw=1.3, color=c, label=f"{name}: predicted")
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel(text, fontsize=9.5)
        ax.set_xlabel("time since the first range [s]", fontsize=9.5)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=4, frameon=False, fontsize=9)
    return png_bytes(fig)


def _density(tr: Mapping[str, Array], k: int, gx: Array, gy: Array) -> Array:
    """Posterior density of (x, y) [NM^-2] at snapshot k on the grid."""
    out = np.zeros_like(gx)
    for w, m, C in zip(tr["weight"][k], tr["at"][k] / NM, tr["cov"][k] / NM**2, strict=True):
        if w < 1e-9:
            continue
        C = C + np.eye(2) * 1e-6
        dx, dy = gx - m[0], gy - m[1]
        det = C[0, 0] * C[1, 1] - C[0, 1] ** 2
        q = (C[1, 1] * dx * dx - 2.0 * C[0, 1] * dx * dy + C[0, 0] * dy * dy) / det
        out += w / (2.0 * math.pi * math.sqrt(det)) * np.exp(-0.5 * q)
    return out


def _region(tr: Mapping[str, Array], k: int) -> tuple[Array, Array]:
    """Middle and half widths (x, y) [NM] of what the posterior covers at snapshot k."""
    keep = tr["weight"][k] > 1e-4
    at, C = tr["at"][k][keep] / NM, tr["cov"][k][keep] / NM**2
    s = 3.2 * np.sqrt(np.stack([C[:, 0, 0], C[:, 1, 1]], axis=1))
    lo, hi = (at - s).min(0), (at + s).max(0)
    return 0.5 * (lo + hi), 0.55 * (hi - lo)


def _posterior(ax: Axes, tr: Mapping[str, Array], k: int, middle: Array, half: Array) -> None:
    x, y = (np.linspace(m - h, m + h, 301) for m, h in zip(middle, half, strict=True))
    gx, gy = np.meshgrid(x, y)
    d = _density(tr, k, gx, gy)
    order = np.sort(d.ravel())[::-1]
    mass = np.cumsum(order) / order.sum()
    levels = sorted({float(order[min(int(np.searchsorted(mass, q)), len(order) - 1)]) for q in (0.99, 0.95, 0.68)})
    if len(levels) == 3:
        ax.contourf(gx, gy, d, levels=[*levels, float(d.max()) * 1.01], colors=["#c9dcf0", "#86b0dc", OURS], alpha=0.85)


def plan_view(tr: Mapping[str, Array], title: str) -> bytes:
    """One rendezvous from above: both tracks with the times of the snapshots, and below them the posterior, axes stretched."""
    track, snap = tr["track"], tr["snap"]
    fig, axes = new_figure(13.2, 8.2, 2, len(snap), gridspec_kw={"height_ratios": [1.15, 1.0]})
    for ax in axes[0]:
        ax.remove()
    top = fig.add_subplot(axes[0, 0].get_gridspec()[0, :])
    top.grid(True, color="#e3e7eb", lw=0.7)
    top.set_axisbelow(True)
    turning = track[:, 5] > 0
    top.plot(track[:, 1] / NM, track[:, 2] / NM, color=TRUTH, lw=1.6, label="receiver")
    top.plot(track[:, 3] / NM, track[:, 4] / NM, color=OURS, lw=1.6, label="tanker, approach")
    top.plot(track[turning, 3] / NM, track[turning, 4] / NM, color="#7b4bb0", lw=2.6, label="tanker, turn")
    top.plot(track[:, 6] / NM, track[:, 7] / NM, color=PRINT, lw=1.0, label="estimate of the receiver")
    for k, s in enumerate(snap):
        middle, half = _region(tr, k)
        _posterior(top, tr, k, middle, half)
        for x, y in ((s[2], s[3]), (s[4], s[5])):
            top.plot(x / NM, y / NM, "o", ms=5, color="#20262e", mfc="white", zorder=6)
            top.annotate(f"{s[0]:.0f} s", (x / NM, y / NM), (4, 6), textcoords="offset points", fontsize=8)
    top.set_aspect("equal", adjustable="datalim")
    top.set_title(title, fontsize=10, loc="left", color="#3a4550")
    top.set_xlabel("x [NM], to the initial point", fontsize=9.5)
    top.set_ylabel("y [NM]", fontsize=9.5)
    top.legend(loc="upper right", ncols=4, frameon=False, fontsize=8.5)
    for k, (ax, s) in enumerate(zip(axes[1], snap, strict=True)):
        middle, half = _region(tr, k)
        _posterior(ax, tr, k, middle, half)
        h = math.sqrt(max(s[1] ** 2 - 304.8**2, 0.0)) / NM
        a = np.linspace(-math.pi, math.pi, 20001)
        ax.plot(s[2] / NM + h * np.cos(a), s[3] / NM + h * np.sin(a), color=PRINT, lw=1.2, ls="--", label="range ring")
        ax.plot(s[4] / NM, s[5] / NM, "x", ms=8, mew=2, color="#b3261e", zorder=6, label="receiver")
        ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
        ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
        ax.set_title(f"{s[0]:.0f} s: posterior 68, 95, 99 %", fontsize=9.5, loc="left", color="#3a4550")
        ax.set_xlabel("x [NM]", fontsize=9)
    axes[1, 0].set_ylabel("y [NM]", fontsize=9)
    axes[1, 0].legend(loc="best", frameon=False, fontsize=8.5)
    return png_bytes(fig)


def detection(panels: Sequence[tuple[str, Mapping[str, Sequence[Point]], str]]) -> bytes:
    """Share of rendezvous with a warning [%] against the size of the receiver's manoeuvre: (title, series, x label)."""
    fig, axes = new_figure(13.2, 4.0, 1, len(panels), sharey=True)
    for ax, (title, series, xlabel) in zip(axes[0], panels, strict=True):
        for i, (name, pts) in enumerate(series.items()):
            pts = sorted(pts, key=lambda p: p.x)
            y = np.array([100.0 * p.y for p in pts])
            bar = np.array([[100.0 * (p.y - (p.lo or 0.0)), 100.0 * ((p.hi or p.y) - p.y)] for p in pts]).T
            c = (PRINT, OURS)[i % 2]
            ax.errorbar(
                [p.x for p in pts], y, np.maximum(bar, 0.0), fmt="o-", color=c, ms=5, lw=1.6, capsize=2.5, label=name
            )
        ax.set_title(title, fontsize=10, loc="left", color="#3a4550")
        ax.set_xlabel(xlabel, fontsize=9.5)
        ax.set_ylim(-3, 103)
    axes[0, 0].set_ylabel("rendezvous with a warning [%]", fontsize=9.5)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False, fontsize=9)
    return png_bytes(fig)


def tracks(tr: Mapping[str, Array]) -> bytes:
    """Plan view of two flights of one rendezvous: "six.track", "kin.track" [N,7]: t, tanker x y, receiver x y, estimate [m]."""
    fig, axes = new_figure(13.2, 4.6, 1, 1)
    ax = axes[0, 0]
    for key, style, text in (("six.track", "-", "6-DOF"), ("kin.track", "--", "kinematic")):
        t = tr[key] / NM
        ax.plot(t[:, 3], t[:, 4], style, color=TRUTH, lw=1.3, label=f"receiver, {text}")
        ax.plot(t[:, 1], t[:, 2], style, color=OURS if style == "-" else PRINT, lw=1.8, label=f"tanker, {text}")
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [NM], to the initial point", fontsize=9.5)
    ax.set_ylabel("y [NM]", fontsize=9.5)
    ax.legend(loc="upper right", ncols=2, frameon=False, fontsize=8.5)
    return png_bytes(fig)
