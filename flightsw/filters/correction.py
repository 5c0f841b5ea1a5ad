"""Measurement updates of a full covariance, once for all filters: rows in Joseph's form, one scalar, one state read directly.

Explicit loops, allocation-free, symmetric results written to both triangles. Bierman, Factorization Methods (1977), ch. II.
"""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.products import add_symmetric, block_product, product_t, symmetric


@jit
def cross_covariance(P: np.ndarray, H: np.ndarray, m: int, PH: np.ndarray) -> None:
    """PH [n,>=m] <- P H^T of the covariance P [n,n] and the rows H [>=m,n]."""
    product_t(P, H, P.shape[0], m, P.shape[0], PH)


@jit
def innovation_covariance(H: np.ndarray, PH: np.ndarray, m: int, S: np.ndarray) -> None:
    """S [>=m,>=m], which holds the noise R in its lower triangle, becomes H P H^T + R; H [>=m,n], PH [n,>=m] = P H^T."""
    for a in range(m):
        for b in range(a + 1):
            s = S[a, b]
            for k in range(H.shape[1]):
                s += H[a, k] * PH[k, b]
            S[a, b] = s
            S[b, a] = s


@jit
def joseph(
    P: np.ndarray, H: np.ndarray, m: int, K: np.ndarray, KR: np.ndarray, A: np.ndarray, W: np.ndarray
) -> None:  # fmt: skip
    """P [n,n] <- (I - K H) P (I - K H)^T + K R K^T: positive for any gain K [n,>=m]; H [>=m,n], KR [n,>=m] = K R.

    Workspaces A, W [>=n,>=n].
    """
    n = P.shape[0]
    for i in range(n):
        for j in range(n):
            A[i, j] = 1.0 if i == j else 0.0
        for a in range(m):
            g = K[i, a]
            for j in range(n):
                A[i, j] -= g * H[a, j]
    block_product(A, P, n, n, n, W)
    symmetric(W, A, n, n, P)
    add_symmetric(KR, K, n, m, P)


@jit
def scalar_update(x: np.ndarray, P: np.ndarray, k: np.ndarray, nu: float, S: float) -> None:
    """x [n], P [n,n] corrected by one innovation nu of variance S with the optimal gain k / S; k [n] = P h^T of its row h.

    The caller has the row's own shape: it gives k and S = h k + r from the few entries that are not zero.
    """
    for i in range(x.shape[0]):
        g = k[i] / S
        x[i] += g * nu
        for j in range(i + 1):
            P[i, j] -= g * k[j]
            P[j, i] = P[i, j]


@jit
def state_update(
    x: np.ndarray, P: np.ndarray, i: int, e: int, value: float, r: float, gate: float, fixed: np.ndarray, K: np.ndarray,
    row: np.ndarray,
) -> float:  # fmt: skip
    """x [n], P [n,n] corrected by a direct measurement `value` of state i, in error by state e (-1: none) and by noise of
    variance r; returns its NIS.

    Nothing changes when the NIS exceeds `gate`. States with fixed [n] not zero are considered (Schmidt 1966): they keep their
    values. Joseph's form multiplied out, P - K p - p^T K^T + K s K^T with p = h P of the row h, which holds for any gain:
    rounding of the gain enters squared only. Workspaces K, row [n].
    """
    s = P[i, i] + r
    d = value - x[i]
    if e >= 0:
        s += 2.0 * P[i, e] + P[e, e]
        d -= x[e]
    nis = d * d / s
    if not nis <= gate:
        return nis
    n = x.shape[0]
    for k in range(n):
        row[k] = P[i, k]
        if e >= 0:
            row[k] += P[e, k]
        K[k] = 0.0 if fixed[k] != 0 else row[k] / s
    for k in range(n):
        x[k] += K[k] * d
    for a in range(n):
        for b in range(a + 1):
            P[a, b] = P[a, b] - K[a] * row[b] - row[a] * K[b] + K[a] * K[b] * s
            P[b, a] = P[a, b]
    return nis
