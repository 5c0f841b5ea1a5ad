"""Figures of campaign reports, drawn with matplotlib off screen; each function returns the PNG's bytes.

Angles and percentages are for the reader; everything that comes in is SI and radians unless its name says otherwise.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from PIL import Image

from ground.geometry import wrap

Array = NDArray[np.float64]
Bar = tuple[float, float | None, float | None] | str | None  # value and interval, why there is none, nothing known
ALL_LOST = "lost in all runs"
DPI = 130
LAYOUT: Literal["constrained"] | None = "constrained"  # how axes share the figure, in half of the time a figure takes
TRUTH = "#20262e"
COLORS = {
    "default": "#1f5fa8", "printed": "#d1581b", "cmw": "#8b949e", "measured": "#8b949e", "true": "#20262e",
    "no_aero": "#5b8c2a", "hybrid": "#7b4bb0", "no_velocity": "#1a9a95", "coloured_scaled": "#1a9a95",
    "coloured_removed": "#b8860b", "coloured_augmented": "#7b4bb0", "ignored": "#c2417f",
}  # fmt: skip
SPARE = ("#b8860b", "#c2417f", "#5b8c2a", "#7b4bb0", "#1a9a95", "#6b4c3b", "#3c6e71", "#a33b20")
MARKERS = "os^Dv<>Ph*"
AXIS_NAMES = ("north", "east", "down")
ZOOM_S = 20.0  # [s] of the start shown enlarged


@dataclass(frozen=True)
class Point:
    """One point of a sweep: x, value, its 95 % interval, share of runs that lost the position (closed loop). All lost: NaN."""

    x: float
    y: float
    lo: float | None = None
    hi: float | None = None
    lost: float = 0.0


def color(name: str, order: Sequence[str] = ()) -> str:
    """The colour of a filter or controller: the same in every figure."""
    base = name.split(" ")[0]
    if base in COLORS:
        return COLORS[base]
    others = [n for n in order if n.split(" ")[0] not in COLORS]
    return SPARE[others.index(name) % len(SPARE)] if name in others else SPARE[0]


def new_figure(width: float, height: float, rows: int, cols: int, **kw: Any) -> tuple[Figure, Any]:
    """An empty figure of width x height inches with rows x cols axes in the reports' style; kw as plt.subplots."""
    fig = Figure(figsize=(width, height), layout=LAYOUT)
    axes = fig.subplots(rows, cols, squeeze=False, **kw)
    for ax in axes.flat:
        ax.grid(True, color="#e3e7eb", lw=0.7)
        ax.set_axisbelow(True)
        ax.margins(x=0.012)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8.5, color="#9aa4ae")
    return fig, axes


def png_bytes(fig: Figure) -> bytes:
    """The figure as a palette PNG."""
    fig.set_dpi(DPI)
    canvas = FigureCanvasAgg(fig)
    canvas.draw()  # once; savefig would lay out and draw everything twice
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    out = io.BytesIO()
    # a palette: a third of the size, and the page holds some twenty of them
    picture.quantize(160, dither=Image.Dither.NONE).save(out, format="png", optimize=True)
    return out.getvalue()


def _limits(ax: Axes, *arrays: Array) -> None:
    """Limits that show the bulk: a transient of the first seconds must not flatten the rest."""
    x = np.concatenate([a[np.isfinite(a)] for a in arrays])
    if len(x):
        lo, hi = np.percentile(x, [0.5, 99.5])
        pad = 0.18 * (hi - lo) + 1e-3
        ax.set_ylim(lo - pad, hi + pad)


