"""Riccati design of the gust filter's constant gains, and what can be observed (start-up and studies; not in a flight's loop)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_are, solve_discrete_are

from flightsw.kernels.sampled import sampled

Array = np.ndarray


def kalman_bucy(A: Array, C: Array, Xi: Array, Theta: Array) -> tuple[Array, Array]:
    """Gain K [n,k] = +S C' Theta^-1 and S [n,n] of 0 = A S + S A' - S C' Theta^-1 C S + Xi; seed (1), (2), sign corrected.

    A [n,n], C [k,n], Xi [n,n] and Theta [k,k] intensities. Raises numpy.linalg.LinAlgError without a stabilising solution.
    """
    S = solve_continuous_are(A.T, C.T, Xi, Theta)
    return S @ C.T @ np.linalg.inv(Theta), S


def discrete_gain(A: Array, C: Array, Xi: Array, R: Array, dt: float) -> tuple[Array, Array]:
    """Steady gain K [n,k] of the sampled filter and its covariance after the update P [n,n]; R [k,k] variance per sample."""
    F, _, Q = sampled(A, None, Xi, dt)
    M = solve_discrete_are(F.T, C.T, Q, R)
    K = M @ C.T @ np.linalg.inv(C @ M @ C.T + R)
    J = np.eye(len(A)) - K @ C
    return K, J @ M @ J.T + K @ R @ K.T


def observability(A: Array, C: Array, eigenvalue: complex) -> Array:
    """Singular values [n], descending, of [s I - A; -C] at an eigenvalue s of A; seed (12) (Popov-Belevitch-Hautus)."""
    M = np.vstack([eigenvalue * np.eye(len(A)) - A, -C])
    return np.linalg.svd(M, compute_uv=False)


def pbh_rank(A: Array, C: Array, tol: float = 1e-7) -> tuple[int, float]:
    """Smallest rank over the eigenvalues of A, and the smallest singular value met; n and > 0 when observable."""
    least, low = len(A), np.inf
    for s in np.linalg.eigvals(A):
        sv = observability(A, C, s)
        least, low = min(least, int(np.sum(sv > tol * sv[0]))), min(low, float(sv[-1]))
    return least, low
