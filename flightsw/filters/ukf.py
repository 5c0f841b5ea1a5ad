"""Unscented Kalman filter with full covariance and additive noise, points redrawn before the measurement.

Lee 2011 (3.10)-(3.13) with the noise added to the covariances instead of augmenting the state, which is exact for additive
noise; weights (3.12) with the first one w0^m (erratum E16). The covariance is factored at every draw; a factorisation
that fails (P lost definiteness) is counted in `failures`.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.base import CovarianceFilter
from flightsw.filters.covariance import add_factor, apply_innovation, chol_psd, gain, subtract_kpk
from flightsw.filters.srukf import CENTRE, _weighted_mean, draw
from flightsw.kernels.jit import jit

Array = np.ndarray


def weights(L: int, alpha: float, kappa: float | None, beta: float) -> tuple[float, float, float, float]:
    """Spread g and weights (g, w0m, w0c, wi) of 2L+1 points; kappa None means 3 - L. Lee 2011 (3.10), (3.12) after E16.

    Raises ValueError when L + lambda is not positive.
    """
    k = 3.0 - L if kappa is None else kappa
    s = alpha * alpha * (L + k)  # = L + lambda
    if not s > 0.0:
        raise ValueError(f"alpha={alpha}, kappa={k}, L={L}: L + lambda = {s:.4g}; allowed > 0")
    w0m = (s - L) / s
    return math.sqrt(s), w0m, w0m + 1.0 - alpha * alpha + beta, 0.5 / s


@jit
def weighted_cov(
    X: np.ndarray, x: np.ndarray, n: int, Y: np.ndarray, y: np.ndarray, m: int, w0: float, wi: float, C: np.ndarray
) -> None:
    """C [>=n,>=m] <- w0 dX0 dY0^T + wi sum_k dXk dYk^T, dX = X [p,>=n] - x, dY = Y [p,>=m] - y; Lee 2011 (3.11c), (3.13d)."""
    for i in range(n):
        for a in range(m):
            s = 0.0
            for k in range(1, X.shape[0]):
                s += (X[k, i] - x[i]) * (Y[k, a] - y[a])
            C[i, a] = wi * s + w0 * (X[CENTRE, i] - x[i]) * (Y[CENTRE, a] - y[a])


@jit
def own_cov(Y: np.ndarray, y: np.ndarray, m: int, w0: float, wi: float, C: np.ndarray) -> None:
    """C [>=m,>=m] <- covariance of the points Y [p,>=m] about y [m], both triangles."""
    for a in range(m):
        for b in range(a + 1):
            s = 0.0
            for k in range(1, Y.shape[0]):
                s += (Y[k, a] - y[a]) * (Y[k, b] - y[b])
            s = wi * s + w0 * (Y[CENTRE, a] - y[a]) * (Y[CENTRE, b] - y[b])
            C[a, b] = s
            C[b, a] = s


@jit
def recombine_full(
    X: np.ndarray, w0m: float, w0c: float, wi: float, SQ: np.ndarray, x: np.ndarray, P: np.ndarray
) -> None:
    """x [n], P [n,n] <- mean and covariance of the points X [p,n] plus SQ SQ^T."""
    n = x.shape[0]
    _weighted_mean(X, n, w0m, wi, x)
    own_cov(X, x, n, w0c, wi, P)
    add_factor(P, n, SQ)


@jit
def correct_full(
    X: np.ndarray, Y: np.ndarray, y: np.ndarray, r: np.ndarray, m: int, w0m: float, w0c: float, wi: float,
    x: np.ndarray, P: np.ndarray, nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, A: np.ndarray, U: np.ndarray,
) -> float:  # fmt: skip
    """Measurement update in place from points X [p,n] and images Y [p,>=m]; noise variance r^2 is added to Pyy.

    Workspaces A [m,m], U [max(n,1),m]. Returns NIS, or -1 when Pyy is indefinite (nothing is changed).
    """
    n = x.shape[0]
    _weighted_mean(Y, m, w0m, wi, nu)  # nu holds the predicted measurement for now
    own_cov(Y, nu, m, w0c, wi, A)
    for a in range(m):
        A[a, a] += r[a] * r[a]
    if chol_psd(A, m, Sy):
        return -1.0
    weighted_cov(X, x, n, Y, nu, m, w0c, wi, K)
    gain(K, n, Sy, m)
    subtract_kpk(P, n, K, Sy, m, U)
    for a in range(m):
        nu[a] = y[a] - nu[a]
    return apply_innovation(K, nu, m, Sy, x, U[0])


class UnscentedKalmanFilter(CovarianceFilter):
    """2n+1 points, additive noise, redraw between time and measurement update."""

    def __init__(
        self, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float | None = 0.0, beta: float = 2.0
    ) -> None:
        """n states, m measurements at most, nq noise columns; kappa None means 3 - n (negative centre weights allowed).

        Raises ValueError for sizes below 1 or n + lambda <= 0.
        """
        super().__init__(n, m, nq, 2 * n + 1)
        self.g, self.w0m, self.w0c, self.wi = weights(n, alpha, kappa, beta)
        self._A = np.zeros((m, m))
        self._U = np.zeros((n, m))

    def draw(self) -> Array:
        """Redraw the points X [2n+1,n] from (x, P)."""
        self.failures += chol_psd(self.P, self.n, self._S)
        draw(self.x, self._S, self.g, self.X)
        return self.X

    def recombine(self) -> None:
        """Time update from the propagated points and SQ."""
        recombine_full(self.X, self.w0m, self.w0c, self.wi, self.SQ, self.x, self.P)

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update from Y[:, :m]; y, r [>=m]; returns NIS, -1 when refused (counted in `failures`)."""
        nis = float(
            correct_full(
                self.X, self.Y, y, r, m, self.w0m, self.w0c, self.wi,
                self.x, self.P, self.nu, self.K, self.Sy, self._A, self._U,
            )
        )  # fmt: skip
        self.failures += nis < 0.0
        return nis
