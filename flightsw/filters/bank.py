"""A small bank of filters that differ in one process-noise intensity, mixed by likelihood (IMM or static).

Interacting multiple model: Blom and Bar-Shalom (1988). Mixed moments are set through factors, never through differences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flightsw.filters.base import PointFilter
from flightsw.filters.covariance import log_likelihood
from flightsw.kernels.linalg import finite, gram, vecmat

Array = np.ndarray
P_MIN = 1e-30  # [-] least probability of a filter


def markov(count: int, dwell_s: float, dt: float) -> Array:
    """Transition matrix [count,count] over dt [s]: mean stay dwell_s [s] in a mode, then one of its neighbours.

    Raises ValueError for count < 1 or non-positive times.
    """
    if count < 1 or not (dwell_s > 0.0 and dt > 0.0):
        raise ValueError(f"count={count}, dwell_s={dwell_s}, dt={dt}; allowed >= 1, > 0, > 0")
    leave = -math.expm1(-dt / dwell_s)
    M = np.eye(count)
    for i in range(count):
        near = [j for j in (i - 1, i + 1) if 0 <= j < count]
        for j in near:
            M[i, j] = leave / len(near)
        if near:
            M[i, i] = 1.0 - leave
    return M


class FilterBank:
    """Filters of equal size, one per intensity. Per step: `mix()`; owner predicts and corrects each; `weigh(m)`.

    `x` [n], `P` [n,n] are the combined estimate, `mu` [k] the mode probabilities, `q` the probability-weighted intensity.
    """

    def __init__(
        self, filters: Sequence[PointFilter], q: Sequence[float], transition: Array, *, mix: bool = True
    ) -> None:
        """filters k of equal n, q [k] their intensities, transition [k,k] (rows sum to 1). mix=False: each filter keeps to
        itself and only the weights interact (static bank with forgetting). Raises ValueError for inconsistent sizes.
        """
        one, *_ = filters
        k, n = len(filters), one.n
        T = np.asarray(transition, dtype=float)
        if len(q) != k or T.shape != (k, k) or any(f.n != n for f in filters):
            raise ValueError(
                f"{k} filters, {len(q)} intensities, transition {T.shape}; allowed: equal counts and sizes"
            )
        if not ((T >= 0.0).all() and np.allclose(T.sum(axis=1), 1.0, atol=1e-12)):
            raise ValueError("transition matrix: every entry must be >= 0 and every row sum to 1")
        self.filters, self.q_values, self.T, self.interact = list(filters), np.array(q, dtype=float), T, mix
        self.n, self.k = n, k
        self.mu = np.full(k, 1.0 / k)
        self.x = np.array(one.x)
        self._ll = np.zeros(k)
        self._w = np.zeros(max(f.m for f in filters))

    def start(self, x: Array, S: Array) -> None:
        """Same mean x [n] and factor S [n,n] for all, equal probabilities."""
        for f in self.filters:
            f.x[:] = x
            f.set_factor(S)
        self.mu[:] = 1.0 / self.k
        self.x[:] = x

    def mix(self) -> None:
        """Before the time update: probabilities through the transition, and with mixing each filter's start from all."""
        c = np.zeros(self.k)
        vecmat(self.mu, self.T, c)
        if self.interact and self.k > 1:
            W = (self.mu[:, None] * self.T) / c  # W[i,j]: share of filter i in the start of filter j
            xs = np.array([f.x for f in self.filters])
            Ss = [f.S.copy() for f in self.filters]
            for j, f in enumerate(self.filters):
                share = W[:, j].copy()
                vecmat(share, xs, f.x)
                f.set_factor(self._stack(share, xs - f.x, Ss))
        self.mu[:] = c

    @staticmethod
    def _stack(w: Array, d: Array, Ss: Sequence[Array]) -> Array:
        root = np.sqrt(w)
        return np.hstack([*(root[i] * S for i, S in enumerate(Ss)), (root[:, None] * d).T])

    def weigh(self, m: int) -> None:
        """After every filter has corrected with m measurements: new probabilities and the combined mean."""
        if m > 0:
            for i, f in enumerate(self.filters):
                self._ll[i] = log_likelihood(f.nu, f.Sy, m, self._w)
            if finite(self._ll):
                p = self.mu * [math.exp(v) for v in (self._ll - self._ll.max()).tolist()]
                # a filter ruled out by one wild reading keeps a trace, or `mix` would divide by a probability of zero
                p = np.maximum(p / p.sum(), P_MIN)
                self.mu[:] = p / p.sum()
        vecmat(self.mu, np.array([f.x for f in self.filters]), self.x)

    @property
    def q(self) -> float:
        """Probability-weighted intensity (geometric mean, the natural one for a scale)."""
        return math.exp(sum(m * math.log(q) for m, q in zip(self.mu.tolist(), self.q_values.tolist(), strict=True)))

    @property
    def P(self) -> Array:
        """Covariance [n,n] of the mixture."""
        A = self._stack(self.mu, np.array([f.x for f in self.filters]) - self.x, [f.S for f in self.filters])
        P = np.zeros((self.n, self.n))
        gram(np.ascontiguousarray(A), P)
        return P

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n] of the mixture."""
        return np.sqrt(np.diag(self.P)).tolist()
