"""Square-root unscented Kalman filter, additive noise, without down-dates.

State covariance is kept as a lower-triangular factor S with P = S S^T. Both measurement and time update form the new
factor by one triangularisation of stacked deviations, so P stays positive semi-definite whatever the rounding
(van der Merwe and Wan 2001 with the rank-1 down-date replaced by tria[DX - K DY, K sqrtR]; Lee 2011, chapter 3).
All weights are non-negative with the default alpha = 1, kappa = 0, beta = 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flightsw.filters.covariance import apply_innovation, chol_psd, gain
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import gram, tria
from flightsw.kernels.products import product_t

CENTRE = 0  # row of the mean among the points


@jit
def draw(x: np.ndarray, S: np.ndarray, g: float, X: np.ndarray) -> None:
    """X [2n+1,n] <- sigma points x, x + g S_j, x - g S_j (S_j = column j of S [n,n])."""
    n = x.shape[0]
    for i in range(n):
        X[CENTRE, i] = x[i]
    for j in range(n):
        for i in range(n):
            d = g * S[i, j]
            X[1 + j, i] = x[i] + d
            X[1 + n + j, i] = x[i] - d


@jit
def _weighted_mean(X: np.ndarray, n: int, w0: float, wi: float, x: np.ndarray) -> None:
    """x [n] <- weighted mean of the points, formed from deviations to the centre point: no cancellation of large values."""
    p = X.shape[0]
    for i in range(n):
        c = X[CENTRE, i]
        s = 0.0
        for k in range(1, p):
            s += X[k, i] - c
        # w0 + (p-1) wi = 1, hence mean = c + wi * sum(X_k - c)
        x[i] = c + wi * s


@jit
def recombine(
    X: np.ndarray, w0m: float, w0c: float, wi: float, SQ: np.ndarray, x: np.ndarray, S: np.ndarray, A: np.ndarray
) -> None:
    """Time update: x [n], S [n,n] <- mean and factor of propagated points X [2n+1,n] plus noise SQ SQ^T, SQ [n,nq].

    A [n, 2n+1+nq] is workspace.
    """
    n = x.shape[0]
    p = X.shape[0]
    _weighted_mean(X, n, w0m, wi, x)
    s0 = math.sqrt(w0c)
    si = math.sqrt(wi)
    for i in range(n):
        for k in range(1, p):
            A[i, k - 1] = si * (X[k, i] - x[i])
        A[i, p - 1] = s0 * (X[CENTRE, i] - x[i])
        for j in range(SQ.shape[1]):
            A[i, p + j] = SQ[i, j]
    tria(A, n, p + SQ.shape[1], S)


@jit
def correct(
    X: np.ndarray,
    Y: np.ndarray,
    y: np.ndarray,
    r: np.ndarray,
    m: int,
    w0m: float,
    w0c: float,
    wi: float,
    x: np.ndarray,
    S: np.ndarray,
    nu: np.ndarray,
    K: np.ndarray,
    Sy: np.ndarray,
    A: np.ndarray,
    B: np.ndarray,
    D: np.ndarray,
) -> float:
    """Measurement update in place. X [2n+1,n] points of (x, S); Y [2n+1,>=m] their images; y [>=m] measured; r [>=m] 1-sigma.

    nu [>=m] <- innovation; K [n,>=m] <- gain; Sy [m+,m+] <- factor of the innovation covariance. Workspace A, B
    [max(n,m), 2n+1+m], D [>=m, 2n+1]. Returns the normalised innovation squared nu^T Pyy^-1 nu.
    """
    n = x.shape[0]
    p = X.shape[0]
    s0 = math.sqrt(w0c)
    si = math.sqrt(wi)
    _weighted_mean(Y, m, w0m, wi, nu)  # nu holds the predicted measurement for now
    for a in range(m):
        for k in range(1, p):
            D[a, k - 1] = Y[k, a] - nu[a]
        D[a, p - 1] = Y[CENTRE, a] - nu[a]
        for k in range(p - 1):
            B[a, k] = si * D[a, k]
        B[a, p - 1] = s0 * D[a, p - 1]
    for i in range(n):
        for k in range(1, p):
            A[i, k - 1] = si * (X[k, i] - x[i])
        A[i, p - 1] = s0 * (X[CENTRE, i] - x[i])
    # cross covariance into K, then solve with Sy from the right
    product_t(A, B, n, m, p, K)
    # tria overwrites B; the deviations are in D
    for a in range(m):
        for b in range(m):
            B[a, p + b] = r[a] if a == b else 0.0
    tria(B, m, p + m, Sy)
    gain(K, n, Sy, m)
    for i in range(n):
        for a in range(m):
            g = K[i, a] * si
            for k in range(p - 1):
                A[i, k] -= g * D[a, k]
            A[i, p - 1] -= K[i, a] * s0 * D[a, p - 1]
            A[i, p + a] = K[i, a] * r[a]
    tria(A, n, p + m, S)
    for a in range(m):
        nu[a] = y[a] - nu[a]
    return apply_innovation(K, nu, m, Sy, x, B[0])


@jit
def row_norms(S: np.ndarray, out: np.ndarray) -> None:
    """out [n] <- 1-sigma of every state: norms of the rows of the lower-triangular factor S [n,n]."""
    for i in range(S.shape[0]):
        s = 0.0
        for j in range(i + 1):
            s += S[i, j] * S[i, j]
        out[i] = math.sqrt(s)


class SquareRootUKF:
    """Workspace and state of one filter of n states and at most m measurements.

    The model is applied by the owner between `draw` and `recombine` (or `correct`): `X` holds the points, the owner
    writes their propagated values back into `X`, or their measurement images into `Y`.
    """

    def __init__(self, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float = 0.0, beta: float = 2.0) -> None:
        """n states, m measurements at most, nq columns of process-noise factor.

        Raises ValueError when the scaling would give negative covariance weights (they need down-dates).
        """
        lam = alpha * alpha * (n + kappa) - n
        self.g = math.sqrt(n + lam)
        self.w0m = lam / (n + lam)
        self.w0c = self.w0m + 1.0 - alpha * alpha + beta
        self.wi = 0.5 / (n + lam)
        if self.w0c < 0.0:
            raise ValueError(
                f"alpha={alpha}, kappa={kappa}, beta={beta}: centre weight {self.w0c:.4g} < 0; allowed >= 0"
            )
        self.n, self.m, self.nq = n, m, nq
        self.x = np.zeros(n)
        self.S = np.eye(n)
        self.X = np.zeros((2 * n + 1, n))
        self.Y = np.zeros((2 * n + 1, m))
        self.SQ = np.zeros((n, nq))
        self.sigma = np.zeros(n)
        self.nu = np.zeros(m)
        self.K = np.zeros((n, m))
        self.Sy = np.zeros((m, m))
        big = max(n, m)
        self._A = np.zeros((big, 2 * n + 1 + max(nq, m)))
        self._B = np.zeros((big, 2 * n + 1 + max(nq, m)))
        self._D = np.zeros((m, 2 * n + 1))

    def draw(self) -> np.ndarray:
        """Redraw the sigma points X [2n+1,n] from (x, S)."""
        draw(self.x, self.S, self.g, self.X)
        return self.X

    def recombine(self) -> None:
        """Time update from the propagated points in X and the noise factor SQ [n,nq]."""
        recombine(self.X, self.w0m, self.w0c, self.wi, self.SQ, self.x, self.S, self._A)

    def correct(self, y: np.ndarray, r: np.ndarray, m: int) -> float:
        """Measurement update with the first m columns of Y, measured y [>=m], 1-sigma r [>=m]; returns NIS."""
        return float(
            correct(
                self.X, self.Y, y, r, m, self.w0m, self.w0c, self.wi,
                self.x, self.S, self.nu, self.K, self.Sy, self._A, self._B, self._D,
            )
        )  # fmt: skip

    def arrays(self) -> tuple[np.ndarray, ...]:
        """What a step in one compiled call works on: x, S, X, Y, SQ, workspaces A, B, D of `correct`, nu, K, Sy, sigma."""
        return (
            self.x, self.S, self.X, self.Y, self.SQ, self._A, self._B, self._D, self.nu, self.K, self.Sy, self.sigma,
        )  # fmt: skip

    @property
    def scaling(self) -> tuple[float, float, float, float]:
        """Spread of the points; weights of the centre for the mean, for the covariance, and of every other point."""
        return self.g, self.w0m, self.w0c, self.wi

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n]."""
        row_norms(self.S, self.sigma)
        return self.sigma.tolist()

    def predict(self, f: Callable[[np.ndarray], np.ndarray], SQ: np.ndarray) -> None:
        """Time update with a plain function f(points [2n+1,n]) -> [2n+1,n] and noise factor SQ [n,<=nq]."""
        self.draw()
        self.X[:] = f(self.X)
        self.SQ[:] = 0.0
        self.SQ[:, : SQ.shape[1]] = SQ
        self.recombine()

    def update(self, h: Callable[[np.ndarray], np.ndarray], y: np.ndarray, r: np.ndarray) -> float:
        """Measurement update with a plain function h(points [2n+1,n]) -> [2n+1,k]; y, r [k]; returns NIS."""
        k = len(y)
        self.draw()
        self.Y[:, :k] = h(self.X)
        return self.correct(np.ascontiguousarray(y, dtype=float), np.ascontiguousarray(r, dtype=float), k)

    def memory(self) -> tuple[np.ndarray, ...]:
        """Mean and factor, the filter's own arrays."""
        return self.x, self.S

    @property
    def P(self) -> np.ndarray:
        """Covariance [n,n]."""
        P = np.zeros((self.n, self.n))
        gram(self.S, P)
        return P

    def set_factor(self, S: np.ndarray) -> None:
        """S [n,n] <- lower-triangular factor of S S^T for any S [n,k]."""
        A = np.zeros((self.n, max(S.shape[1], self.n)))
        A[:, : S.shape[1]] = S
        tria(A, self.n, A.shape[1], self.S)

    def set_cov(self, P: np.ndarray) -> None:
        """S <- factor of the symmetric P [n,n]; zero variances are allowed. Raises ValueError when P is indefinite."""
        if chol_psd(np.ascontiguousarray(0.5 * (P + P.T)), self.n, self.S):
            raise ValueError("covariance is indefinite; allowed: symmetric, positive semi-definite")
