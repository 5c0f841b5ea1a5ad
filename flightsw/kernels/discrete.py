"""Sampled models and the discrete Riccati equation with explicit loops: the same bits in every process and on every processor."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.linalg import product, solve


@jit
def discretise(
    A: np.ndarray, B: np.ndarray, Xi: np.ndarray, dt: float, F: np.ndarray, G: np.ndarray, Qd: np.ndarray,
    W: np.ndarray,
) -> None:  # fmt: skip
    """F [n,n] = exp(A dt), G [n,m] = int exp(A s) ds B, Qd [n,n] = int exp(A s) Xi exp(A s)^T ds over dt [s].

    Taylor series of ten terms over a short step (norm of A h at most 1/16), then doubling: Qd <- Qd + F Qd F^T, G <- G + F G,
    F <- F F. Explicit sums, so that every process gets the same bits (van Loan 1978 gives the same numbers). W [4,n,n].
    """
    n, m = A.shape[0], B.shape[1]
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(A[i, j])
        norm = max(norm, row)
    h = dt
    doublings = 0
    while norm * h > 0.0625:
        h *= 0.5
        doublings += 1
    term, moment, a, b = W[0], W[1], W[2], W[3]
    for i in range(n):
        for j in range(n):
            term[i, j] = 1.0 if i == j else 0.0
            F[i, j] = term[i, j]
            moment[i, j] = Xi[i, j] * h
            Qd[i, j] = moment[i, j]
            b[i, j] = term[i, j] * h  # integral of the transition matrix
    for k in range(1, 11):
        product(A, term, a)
        for i in range(n):
            for j in range(n):
                term[i, j] = a[i, j] * h / k
                F[i, j] += term[i, j]
                b[i, j] += term[i, j] * h / (k + 1)
        product(A, moment, a)
        for i in range(n):
            for j in range(i + 1):
                s = (a[i, j] + a[j, i]) * h / (k + 1)
                moment[i, j] = s
                moment[j, i] = s
                Qd[i, j] += s
                if i != j:
                    Qd[j, i] += s
    for i in range(n):
        for j in range(m):
            s = 0.0
            for k in range(n):
                s += b[i, k] * B[k, j]
            G[i, j] = s
    for _ in range(doublings):
        product(F, Qd, a)
        for i in range(n):
            for j in range(i + 1):
                s = 0.0
                for k in range(n):
                    s += a[i, k] * F[j, k]
                moment[i, j] = s
        for i in range(n):
            for j in range(i + 1):
                Qd[i, j] += moment[i, j]
                if i != j:
                    Qd[j, i] += moment[i, j]
        for j in range(m):
            for i in range(n):
                s = G[i, j]
                for k in range(n):
                    s += F[i, k] * G[k, j]
                a[i, 0] = s
            for i in range(n):
                G[i, j] = a[i, 0]
        product(F, F, a)
        for i in range(n):
            for j in range(n):
                F[i, j] = a[i, j]


@jit
def _symmetric_sum(H: np.ndarray, D: np.ndarray) -> float:
    """H [n,n] += symmetric part of D [n,n]; returns the largest change relative to the largest entry of the new H."""
    n = H.shape[0]
    change, size = 0.0, 0.0
    for i in range(n):
        for j in range(i + 1):
            d = 0.5 * (D[i, j] + D[j, i])
            H[i, j] += d
            H[j, i] = H[i, j]
            change, size = max(change, abs(d)), max(size, abs(H[i, j]))
    return change / size if size > 0.0 else 0.0


@jit_own
def riccati(A: np.ndarray, G: np.ndarray, H: np.ndarray) -> float:
    """H [n,n] <- X, the stabilising solution of X = H + A^T X (I + G X)^-1 A, by structured doubling.

    A [n,n], G [n,n] = B R^-1 B^T and H (the state weight) are overwritten. Returns the size of what is left of the closed
    loop's power A_k = (A_c)^(2^k): about 0 when solved, infinite or not a number where there is no stabilising solution.
    Chu, Fan, Lin and Wang, Int. J. Control 77(8), 2004, 767-788 (SDA): A <- A (I+GH)^-1 A, G <- G + A (I+GH)^-1 G A^T,
    H <- H + A^T H (I+GH)^-1 A; quadratic once the closed loop decays. Exact to some units of rounding for an A that grows little
    in a period; digits go with the square of that growth (1e-6 left at a factor of 3.5).
    """
    n = A.shape[0]
    W, E, U, V = np.zeros((n, n)), np.zeros((n, 2 * n)), np.zeros((n, n)), np.zeros((n, n))
    left = np.inf
    for _ in range(50):  # 2^50 periods: a closed loop that has not decayed by then does not
        product(G, H, W)
        for i in range(n):
            W[i, i] += 1.0
            for j in range(n):
                E[i, j] = A[i, j]
                E[i, n + j] = G[i, j]
        if not solve(W, E):
            return np.inf
        for i in range(n):  # U = A^T H
            for j in range(n):
                s = 0.0
                for k in range(n):
                    s += A[k, i] * H[k, j]
                U[i, j] = s
        for i in range(n):
            for j in range(n):
                W[i, j] = E[i, j]
        product(U, W, V)
        change = _symmetric_sum(H, V)
        for i in range(n):
            for j in range(n):
                U[i, j] = E[i, n + j]
        product(A, U, V)
        for i in range(n):  # U = A (I+GH)^-1 G A^T
            for j in range(n):
                s = 0.0
                for k in range(n):
                    s += V[i, k] * A[j, k]
                U[i, j] = s
        _symmetric_sum(G, U)
        product(A, W, V)
        left = 0.0
        for i in range(n):
            for j in range(n):
                if not abs(V[i, j]) < np.inf:  # NaN too
                    return np.inf
                A[i, j] = V[i, j]
                left = max(left, abs(V[i, j]))
        if change <= 1e-16 and left < 1e-6:
            break
    return left


@jit_own
def spectral_radius(M: np.ndarray) -> float:
    """Largest magnitude of an eigenvalue of M [n,n] (overwritten): |M^(2^k)|^(1/2^k) for k = 40 (Gelfand's formula).

    The norm is off by a constant factor at most, whose 2^40-th root is 1 to 12 digits.
    """
    n = M.shape[0]
    W = np.zeros((n, n))
    log, weight = 0.0, 1.0
    for _ in range(40):
        size = 0.0
        for i in range(n):
            for j in range(n):
                if not abs(M[i, j]) < np.inf:  # NaN too
                    return np.inf
                size = max(size, abs(M[i, j]))
        if size == 0.0:
            return 0.0
        log += weight * math.log(size)
        for i in range(n):
            for j in range(n):
                M[i, j] /= size
        product(M, M, W)
        for i in range(n):
            for j in range(n):
                M[i, j] = W[i, j]
        weight *= 0.5
    return math.exp(log)