def wind_components(tr: Mapping[str, Array], actors: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """Wind N, E, D: truth and estimates; errors within their 3-sigma bounds; the same enlarged at the start.

    tr: t [N] s, wind_true [N,3] m/s, "<actor>.wind" [N,3] m/s, "<actor>.sigma" [N,3] m/s (optional).
    """
    t, truth = tr["t"], tr["wind_true"]
    fig, axes = new_figure(13.2, 7.4, 3, 3, gridspec_kw={"width_ratios": [1.25, 1.25, 0.6]}, sharex="col")
    start = t <= t[0] + ZOOM_S
    for i in range(3):
        left, mid, right = axes[i]
        for z, a in enumerate(reversed(actors)):
            w, c, lw = tr[f"{a}.wind"][:, i], color(a, actors), 1.0 if a == "default" else 0.7
            left.plot(t, w, color=c, lw=lw, alpha=0.85, zorder=3 + z, label=labels.get(a, a))
            for ax, sel in ((mid, slice(None)), (right, start)):
                ax.plot(t[sel], (w - truth[:, i])[sel], color=c, lw=lw, zorder=3 + z)
            if f"{a}.sigma" in tr:
                s = 3.0 * tr[f"{a}.sigma"][:, i]
                for ax, sel in ((mid, slice(None)), (right, start)):
                    if a == "default":
                        ax.fill_between(t[sel], -s[sel], s[sel], color=c, alpha=0.16, lw=0, zorder=1)
                    else:
                        ax.plot(t[sel], s[sel], t[sel], -s[sel], color=c, lw=0.9, ls=(0, (4, 2)), alpha=0.9, zorder=2)
        left.plot(t, truth[:, i], color=TRUTH, lw=1.0, zorder=9, label="true wind")
        left.set_ylabel(f"{AXIS_NAMES[i]} [m/s]", fontsize=9.5)
        _limits(left, truth[:, i], tr[f"{actors[0]}.wind"][:, i])
        late = t > t[0] + ZOOM_S
        _limits(mid, *[(tr[f"{a}.wind"][:, i] - truth[:, i])[late if late.any() else start] for a in actors])
        lo, hi = mid.get_ylim()
        right.set_ylim(2.5 * min(lo, -hi), 2.5 * max(hi, -lo))
        mid.axhline(0, color="#9aa4ae", lw=0.7)
    for ax, title in zip(
        axes[0], ("wind", "estimate - truth, with 3-sigma bounds", f"first {ZOOM_S:.0f} s"), strict=True
    ):
        ax.set_title(title, fontsize=10, loc="left", color="#3a4550")
    for ax in axes[2]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    fig.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper right", ncols=5, frameon=False, fontsize=9)
    return png_bytes(fig)


def errors_over_time(
    tr: Mapping[str, Array], actors: Sequence[str], labels: Mapping[str, str], bound_pct: float | None
) -> bytes:
    """Relative error of wind magnitude [%] and error of horizontal wind direction [deg] over time."""
    t, truth = tr["t"], tr["wind_true"]
    size, angle = np.linalg.norm(truth, axis=1), np.arctan2(truth[:, 1], truth[:, 0])
    fig, axes = new_figure(13.2, 4.4, 2, 1, sharex=True)
    top, bottom = axes[:, 0]
    pct, deg = [], []
    late = t > t[0] + ZOOM_S if (t > t[0] + ZOOM_S).any() else np.ones(len(t), bool)
    for z, a in enumerate(reversed(actors)):
        w = tr[f"{a}.wind"]
        p = 100.0 * (np.linalg.norm(w, axis=1) - size) / np.where(size > 0, size, np.nan)
        d = np.degrees(wrap(np.arctan2(w[:, 1], w[:, 0]) - angle))
        lw = 1.1 if a == "default" else 0.8
        top.plot(t, p, color=color(a, actors), lw=lw, zorder=3 + z, label=labels.get(a, a))
        bottom.plot(t, d, color=color(a, actors), lw=lw, zorder=3 + z)
        pct.append(p[late])
        deg.append(d[late])
    if bound_pct is not None:
        for s in (-1, 1):
            top.axhline(s * bound_pct, color="#b3261e", lw=1.0, ls="--", label="printed claim" if s > 0 else None)
        pct.append(np.array([-bound_pct, bound_pct]))
    _limits(top, *pct)
    _limits(bottom, *deg)
    top.set_ylabel("magnitude error [%]", fontsize=9.5)
    bottom.set_ylabel("direction error [deg]", fontsize=9.5)
    bottom.set_xlabel("time [s]", fontsize=9.5)
    fig.legend(*top.get_legend_handles_labels(), loc="outside upper right", ncols=6, frameon=False, fontsize=9)
    return png_bytes(fig)


def sweep(
    panels: Sequence[tuple[str, Mapping[str, Sequence[Point]]]],
    xlabel: str,
    labels: Mapping[str, str],
    limit: tuple[float, str] | None = None,
    ceiling: float | None = None,
) -> bytes:
    """Values against a swept parameter, one panel each: (title, {series: points}), with 95 % intervals.

    limit: a horizontal line and its name. ceiling: values above it are drawn at it as arrows (lost runs have no finite scale).
    """
    fig, axes = new_figure(13.2, 4.3, 1, len(panels), sharey=ceiling is not None)
    names = list(dict.fromkeys(n for _, series in panels for n in series))
    for ax, (title, series) in zip(axes[0], panels, strict=True):
        xs = sorted({p.x for pts in series.values() for p in pts})
        ys = [p.y for pts in series.values() for p in pts if p.y > 0]
        log_x = len(xs) > 2 and xs[0] > 0 and xs[-1] / xs[0] > 10
        if log_x:
            ax.set_xscale("log")
        if ceiling is None and ys and max(ys) / min(ys) > 30:
            ax.set_yscale("log")
        for name, pts in series.items():
            _line(ax, sorted(pts, key=lambda p: p.x), name, names, labels, ceiling)
        if limit is not None:
            ax.axhline(limit[0], color="#b3261e", lw=1.0, ls="--")
            ax.annotate(
                limit[1], (0.01, limit[0]), xycoords=("axes fraction", "data"), fontsize=8, color="#b3261e", va="bottom"
            )
        if ceiling is not None:
            ax.set_ylim(0, ceiling * 1.04)
        elif ax.get_yscale() == "linear":
            ax.set_ylim(bottom=0)
        if len(xs) <= 12:
            ax.set_xticks(xs, [f"{x:g}" for x in xs], fontsize=8.5)
            ax.set_xticks([], minor=True)
        ax.set_title(title, fontsize=10, loc="left", color="#3a4550")
        ax.set_xlabel(xlabel, fontsize=9.5)
    handles: dict[str, Any] = {}
    for ax in axes[0]:
        handles.update(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    fig.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    return png_bytes(fig)


def _line(
    ax: Axes, pts: Sequence[Point], name: str, names: Sequence[str], labels: Mapping[str, str], ceiling: float | None
) -> None:
    c, marker = color(name, names), MARKERS[list(names).index(name) % len(MARKERS)]
    top = np.inf if ceiling is None else ceiling
    x, y = np.array([p.x for p in pts]), np.array([np.minimum(p.y, top) for p in pts])
    lo = np.array([min(p.y if p.lo is None else p.lo, top) for p in pts])
    hi = np.array([min(p.y if p.hi is None else p.hi, top) for p in pts])
    bars = np.maximum(np.vstack([y - lo, hi - y]), 0)
    style = "--" if " " in name else "-"
    label = labels.get(name, name)
    ax.errorbar(x, y, bars, color=c, marker=marker, ms=4.5, lw=1.6, ls=style, capsize=2.5, elinewidth=1, label=label)
    above = [p for p in pts if p.y > top]
    if above:
        ax.plot([p.x for p in above], [top] * len(above), ls="", marker="^", ms=9, color=c, clip_on=False)
    mark_lost(ax, [p.x for p in pts if np.isnan(p.y)], c)
    for k, p in enumerate(q for q in pts if q.lost > 0 and not np.isnan(q.y)):
        where, last = (p.x, min(p.y, top)), p.x == pts[-1].x and len(pts) > 1
        text, at = f"{100 * p.lost:.0f} % lost", (-5 if last else 5, -12 - 10 * (k % 2))
        side = "right" if last else "left"
        ax.annotate(text, where, at, textcoords="offset points", ha=side, fontsize=7.5, color=c)


def mark_lost(ax: Axes, at: Sequence[float], colour: str) -> None:
    """Crosses at the upper edge over the x where all runs were lost: there is no value, and it is not left out."""
    if len(at):
        top = ax.get_xaxis_transform()
        ax.plot(at, [0.97] * len(at), ls="", marker="x", ms=8, mew=2.2, color=colour, transform=top, clip_on=False)
        for x in at:
            ax.annotate(
                ALL_LOST, (x, 0.93), xycoords=top, rotation=90, ha="center", va="top", fontsize=7.5, color=colour
            )


def bars(
    groups: Sequence[str],
    series: Mapping[str, Sequence[Bar]],
    ylabel: str,
    labels: Mapping[str, str],
    targets: Sequence[float | None] = (),
) -> bytes:
    """Grouped bars with 95 % intervals. series: per group (value, lo, hi), None, or why there is no value, written in the bar's
    place; targets: a tick per group."""
    fig, axes = new_figure(13.2, 3.9, 1, 1)
    ax = axes[0, 0]
    width = 0.8 / max(1, len(series))
    for j, (name, values) in enumerate(series.items()):
        x = np.arange(len(groups)) - 0.4 + width * (j + 0.5)
        for xi, v in zip(x, values, strict=True):
            if v is None:
                continue
            if isinstance(v, str):
                note = ax.annotate(
                    v, (xi, 0.0), (0, 4), textcoords="offset points", rotation=90, ha="center", va="bottom"
                )
                note.set(color=color(name, list(series)), fontsize=7.5, zorder=6)
                continue
            y, lo, hi = v
            ax.bar(xi, y, width * 0.92, color=color(name, list(series)), zorder=2)
            if lo is not None and hi is not None:
                ax.errorbar(xi, y, [[max(y - lo, 0)], [max(hi - y, 0)]], color="#20262e", capsize=2, elinewidth=1, lw=0)
            text = f"{y:.2g}" if y < 10 else f"{y:.0f}"
            note = ax.annotate(text, (xi, max(y, hi or y)), (0, 3), textcoords="offset points", ha="center", fontsize=8)
            note.set(color="#20262e", zorder=6, path_effects=[withStroke(linewidth=2.5, foreground="white")])
        ax.bar(0, 0, color=color(name, list(series)), label=labels.get(name, name))
    drawn = False
    for i, target in enumerate(targets):
        if target is not None:
            ax.plot(
                [i - 0.44, i + 0.44],
                [target, target],
                color="#b3261e",
                lw=1.4,
                ls="--",
                zorder=4,
                label=None if drawn else "target",
            )
            drawn = True
    tops = sorted(v[0] for vs in series.values() for v in vs if v is not None and not isinstance(v, str))
    if tops and tops[-1] > 8 * tops[len(tops) // 2]:
        ax.set_yscale("symlog", linthresh=max(tops[len(tops) // 2], 1e-3))
    ax.set_xticks(range(len(groups)), groups, fontsize=9)
    ax.set_ylabel(ylabel, fontsize=9.5)
    ax.grid(False, axis="x")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper right", ncols=8, frameon=False, fontsize=9)
    return png_bytes(fig)
