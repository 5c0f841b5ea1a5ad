"""Stanford plot of a run: protection level over true error, one panel for each of the tanker's axes (Tossaint et al. 2007)."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from ground.columns import Columns
from ground.report.figures import DPI, LAYOUT
from ground.views.refueling.integrity import Judged, judge

BINS = 60
SPAN = 1.15  # [-] of the largest finite value, so that nothing lies on the edge
MOST_M = 20.0  # [m] an axis shows; what is beyond is drawn at its edge
AXES = ("along x", "lateral y", "vertical z")


@dataclass(frozen=True)
class Theme:
    """Colours of the page: paper, ink, soft ink, grid, the bad, the few and the many of a count."""

    paper: str
    ink: str
    soft: str
    grid: str
    bad: str
    few: str
    many: str


LIGHT = Theme("#ffffff", "#20262e", "#5b6772", "#e3e7eb", "#b3261e", "#a9c8e8", "#123a6b")
DARK = Theme("#12171c", "#e4e8ec", "#9aa7b3", "#2a323a", "#f0867d", "#2f567f", "#b9dcff")


def stanford(truth: Columns, tlm: Columns, *, dark: bool = False) -> bytes | None:
    """PNG of the run's protection levels [m] over its true errors [m], with the alert limits met as lines; None without samples.

    Below the diagonal a level is misleading; within the dashed square all is well. Samples without a level are counted alone.
    """
    j = judge(truth, tlm)
    if j is None or not len(j.t_us):
        return None
    theme = DARK if dark else LIGHT
    fig = Figure(figsize=(13.2, 5.2), layout=LAYOUT, facecolor=theme.paper)
    for i, ax in enumerate(fig.subplots(1, 3, squeeze=False)[0]):
        _panel(ax, j, i, theme)
    fig.set_dpi(DPI)
    FigureCanvasAgg(fig)
    out = io.BytesIO()
    fig.savefig(out, format="png", facecolor=theme.paper)
    return out.getvalue()


def limits(j: Judged, i: int) -> list[float]:
    """The alert limits [m] of axis i that the run met, ascending."""
    al = j.al[:, i]
    return [float(x) for x in np.unique(np.round(al[np.isfinite(al)], 3))]


def counts(j: Judged, i: int) -> dict[str, int]:
    """Samples of axis i by region: no level, available, unavailable (level beyond the limit), misleading, hazardous. The last two
    are of the drawn ones too."""
    some = np.isfinite(j.pl[:, i])
    within = j.available[:, i]
    bad = j.misleading[:, i]
    return {
        "no level": int((~some).sum()),
        "available": int(within.sum()),
        "unavailable": int((some & ~within).sum()),
        "misleading": int(bad.sum()),
        "hazardous": int(j.hazardous[:, i].sum()),
    }


def _panel(ax: Axes, j: Judged, i: int, theme: Theme) -> None:
    some = np.isfinite(j.pl[:, i])
    error, pl, al = j.size[some, i], j.pl[some, i], limits(j, i)
    most = max([*error, *pl, 1.0])
    # a limit far off would leave no room for the samples
    top = min(SPAN * max([most, *(x for x in al if x < 2.0 * most)]), MOST_M)
    edges = np.linspace(0.0, top, BINS + 1)
    inside = np.nextafter(top, 0.0)
    n = np.histogram2d(np.minimum(error, inside), np.minimum(pl, inside), (edges, edges))[0].T
    shade = LinearSegmentedColormap.from_list("counts", [theme.few, theme.many])
    ax.set_facecolor(theme.paper)
    ax.grid(True, color=theme.grid, lw=0.7)
    ax.set_axisbelow(True)
    if len(error):
        ax.pcolormesh(edges, edges, np.ma.masked_equal(n, 0), cmap=shade, norm=LogNorm(1, max(n.max(), 2)), zorder=2)
    ax.fill_between([0, top], [0, top], color=theme.bad, alpha=0.10, lw=0, zorder=1)
    ax.plot([0, top], [0, top], color=theme.bad, lw=1.1, zorder=3)
    ax.annotate("misleading", (0.97 * top, 0.03 * top), ha="right", va="bottom", fontsize=8.5, color=theme.bad)
    for limit in al:
        if limit <= top:
            ax.plot([0, limit, limit], [limit, limit, 0], color=theme.ink, lw=1.0, ls="--", zorder=4)
            ax.annotate(
                f"AL {limit:g}", (limit, limit), (3, 2), textcoords="offset points", fontsize=8, color=theme.ink
            )
    n_of = [f"{v} {k}" for k, v in counts(j, i).items() if v]
    said = "\n".join(", ".join(n_of[k : k + 3]) for k in (0, 3))
    ax.set_title(f"{AXES[i]}\n{said}", fontsize=9, loc="left", color=theme.soft)
    ax.set(xlim=(0, top), ylim=(0, top), aspect="equal")
    ax.set_xlabel("true error [m]", fontsize=9.5, color=theme.ink)
    ax.set_ylabel("protection level [m]", fontsize=9.5, color=theme.ink)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(theme.soft)
    ax.tick_params(labelsize=8.5, color=theme.soft, labelcolor=theme.soft)
