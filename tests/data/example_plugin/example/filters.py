"""A fading-memory filter: old measurements count less, whatever the process noise says (Simon 2006, section 7.4)."""

from __future__ import annotations

import math

from flightsw.filters.srukf import SquareRootUKF

FADING = 1.002  # [-] growth of the covariance per step


class MyFilter(SquareRootUKF):
    """The square-root filter with its covariance grown by FADING at every time update."""

    def __init__(self, n: int, m: int, nq: int) -> None:
        """n states, m measurements at most, nq columns of process noise."""
        super().__init__(n, m, nq)

    def recombine(self) -> None:
        """Time update, then P <- FADING P."""
        super().recombine()
        self.set_factor(math.sqrt(FADING) * self.S)
