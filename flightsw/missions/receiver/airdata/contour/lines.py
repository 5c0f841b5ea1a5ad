"""Polylines in the y-z plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Lines:
    """Polylines: vertices xy [n, 2] = (y, z) [m, F]; polyline k is xy[at[k]:at[k + 1]]. None are joined to each other."""

    xy: NDArray[np.float64]
    at: NDArray[np.int64]

    @property
    def empty(self) -> bool:
        """No vertex at all."""
        return len(self.xy) == 0
