"""Small dense linear algebra with explicit loops: bit-stable from machine to machine, allocation-free.

Whatever flies uses these and not the linear algebra library, whose last digits depend on the processor and on how arrays lie in
memory.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.products import block_product, symmetric


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
            r = i + 1
            while r + 3 < n:  # four rows side by side: a sum waits for itself, four do not wait for each other
                d0 = d1 = d2 = d3 = 0.0
                for j in range(i, k):
                    v = A[i, j]
                    d0 += v * A[r, j]
                    d1 += v * A[r + 1, j]
                    d2 += v * A[r + 2, j]
                    d3 += v * A[r + 3, j]
                d0, d1, d2, d3 = 2.0 * d0 / vv, 2.0 * d1 / vv, 2.0 * d2 / vv, 2.0 * d3 / vv
                for j in range(i, k):
                    v = A[i, j]
                    A[r, j] -= d0 * v
                    A[r + 1, j] -= d1 * v
                    A[r + 2, j] -= d2 * v
                    A[r + 3, j] -= d3 * v
                r += 4
            while r < n:
                d = 0.0
                for j in range(i, k):
                    d += A[i, j] * A[r, j]
                d = 2.0 * d / vv
                for j in range(i, k):
                    A[r, j] -= d * A[i, j]
                r += 1
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


@jit
def cholesky(A: np.ndarray, n: int) -> bool:
    """A [>=n,>=n] <- its lower Cholesky factor (the upper part is left as it is); False if A is not positive definite.

    Golub and Van Loan, Matrix Computations, 4th ed., sec. 4.2.
    """
    for j in range(n):
        s = A[j, j]
        for k in range(j):
            s -= A[j, k] * A[j, k]
        if not s > 0.0:
            return False
        A[j, j] = math.sqrt(s)
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / A[j, j]
    return True


@jit
def product(A: np.ndarray, B: np.ndarray, out: np.ndarray) -> None:
    """out [n,m] <- A [n,k] B [k,m]; out is neither."""
    block_product(A, B, A.shape[0], A.shape[1], B.shape[1], out)


@jit
def matvec(A: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    """out [n] <- A [n,m] x [m]; out is not x."""
    n, m = A.shape
    i = 0
    while i + 3 < n:  # four sums side by side, as in products.py
        s, t, u, v = 0.0, 0.0, 0.0, 0.0
        for j in range(m):
            b = x[j]
            s += A[i, j] * b
            t += A[i + 1, j] * b
            u += A[i + 2, j] * b
            v += A[i + 3, j] * b
        out[i], out[i + 1], out[i + 2], out[i + 3] = s, t, u, v
        i += 4
    while i < n:
        s = 0.0
        for j in range(m):
            s += A[i, j] * x[j]
        out[i] = s
        i += 1


@jit
def vecmat(w: np.ndarray, A: np.ndarray, out: np.ndarray) -> None:
    """out [m] <- w [n] A [n,m], the weighted sum of the rows; out is not w."""
    for j in range(A.shape[1]):
        s = 0.0
        for i in range(A.shape[0]):
            s += w[i] * A[i, j]
        out[j] = s


@jit
def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of a_i b_i over [n]."""
    s = 0.0
    for i in range(a.shape[0]):
        s += a[i] * b[i]
    return s


@jit
def gram(A: np.ndarray, out: np.ndarray) -> None:
    """out [n,n] <- A A^T of A [n,k], both triangles; out is not A."""
    symmetric(A, A, A.shape[0], A.shape[1], out)


@jit
def finite(x: np.ndarray) -> bool:
    """Whether every number of x [n] is one."""
    bad = 0
    for v in x:
        bad += not math.isfinite(v)
    return bad == 0


@jit
def solve(A: np.ndarray, B: np.ndarray) -> bool:
    """B [n,k] <- A^-1 B by elimination with row pivots; A [n,n] is overwritten. False, B spoilt, for a singular A.

    Golub and Van Loan, Matrix Computations, 4th ed., sec. 3.4.
    """
    n, k = B.shape
    for c in range(n):
        p = c
        for i in range(c + 1, n):
            if abs(A[i, c]) > abs(A[p, c]):
                p = i
        if not abs(A[p, c]) > 0.0:
            return False
        if p != c:
            for j in range(c, n):
                A[c, j], A[p, j] = A[p, j], A[c, j]
            for j in range(k):
                B[c, j], B[p, j] = B[p, j], B[c, j]
        for i in range(c + 1, n):
            f = A[i, c] / A[c, c]
            if f != 0.0:
                for j in range(c + 1, n):
                    A[i, j] -= f * A[c, j]
                for j in range(k):
                    B[i, j] -= f * B[c, j]
    for j in range(k):
        for i in range(n - 1, -1, -1):
            s = B[i, j]
            for c in range(i + 1, n):
                s -= A[i, c] * B[c, j]
            B[i, j] = s / A[i, i]
    return True


def semidefinite_factor(A: np.ndarray) -> np.ndarray:
    """L [n,n], lower triangular, with L L^T = A for a symmetric A [n,n] that is positive semidefinite but for rounding: a pivot
    that is not positive leaves its column zero.

    Golub and Van Loan, Matrix Computations, 4th ed., sec. 4.2.8. For a handful of rows; it needs no compiler.
    """
    n = len(A)
    L = np.zeros((n, n))
    for j in range(n):
        pivot = A[j, j]
        for k in range(j):
            pivot -= L[j, k] * L[j, k]
        if not pivot > 0.0:
            continue
        L[j, j] = math.sqrt(pivot)
        for i in range(j + 1, n):
            s = 0.5 * (A[i, j] + A[j, i])
            for k in range(j):
                s -= L[i, k] * L[j, k]
            L[i, j] = s / L[j, j]
    return L
