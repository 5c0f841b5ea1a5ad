"""Posterior Cramer-Rao bound along a trajectory: what no estimator of the stated problem can beat.

Problem x_{k+1} = f(x_k) + SQ_k w, y_k = h(x_k) + r v, w and v white, Gaussian, unit. The information recursion of Tichavsky,
Muravchik, Nehorai (1998), eq. (21), with the Jacobians on the true trajectory in place of their expectations (Taylor
1979), is written for the covariance B = J^-1:
    B^- = F B F^T + SQ SQ^T,    B = (B^-^-1 + H^T R^-1 H)^-1
and carried as a lower-triangular factor, so that a singular SQ SQ^T and a singular B need no inverse. For linear problems it
is the Kalman filter's covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from flightsw.filters.kalman import CBRT_EPS
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import gram, tria

Array = np.ndarray


@jit
def bound_predict(F: np.ndarray, SQ: np.ndarray, S: np.ndarray, A: np.ndarray) -> None:
    """S [n,n] <- tria[F S, SQ]; F [n,n], SQ [n,nq], workspace A [>=n, >=n+nq]."""
    n = S.shape[0]
    nq = SQ.shape[1]
    for i in range(n):
        for j in range(n):
            s = 0.0
            for k in range(j, n):
                s += F[i, k] * S[k, j]
            A[i, j] = s
        for j in range(nq):
            A[i, n + j] = SQ[i, j]
    tria(A, n, n + nq, S)


@jit
def bound_update(H: np.ndarray, r: np.ndarray, S: np.ndarray, A: np.ndarray, B: np.ndarray) -> None:
    """S [n,n] <- factor after measuring H [m,n] with 1-sigma r [m] > 0: lower right block of tria[[R, H S],[0, S]].

    Workspaces A, B [>=m+n, >=m+n]. Array form of the update, Kailath, Sayed, Hassibi, Linear Estimation (2000), ch. 12.
    """
    n = S.shape[0]
    m = H.shape[0]
    for a in range(m):
        for b in range(m):
            A[a, b] = r[a] if a == b else 0.0
        for j in range(n):
            s = 0.0
            for k in range(j, n):
                s += H[a, k] * S[k, j]
            A[a, m + j] = s
    for i in range(n):
        for b in range(m):
            A[m + i, b] = 0.0
        for j in range(n):
            A[m + i, m + j] = S[i, j]
    tria(A, m + n, m + n, B)
    for i in range(n):
        for j in range(n):
            S[i, j] = B[m + i, m + j]


class PosteriorBound:
    """Recursive bound; `S` [n,n] is the lower-triangular factor of the bound covariance B = S S^T."""

    def __init__(self, S0: Array) -> None:
        """S0 [n,k]: any factor of the covariance of the initial knowledge; the same the filters start with."""
        self.n = n = S0.shape[0]
        self.S = np.zeros((n, n))
        self._size = (0, 0)
        A = np.zeros((n, max(n, S0.shape[1])))
        A[:, : S0.shape[1]] = S0
        tria(A, n, A.shape[1], self.S)

    def _room(self, rows: int, cols: int) -> None:
        if rows > self._size[0] or cols > self._size[1]:
            self._size = (max(rows, self._size[0]), max(cols, self._size[1]))
            self._A, self._B = np.zeros(self._size), np.zeros(self._size)

    def predict(self, F: Array, SQ: Array) -> None:
        """Time step with Jacobian F [n,n] of f at the true state and noise factor SQ [n,nq]."""
        self._room(self.n, self.n + SQ.shape[1])
        bound_predict(np.ascontiguousarray(F, float), np.ascontiguousarray(SQ, float), self.S, self._A)

    def update(self, H: Array, r: Array) -> None:
        """Measurement with Jacobian H [m,n] of h at the true state and 1-sigma r [m]. Raises ValueError unless r > 0."""
        if not (np.asarray(r) > 0.0).all():
            raise ValueError(f"measurement noise r = {np.asarray(r).tolist()}; allowed > 0")
        m = len(r)
        self._room(m + self.n, m + self.n)
        bound_update(np.ascontiguousarray(H, float), np.ascontiguousarray(r, float), self.S, self._A, self._B)

    @property
    def P(self) -> Array:
        """Bound of the error covariance [n,n]."""
        P = np.zeros((self.n, self.n))
        gram(self.S, P)
        return P

    def sigmas(self) -> Array:
        """Bound of every state's RMS error [n]."""
        return np.sqrt(np.sum(self.S * self.S, axis=1))


def trajectory_bound(
    S0: Array, F: Sequence[Array], SQ: Sequence[Array], H: Sequence[Array | None], r: Sequence[Array | None]
) -> Array:
    """Bound sigmas [K,n] after step k = predict(F[k], SQ[k]) and, where H[k] is given, update(H[k], r[k])."""
    b = PosteriorBound(S0)
    out = np.zeros((len(F), b.n))
    for k in range(len(F)):
        b.predict(F[k], SQ[k])
        Hk, rk = H[k], r[k]
        if Hk is not None and rk is not None:
            b.update(Hk, rk)
        out[k] = b.sigmas()
    return out


def jacobian(f: Callable[[Array], Array], x: Array, scale: Array) -> Array:
    """Jacobian [k,n] of f(points [p,n]) -> [p,k] at x [n] by central differences, step cbrt(eps) max(|x|, scale).

    scale [n] > 0: typical size of each state, used where x is near zero.
    """
    d = CBRT_EPS * np.maximum(np.abs(x), scale)
    X = np.concatenate((x + np.diag(d), x - np.diag(d)))
    n = len(x)
    width = np.diag(X[:n] - X[n:]).copy()
    Z = f(X)
    return np.asarray((Z[:n] - Z[n:]).T / width)
