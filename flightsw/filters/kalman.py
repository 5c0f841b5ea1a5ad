"""Linear Kalman filter with given matrices, Joseph-form covariance (Lee 2011, section 3.1; Bierman 1977).

It also serves the point interface: F and H are then read off the propagated points by differences, exact for affine
models.
"""

from __future__ import annotations

import numpy as np

from flightsw.filters.base import CovarianceFilter
from flightsw.filters.correction import cross_covariance, innovation_covariance, joseph
from flightsw.filters.covariance import add_factor, apply_innovation, chol_psd, gain, root_diagonal
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import matvec
from flightsw.kernels.products import block_product, symmetric

Array = np.ndarray
CENTRE = 0  # row of the mean among the points
CBRT_EPS = 6.055454452393343e-06  # [-] cube root of the double rounding unit: the balance of a central difference


@jit
def spread(x: np.ndarray, sigma: np.ndarray, step: float, d: np.ndarray, X: np.ndarray) -> None:
    """X [2n+1,n] <- x, x + d_i e_i, x - d_i e_i with d_i [n] = max(step sigma_i, cbrt(eps) |x_i|), at least 1e-9."""
    n = x.shape[0]
    for k in range(2 * n + 1):
        for i in range(n):
            X[k, i] = x[i]
    for i in range(n):
        d[i] = max(step * sigma[i], CBRT_EPS * abs(x[i]), 1e-9)
        X[1 + i, i] = x[i] + d[i]
        X[1 + n + i, i] = x[i] - d[i]
        # half the distance between the two points as stored: their rounding does not enter the slope
        d[i] = 0.5 * (X[1 + i, i] - X[1 + n + i, i])


@jit
def slopes(Z: np.ndarray, rows: int, n: int, d: np.ndarray, J: np.ndarray) -> None:
    """J [>=rows,n] <- central differences of the images Z [2n+1,>=rows] of the points made by `spread`."""
    for i in range(n):
        q = 0.5 / d[i]
        for a in range(rows):
            J[a, i] = (Z[1 + i, a] - Z[1 + n + i, a]) * q


@jit
def time_update(F: np.ndarray, SQ: np.ndarray, P: np.ndarray, W: np.ndarray) -> None:
    """P [n,n] <- F P F^T + SQ SQ^T; F [n,n], SQ [n,nq], workspace W [n,n]."""
    n = P.shape[0]
    block_product(F, P, n, n, n, W)
    symmetric(W, F, n, n, P)
    add_factor(P, n, SQ)


@jit
def measurement_update(
    H: np.ndarray, r: np.ndarray, m: int, P: np.ndarray, K: np.ndarray, Sy: np.ndarray, KR: np.ndarray, W: np.ndarray,
    A: np.ndarray,
) -> int:  # fmt: skip
    """Gain K [n,>=m], innovation factor Sy [>=m,>=m] and P [n,n] in Joseph's form; H [>=m,n], r [>=m] 1-sigma.

    Workspaces KR [n,>=m], W [max(n,m),n], A [max(n,m), max(n,m)]. Returns 1 if the innovation covariance is indefinite.
    """
    n = P.shape[0]
    cross_covariance(P, H, m, K)
    for a in range(m):
        for b in range(a):
            A[a, b] = 0.0
        A[a, a] = r[a] * r[a]
    innovation_covariance(H, K, m, A)
    if chol_psd(A, m, Sy):
        return 1
    gain(K, n, Sy, m)
    for i in range(n):
        for a in range(m):
            KR[i, a] = K[i, a] * r[a] * r[a]
    joseph(P, H, m, K, KR, A, W)
    return 0


@jit
def correct_points(
    Y: np.ndarray, d: np.ndarray, y: np.ndarray, r: np.ndarray, m: int, x: np.ndarray, P: np.ndarray, nu: np.ndarray,
    H: np.ndarray, K: np.ndarray, Sy: np.ndarray, KR: np.ndarray, W: np.ndarray, A: np.ndarray,
) -> float:  # fmt: skip
    """Measurement update from the images Y [2n+1,>=m] of `spread` points; returns NIS, or -1 when it was refused."""
    slopes(Y, m, x.shape[0], d, H)
    for a in range(m):
        nu[a] = y[a] - Y[CENTRE, a]
    if measurement_update(H, r, m, P, K, Sy, KR, W, A):
        return -1.0
    return apply_innovation(K, nu, m, Sy, x, W[0])


class KalmanFilter(CovarianceFilter):
    """Linear filter. Use `predict_linear`/`update_linear` with matrices, or the point interface with an affine model."""

    step = 1.0  # [-] difference step in units of each state's sigma

    def __init__(self, n: int, m: int, nq: int) -> None:
        """n states, m measurements at most, nq columns of process-noise factor. Raises ValueError for sizes below 1."""
        super().__init__(n, m, nq, 2 * n + 1)
        big = max(n, m)
        self.F = np.eye(n)
        self.H = np.zeros((m, n))
        self._d = np.ones(n)
        self._KR = np.zeros((n, m))
        self._W = np.zeros((big, big))
        self._A = np.zeros((big, big))

    def draw(self) -> Array:
        """Points X [2n+1,n]: the mean and steps either way along every axis."""
        root_diagonal(self.P, self.sigma)
        spread(self.x, self.sigma, self.step, self._d, self.X)
        return self.X

    def recombine(self) -> None:
        """Time update: mean is the propagated centre, F [n,n] the central differences of the propagated points."""
        slopes(self.X, self.n, self.n, self._d, self.F)
        self.x[:] = self.X[CENTRE]
        time_update(self.F, self.SQ, self.P, self._W)

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update from Y[:, :m]; y, r [>=m]; returns NIS. An indefinite innovation covariance is counted
        in `failures` and the update refused (NIS -1).
        """
        nis = float(
            correct_points(
                self.Y, self._d, y, r, m, self.x, self.P, self.nu, self.H, self.K, self.Sy, self._KR, self._W, self._A
            )
        )
        self.failures += nis < 0.0
        return nis

    def predict_linear(self, F: Array, SQ: Array, b: Array | float = 0.0) -> None:
        """x <- F x + b, P <- F P F^T + SQ SQ^T; F [n,n], SQ [n,any], b [n]."""
        self.F[:] = F
        was = self.x.copy()
        matvec(self.F, was, self.x)
        self.x += b
        time_update(self.F, np.ascontiguousarray(SQ, dtype=float), self.P, self._W)

    def update_linear(self, H: Array, y: Array, r: Array) -> float:
        """Measurement y [k] = H x + v, H [k,n], v of 1-sigma r [k], k <= m; returns NIS (-1: refused)."""
        k = len(y)
        self.H[:k] = H
        matvec(self.H, self.x, self.nu)
        self.nu[:k] = y - self.nu[:k]
        r = np.asarray(r, dtype=float)
        if measurement_update(self.H, r, k, self.P, self.K, self.Sy, self._KR, self._W, self._A):
            self.failures += 1
            return -1.0
        return float(apply_innovation(self.K, self.nu, k, self.Sy, self.x, self._W[0]))
