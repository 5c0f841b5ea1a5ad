"""A picture in both themes of the pages: one file for the dark one, one for the light."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

LOOK = {"": ("#111318", "#e6e6e6"), "-light": ("#ffffff", "#222222")}  # ending of the file: ground, ink


def plates(out: Path, name: str, draw: Callable[[list[Any]], None], panels: int = 2, width: float = 10.0) -> list[Path]:
    """Draw on `panels` axes side by side, once per theme; the files written, `name`.png and `name`-light.png in `out`."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    out.mkdir(parents=True, exist_ok=True)
    files = []
    for ending, (ground, ink) in LOOK.items():
        inked = ("axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color", "text.color")
        grounds = ("figure.facecolor", "axes.facecolor", "savefig.facecolor")
        style = dict.fromkeys(inked, ink) | dict.fromkeys(grounds, ground)
        with plt.rc_context(cast(Any, style)):
            fig, axes = plt.subplots(1, panels, figsize=(width, 4.2), layout="constrained", squeeze=False)
            draw(list(axes[0]))
            for ax in axes[0]:
                ax.grid(alpha=0.25)
            files.append(out / f"{name}{ending}.png")
            fig.savefig(files[-1], dpi=100)
            plt.close(fig)
    return files
