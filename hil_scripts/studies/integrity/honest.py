"""Whether the position's error lay within the bound the aircraft gave for it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ground.link.packets import Fields
from hil_scripts.studies.rows import Rows

Arr = NDArray[np.float64]


class Bounds:
    """INTEGRITY_STATUS as heard beside the true position, each at its own time."""

    def __init__(self) -> None:
        self._true = Rows(4)  # [s], xi [m]
        self._said = Rows(7)  # [s], pos [m], level [m]

    def see(self, t_us: int, xi: tuple[float, float, float]) -> None:
        """The truth at t_us: xi [3] m, tanker axes."""
        self._true.append((t_us / 1e6, *xi))

    def hear(self, m: Fields) -> None:
        """Fields of an INTEGRITY_STATUS."""
        self._said.append((m["time_usec"] / 1e6, *m["pos"], *m["pl"]))

    def ratios(self) -> tuple[Arr, Arr]:
        """t [N] s and the largest |error| / level of the axes [N] of what was heard within the times of the truth, which is taken
        in a straight line between two looks; nothing where no bound was sent."""
        if not len(self._said) or not len(self._true):
            return np.zeros(0), np.zeros(0)
        true, said = np.array(self._true), np.array(self._said)
        said = said[(said[:, 0] >= true[0, 0]) & (said[:, 0] <= true[-1, 0])]
        at = np.stack([np.interp(said[:, 0], true[:, 0], true[:, 1 + i]) for i in range(3)], axis=1)
        return said[:, 0], (np.abs(said[:, 1:4] - at) / said[:, 4:7]).max(axis=1, initial=0.0)


def honest(t: Arr, ratio: Arr, announced_s: float) -> dict[str, float]:
    """Figures of bounds at t [N] s from the fault on: `honest` 1 if none of them was passed until the fault was announced (t =
    announced_s), else 0; share kept and the largest error over level until then. Nothing where there is no bound."""
    ratio = ratio[(t >= 0.0) & (t <= announced_s)]
    if not len(ratio):
        return {}
    return {
        "honest": float((ratio <= 1.0).all()),
        "bound.held_pct": 100.0 * float((ratio <= 1.0).mean()),
        "bound.ratio_max": float(ratio.max()),
    }
