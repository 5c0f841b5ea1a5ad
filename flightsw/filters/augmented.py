"""Augmented sigma points (state, process noise, measurement noise) and the UKF of Lee 2011 (3.9)-(3.13) on them.

L = n + nq + m, 2L+1 points. Noise enters the model additively, x' = f(x) + SQ w and y = h(x) + r v; adding its columns to
the propagated points is then the printed (3.11a), (3.13a) itself, not an approximation of it.

Row layout of X and Y: 0 centre; 1..n state +; n+1..n+nq process noise +; then m measurement noise +; the same three
blocks again with -.

As printed, the propagated points are used for the measurement without being redrawn: `draw()` right after `recombine()`
returns them. If the owner propagates them once more (no measurement in between), the second step's noise is appended as
covariance and the next `draw()` starts afresh. `redraw=True` draws anew every time.
"""

from __future__ import annotations

import numpy as np

from flightsw.filters.base import FilterBase
from flightsw.filters.covariance import add_factor, apply_innovation, chol_psd, gain, root_diagonal, subtract_kpk
from flightsw.filters.srukf import _weighted_mean
from flightsw.filters.ukf import own_cov, weighted_cov, weights
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import gram

Array = np.ndarray


@jit
def draw_augmented(x: np.ndarray, S: np.ndarray, g: float, X: np.ndarray) -> None:
    """X [2L+1,n] <- state points x +- g S_j; noise rows hold x, because additive noise enters after the model."""
    n = x.shape[0]
    L = (X.shape[0] - 1) // 2
    for k in range(X.shape[0]):
        for i in range(n):
            X[k, i] = x[i]
    for j in range(n):
        for i in range(n):
            d = g * S[i, j]
            X[1 + j, i] = x[i] + d
            X[1 + L + j, i] = x[i] - d


@jit
def add_process_noise(X: np.ndarray, SQ: np.ndarray, g: float) -> None:
    """Rows of the process-noise block of X [2L+1,n] += +-g columns of SQ [n,nq]: (3.11a) for additive noise."""
    n = X.shape[1]
    L = (X.shape[0] - 1) // 2
    for j in range(SQ.shape[1]):
        for i in range(n):
            d = g * SQ[i, j]
            X[1 + n + j, i] += d
            X[1 + L + n + j, i] -= d


@jit
def measured_points(Y: np.ndarray, r: np.ndarray, m: int, first: int, g: float, Z: np.ndarray) -> None:
    """Z [2L+1,>=m] <- Y with +-g r_a on the rows of measurement noise, which start at 1+first: (3.13a), (3.18a)."""
    L = (Y.shape[0] - 1) // 2
    for k in range(Y.shape[0]):
        for a in range(m):
            Z[k, a] = Y[k, a]
    for a in range(m):
        Z[1 + first + a, a] += g * r[a]
        Z[1 + L + first + a, a] -= g * r[a]


@jit
def unchanged(x: np.ndarray, x0: np.ndarray, S: np.ndarray, S0: np.ndarray) -> bool:
    """Whether x [n] and S [n,n] still equal the copies."""
    n = x.shape[0]
    for i in range(n):
        if x[i] != x0[i]:
            return False
        for j in range(n):
            if S[i, j] != S0[i, j]:
                return False
    return True


class AugmentedPoints(FilterBase):
    """Points, weights and the redraw rule shared by the augmented filters; `_C` [n,n] is what the subclass stores."""

    def __init__(
        self, n: int, m: int, nq: int, alpha: float, kappa: float | None, beta: float, redraw: bool, strict: bool
    ) -> None:
        """n states, m measurements at most, nq noise columns; kappa None means 3 - L. `strict` raises FilterFailureError
        at the first refused factorisation instead of counting it. Raises ValueError for sizes below 1 or L + lambda <= 0.
        """
        self.L = n + nq + m
        super().__init__(n, m, nq, 2 * self.L + 1)
        self.g, self.w0m, self.w0c, self.wi = weights(self.L, alpha, kappa, beta)
        self.redraw, self.strict = redraw, strict
        self._kept = self._again = False
        self._C = np.eye(n)
        self._x0, self._C0 = np.zeros(n), np.zeros((n, n))
        self._Z = np.zeros((2 * self.L + 1, m))

    def factor(self) -> Array:
        """Lower-triangular factor [n,n] the points are drawn from."""
        raise NotImplementedError

    def memory(self) -> tuple[Array, ...]:
        """Mean and what is stored of the covariance, the filter's own arrays."""
        return self.x, self._C

    def draw(self) -> Array:
        """Points X [2L+1,n]: the propagated ones if they are still current (see the module), else drawn anew."""
        if self._kept and unchanged(self.x, self._x0, self._C, self._C0):
            self._kept, self._again = False, True
            return self.X
        self._kept = self._again = False
        draw_augmented(self.x, self.factor(), self.g, self.X)
        return self.X

    def _keep(self, fresh: bool) -> None:
        self._kept = fresh and not self.redraw
        self._again = False
        self._x0[:], self._C0[:] = self.x, self._C

    def _failed(self, what: str) -> None:
        self.failures += 1
        if self.strict:
            raise FilterFailureError(f"{what}: covariance is no longer positive definite")


