"""Adaptation of one scalar process-noise intensity (the wind's q_w) from innovations, on any filter of the family.

The statistic is the normalised correction of the chosen states, z_i = (K nu)_i / sqrt((K Pyy K^T)_ii): the innovation seen
through the gain, so that only what bears on those states counts. E z^2 = 1 for a consistent filter (innovation covariance
matching, Mehra 1970, restricted to one direction); larger means q is too small.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.filters.base import PointFilter
from flightsw.kernels.jit import jit

Array = np.ndarray


@jit
def correction_ratio(
    K: np.ndarray, nu: np.ndarray, Sy: np.ndarray, m: int, first: int, count: int, cap: float
) -> float:
    """Mean over states first..first+count-1 of min(z_i^2, cap); -1 when none of them was corrected.

    K [n,>=m] gain, nu [>=m] innovation, Sy [>=m,>=m] lower factor of its covariance.
    """
    total = 0.0
    used = 0
    for i in range(first, first + count):
        c = 0.0
        v = 0.0
        for b in range(m):
            c += K[i, b] * nu[b]
            s = 0.0
            for a in range(b, m):
                s += K[i, a] * Sy[a, b]
            v += s * s
        if v > 0.0:
            total += min(c * c / v, cap)
            used += 1
    return total / used if used > 0 else -1.0


@dataclass(frozen=True)
class AdaptParams:
    """Tuning of NoiseAdapter."""

    q_min: float = 0.1  # [m/s/sqrt(s)]
    q_max: float = 4.0  # [m/s/sqrt(s)]
    memory_s: float = 0.5  # [s] forgetting time of the statistic
    gain: float = 1.0  # [1/s] rate of log q per unit of (mean z^2 - 1)
    rate_up: float = 3.0  # [1/s] largest growth of log q
    rate_down: float = 0.7  # [1/s] largest decay of log q
    cap: float = 25.0  # [-] z^2 beyond this counts as this: one bad sensor reading must not open the filter


class NoiseAdapter:
    """Innovation covariance matching by stochastic approximation: d(log q)/dt = gain (mean z^2 - 1), limited.

    The mean of z^2 - 1 is zero at the right q whatever the distribution of z, so there is no bias at equilibrium; the
    fast rise costs little (an open filter follows the wind), the slow decay keeps the scatter of q small.
    """

    def __init__(self, q0: float, first: int, count: int, p: AdaptParams | None = None) -> None:
        """q0 initial intensity, first and count: the states whose corrections are judged (the wind).

        Raises ValueError when 0 < q_min <= q0 <= q_max or a positive memory_s, gain, rate or cap is violated.
        """
        self.p = p = p or AdaptParams()
        if not 0.0 < p.q_min <= q0 <= p.q_max:
            raise ValueError(f"q0 = {q0}; allowed: 0 < q_min = {p.q_min} <= q0 <= q_max = {p.q_max}")
        if not min(p.memory_s, p.gain, p.rate_up, p.rate_down, p.cap) > 0.0:
            raise ValueError(f"{p}: memory_s, gain, rate_up, rate_down, cap; allowed > 0")
        self.first, self.count = first, count
        self.q = self.q0 = q0
        self.ratio = 1.0

    def reset(self) -> None:
        """Back to the initial intensity."""
        self.q, self.ratio = self.q0, 1.0

    def update(self, flt: PointFilter, m: int, dt: float) -> float:
        """Judge the correction `flt` has just made with m measurements, dt [s] after the previous one; returns the new q."""
        p = self.p
        z2 = correction_ratio(flt.K, flt.nu, flt.Sy, m, self.first, self.count, p.cap) if m > 0 else -1.0
        if not z2 >= 0.0 or dt <= 0.0:  # nothing was corrected, or NaN
            return self.q
        self.ratio += -math.expm1(-dt / p.memory_s) * (z2 - self.ratio)
        slope = min(max(p.gain * (self.ratio - 1.0), -p.rate_down), p.rate_up)
        self.q = min(max(self.q * math.exp(slope * dt), p.q_min), p.q_max)
        return self.q
