"""Small dense linear algebra with explicit loops: bit-stable from machine to machine, allocation-free."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit


@jit
def tria(A: np.ndarray, n: int, k: int, L: np.ndarray) -> None:
    """L [n,n] <- lower-triangular factor with L L^T = A A^T and non-negative diagonal; A [n,k] is overwritten, k >= n.

    Householder reflections from the right, row by row (the LQ form of the QR step of a square-root filter).
    """
    for i in range(n):
        s = 0.0
        for j in range(i, k):
            s += A[i, j] * A[i, j]
        norm = math.sqrt(s)
        if norm > 0.0:
            a = A[i, i]
            alpha = -norm if a > 0.0 else norm
            v0 = a - alpha
            # |v|^2 = 2 norm (norm + |a|)
            vv = 2.0 * norm * (norm + abs(a))
            A[i, i] = v0
            for r in range(i + 1, n):
                d = 0.0
                for j in range(i, k):
                    d += A[i, j] * A[r, j]
                d = 2.0 * d / vv
                for j in range(i, k):
                    A[r, j] -= d * A[i, j]
            A[i, i] = alpha
        for j in range(i):
            L[i, j] = A[i, j]
        L[i, i] = A[i, i]
        for j in range(i + 1, n):
            L[i, j] = 0.0
    for c in range(n):
        if L[c, c] < 0.0:
            for r in range(c, n):
                L[r, c] = -L[r, c]


@jit
def forward_sub(L: np.ndarray, n: int, b: np.ndarray) -> None:
    """b [n] <- L^-1 b, L [n,n] lower triangular with non-zero diagonal."""
    for i in range(n):
        s = b[i]
        for j in range(i):
            s -= L[i, j] * b[j]
        b[i] = s / L[i, i]


@jit
def backward_sub_t(L: np.ndarray, n: int, b: np.ndarray) -> None:
    """b [n] <- L^-T b, L [n,n] lower triangular with non-zero diagonal."""
    for i in range(n - 1, -1, -1):
        s = b[i]
        for j in range(i + 1, n):
            s -= L[j, i] * b[j]
        b[i] = s / L[i, i]
