"""Products of parts of matrices, four sums side by side: one alone waits for its last addition. Each is summed in its own order,
so the digits are those of one sum after the other."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit


@jit
def block_product(A: np.ndarray, B: np.ndarray, n: int, k: int, m: int, out: np.ndarray) -> None:
    """out [>=n,>=m] <- A B of the first n rows and k columns of A, and m columns of B; out is neither."""
    for i in range(n):
        j = 0
        while j + 3 < m:
            s, t, u, v = 0.0, 0.0, 0.0, 0.0
            for c in range(k):
                a = A[i, c]
                s += a * B[c, j]
                t += a * B[c, j + 1]
                u += a * B[c, j + 2]
                v += a * B[c, j + 3]
            out[i, j], out[i, j + 1], out[i, j + 2], out[i, j + 3] = s, t, u, v
            j += 4
        while j < m:
            s = 0.0
            for c in range(k):
                s += A[i, c] * B[c, j]
            out[i, j] = s
            j += 1


@jit
def product_t(A: np.ndarray, B: np.ndarray, n: int, m: int, k: int, out: np.ndarray) -> None:
    """out [>=n,>=m] <- A B^T of the first k columns of the first n rows of A and m rows of B; out is neither."""
    i = 0
    while i + 3 < n:
        for j in range(m):
            s, t, u, v = 0.0, 0.0, 0.0, 0.0
            for c in range(k):
                b = B[j, c]
                s += A[i, c] * b
                t += A[i + 1, c] * b
                u += A[i + 2, c] * b
                v += A[i + 3, c] * b
            out[i, j], out[i + 1, j], out[i + 2, j], out[i + 3, j] = s, t, u, v
        i += 4
    while i < n:
        for j in range(m):
            s = 0.0
            for c in range(k):
                s += A[i, c] * B[j, c]
            out[i, j] = s
        i += 1


@jit
def add_symmetric(A: np.ndarray, B: np.ndarray, n: int, k: int, P: np.ndarray) -> None:
    """P [>=n,>=n] += A B^T of the first k columns of A, B [>=n,>=k], of which it is known that it is symmetric: the lower
    triangle is read and worked out, both are written."""
    for i in range(n):
        j = 0
        while j <= i:
            if j + 3 < n:  # what lies beyond the diagonal is dropped
                s, t, u, v = P[i, j], P[i, j + 1], P[i, j + 2], P[i, j + 3]
                for c in range(k):
                    a = A[i, c]
                    s += a * B[j, c]
                    t += a * B[j + 1, c]
                    u += a * B[j + 2, c]
                    v += a * B[j + 3, c]
                P[i, j], P[j, i] = s, s
                if j < i:
                    P[i, j + 1], P[j + 1, i] = t, t
                if j + 1 < i:
                    P[i, j + 2], P[j + 2, i] = u, u
                if j + 2 < i:
                    P[i, j + 3], P[j + 3, i] = v, v
                j += 4
            else:
                s = P[i, j]
                for c in range(k):
                    s += A[i, c] * B[j, c]
                P[i, j], P[j, i] = s, s
                j += 1


@jit
def symmetric(A: np.ndarray, B: np.ndarray, n: int, k: int, P: np.ndarray) -> None:
    """P [>=n,>=n] <- A B^T, as `add_symmetric`."""
    for i in range(n):
        for j in range(i + 1):
            P[i, j] = 0.0
    add_symmetric(A, B, n, k, P)
