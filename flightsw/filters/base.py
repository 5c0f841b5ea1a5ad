"""The interface all Gaussian point filters share, and what the covariance-form ones have in common.

The owner applies the model between calls: `draw`, propagate the rows of X in place, `recombine`; then `draw`, write Y,
`correct`. `SquareRootUKF` has the same methods and satisfies the protocol without inheriting.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from flightsw.filters.covariance import chol_psd, root_diagonal
from flightsw.kernels.linalg import gram

Array = np.ndarray
Points = Callable[[Array], Array]


@runtime_checkable
class PointFilter(Protocol):
    """n states, at most m measurements, nq columns of process-noise factor, k points."""

    n: int
    m: int
    nq: int
    x: Array  # [n] mean; the array object never changes
    X: Array  # [k,n] points
    Y: Array  # [k,m] their measurement images
    SQ: Array  # [n,nq] process-noise factor of the coming time update
    nu: Array  # [m] innovation of the last correction
    K: Array  # [n,m] its gain
    Sy: Array  # [m,m] lower factor of its covariance

    @property
    def P(self) -> Array:
        """Covariance [n,n]."""

    @property
    def S(self) -> Array:
        """Lower-triangular factor of the covariance [n,n]; read it, write with set_factor."""

    def draw(self) -> Array:
        """Points X [k,n] of the present mean and covariance."""

    def recombine(self) -> None:
        """Time update from the propagated rows of X and SQ."""

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update from Y[:, :m], measured y [>=m] and its 1-sigma r [>=m]; returns NIS."""

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n]."""

    def set_factor(self, S: Array) -> None:
        """Covariance from any factor S [n,n], P = S S^T."""

    def set_cov(self, P: Array) -> None:
        """Covariance P [n,n]."""

    def memory(self) -> tuple[Array, ...]:
        """The arrays that hold mean and covariance: their copies, written back, undo a correction."""

    def predict(self, f: Points, SQ: Array) -> None:
        """Time update with a plain function of the points."""

    def update(self, h: Points, y: Array, r: Array) -> float:
        """Measurement update with a plain function of the points; returns NIS."""


class FilterBase:
    """State and buffers common to the filters of this package (except SquareRootUKF, which has its own).

    `failures` counts factorisations or down-dates that were refused; the filter then kept its last sound factor.
    """

    def __init__(self, n: int, m: int, nq: int, points: int) -> None:
        """n >= 1 states, m >= 1 measurements at most, nq >= 0 noise columns. Raises ValueError for other sizes."""
        if n < 1 or m < 1 or nq < 0:
            raise ValueError(f"filter size n={n}, m={m}, nq={nq}: allowed n >= 1, m >= 1, nq >= 0")
        self.n, self.m, self.nq = n, m, nq
        self.x = np.zeros(n)
        self.X = np.zeros((points, n))
        self.Y = np.zeros((points, m))
        self.SQ = np.zeros((n, nq))
        self.nu = np.zeros(m)
        self.K = np.zeros((n, m))
        self.Sy = np.zeros((m, m))
        self.sigma = np.zeros(n)
        self.failures = 0

    def draw(self) -> Array:
        """Points X [k,n] of the present mean and covariance."""
        raise NotImplementedError

    def recombine(self) -> None:
        """Time update from the propagated rows of X and SQ."""
        raise NotImplementedError

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update; returns NIS."""
        raise NotImplementedError

    def predict(self, f: Points, SQ: Array) -> None:
        """Time update with a plain function f(points [k,n]) -> [k,n] and noise factor SQ [n,<=nq]."""
        self.draw()
        self.X[:] = f(self.X)
        self.SQ[:] = 0.0
        self.SQ[:, : SQ.shape[1]] = SQ
        self.recombine()

    def update(self, h: Points, y: Array, r: Array) -> float:
        """Measurement update with a plain function h(points [k,n]) -> [k,j]; y, r [j]; returns NIS."""
        j = len(y)
        self.draw()
        self.Y[:, :j] = h(self.X)
        return self.correct(np.ascontiguousarray(y, dtype=float), np.ascontiguousarray(r, dtype=float), j)


class CovarianceFilter(FilterBase):
    """A filter that stores the covariance itself."""

    def __init__(self, n: int, m: int, nq: int, points: int) -> None:
        """Sizes as FilterBase; covariance starts at identity."""
        super().__init__(n, m, nq, points)
        self.P = np.eye(n)
        self._S = np.eye(n)

    @property
    def S(self) -> Array:
        """Lower-triangular factor of P [n,n], computed on each access; writing into it changes nothing (use set_factor)."""
        chol_psd(self.P, self.n, self._S)
        return self._S

    def memory(self) -> tuple[Array, ...]:
        """Mean and covariance, the filter's own arrays."""
        return self.x, self.P

    def set_factor(self, S: Array) -> None:
        """P <- S S^T for any S [n,k]."""
        gram(np.ascontiguousarray(S), self.P)

    def set_cov(self, P: Array) -> None:
        """P [n,n] <- symmetric part of the argument."""
        self.P[:] = 0.5 * (P + P.T)

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n]."""
        root_diagonal(self.P, self.sigma)
        return self.sigma.tolist()
