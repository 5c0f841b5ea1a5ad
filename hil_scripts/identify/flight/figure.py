"""Picture of a fit: what was measured, and what the model says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hil_scripts.identify.flight.identified import Identified
from hil_scripts.launch.plate import plates

SHOWN = (
    ("gyro_x", "p [deg/s]", 180.0 / np.pi), ("gyro_y", "q [deg/s]", 180.0 / np.pi), ("acc_z", "specific force, z [m/s²]", 1.0),
    ("beta0", "sideslip [deg]", 180.0 / np.pi),
)  # fmt: skip


def draw(out: Path, found: Identified) -> list[Path]:
    """`fit.png` and `fit-light.png` in `out`."""
    m = found.model
    series = {c.name: (c, r) for c, r in zip(m.channels, found.fit.residuals, strict=True)}

    def panels(axes: list[Any]) -> None:
        for ax, (name, label, by) in zip(axes, SHOWN, strict=True):
            c, left = series[name]
            t = c.at * m.dt
            ax.plot(t, by * c.values, ".", ms=1.5, alpha=0.35, color="C0", label="measured")
            ax.plot(t, by * (c.values - left), lw=1.2, color="C1", label="model")
            ax.set(xlabel="time [s]", title=label)
        axes[0].legend(frameon=False, loc="upper right", markerscale=8)

    return plates(out, "fit", panels, len(SHOWN), 18.0)