class FilterFailureError(ArithmeticError):
    """A factorisation or down-date of a filter failed; raised by filters built with strict=True only."""


@jit
def augmented_recombine(
    X: np.ndarray,
    w0m: float,
    w0c: float,
    wi: float,
    SQ: np.ndarray,
    again: bool,
    g: float,
    x: np.ndarray,
    P: np.ndarray,
) -> None:
    """(3.11b, c): x [n], P [n,n] <- moments of X [2L+1,n]; noise through the points, or (`again`) added to P."""
    n = x.shape[0]
    if not again:
        add_process_noise(X, SQ, g)
    _weighted_mean(X, n, w0m, wi, x)
    own_cov(X, x, n, w0c, wi, P)
    if again:
        add_factor(P, n, SQ)


@jit
def augmented_correct(
    X: np.ndarray, Z: np.ndarray, y: np.ndarray, m: int, w0m: float, w0c: float, wi: float,
    x: np.ndarray, P: np.ndarray, nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, A: np.ndarray, U: np.ndarray,
) -> float:  # fmt: skip
    """(3.13b-g) from points X [2L+1,n] and noisy images Z [2L+1,>=m]; returns NIS, or -1 when Pyy is indefinite."""
    n = x.shape[0]
    _weighted_mean(Z, m, w0m, wi, nu)
    own_cov(Z, nu, m, w0c, wi, A)
    if chol_psd(A, m, Sy):
        return -1.0
    weighted_cov(X, x, n, Z, nu, m, w0c, wi, K)
    gain(K, n, Sy, m)
    subtract_kpk(P, n, K, Sy, m, U)
    for a in range(m):
        nu[a] = y[a] - nu[a]
    return apply_innovation(K, nu, m, Sy, x, U[0])


class AugmentedUKF(AugmentedPoints):
    """UKF as printed: full covariance, L = n + nq + m. With kappa None (3 - L) the centre weight is negative (lee.md trap 13)."""

    def __init__(
        self, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float | None = 0.0, beta: float = 2.0,
        redraw: bool = False, strict: bool = False,
    ) -> None:  # fmt: skip
        """Arguments and errors as AugmentedPoints."""
        super().__init__(n, m, nq, alpha, kappa, beta, redraw, strict)
        self._S = np.eye(n)
        self._A = np.zeros((m, m))
        self._U = np.zeros((n, m))

    @property
    def P(self) -> Array:
        """Covariance [n,n], the filter's own array."""
        return self._C

    @property
    def S(self) -> Array:
        """Lower-triangular factor of P [n,n], computed on each access; use set_factor to change it."""
        chol_psd(self._C, self.n, self._S)
        return self._S

    def factor(self) -> Array:
        """Cholesky factor of P; a failure is counted (or raised)."""
        if chol_psd(self._C, self.n, self._S):
            self._failed("Cholesky factor of P")
        return self._S

    def recombine(self) -> None:
        """Time update from the propagated points and SQ."""
        again = self._again
        augmented_recombine(self.X, self.w0m, self.w0c, self.wi, self.SQ, again, self.g, self.x, self._C)
        self._keep(not again)

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update from Y[:, :m]; y, r [>=m]; returns NIS, -1 when refused."""
        self._kept = self._again = False
        measured_points(self.Y, r, m, self.n + self.nq, self.g, self._Z)
        nis = float(
            augmented_correct(
                self.X, self._Z, y, m, self.w0m, self.w0c, self.wi,
                self.x, self._C, self.nu, self.K, self.Sy, self._A, self._U,
            )
        )  # fmt: skip
        if nis < 0.0:
            self._failed("innovation covariance")
        return nis

    def set_factor(self, S: Array) -> None:
        """P <- S S^T for any S [n,k]."""
        gram(np.ascontiguousarray(S), self._C)

    def set_cov(self, P: Array) -> None:
        """P [n,n] <- symmetric part of the argument."""
        self._C[:] = 0.5 * (P + P.T)

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n]."""
        root_diagonal(self._C, self.sigma)
        return self.sigma.tolist()
