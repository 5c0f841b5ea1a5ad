"""Kernels of the filters that carry a full covariance: factorisation, gain, quadratic forms, likelihood.

Explicit loops over small matrices, allocation-free, symmetric results written to both triangles.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import backward_sub_t, forward_sub
from flightsw.kernels.products import add_symmetric

LOG_2PI = math.log(2.0 * math.pi)
PSD_TOL = 1e-12  # [-] a pivot below this share of its own diagonal element counts as zero


@jit
def chol_psd(P: np.ndarray, n: int, L: np.ndarray) -> int:
    """L [n,n] <- lower-triangular factor of the symmetric P [n,n] (lower triangle is read). Returns 0, or 1 if P is indefinite.

    A pivot that is zero to rounding gives a zero column (a state that is known exactly); a clearly negative pivot does
    the same and is reported. Cholesky-Banachiewicz, Golub and Van Loan, Matrix Computations, 4th ed., sec. 4.2.
    """
    bad = 0
    for j in range(n):
        s = P[j, j]
        for k in range(j):
            s -= L[j, k] * L[j, k]
        tol = PSD_TOL * abs(P[j, j])
        for i in range(j):
            L[i, j] = 0.0
        if s > tol:
            d = math.sqrt(s)
            L[j, j] = d
            for i in range(j + 1, n):
                t = P[i, j]
                for k in range(j):
                    t -= L[i, k] * L[j, k]
                L[i, j] = t / d
        else:
            # also reached for NaN, where every comparison is false
            if not s >= -tol:
                bad = 1
            for i in range(j, n):
                L[i, j] = 0.0
    return bad


@jit
def _four(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray, L: np.ndarray, m: int) -> None:
    """Rows p, q, r, s [>=m] <- each times (L L^T)^-1; L [>=m,>=m] lower triangular."""
    for a in range(m):
        w, x, y, z = p[a], q[a], r[a], s[a]
        for b in range(a):
            v = L[a, b]
            w -= v * p[b]
            x -= v * q[b]
            y -= v * r[b]
            z -= v * s[b]
        v = L[a, a]
        p[a], q[a], r[a], s[a] = w / v, x / v, y / v, z / v
    for a in range(m - 1, -1, -1):
        w, x, y, z = p[a], q[a], r[a], s[a]
        for b in range(a + 1, m):
            v = L[b, a]
            w -= v * p[b]
            x -= v * q[b]
            y -= v * r[b]
            z -= v * s[b]
        v = L[a, a]
        p[a], q[a], r[a], s[a] = w / v, x / v, y / v, z / v


@jit
def gain(K: np.ndarray, n: int, Sy: np.ndarray, m: int) -> None:
    """K [n,>=m] holds the cross covariance Pxy and becomes Pxy (Sy Sy^T)^-1; Sy [>=m,>=m] lower triangular."""
    i = 0
    while i + 3 < n:  # four rows side by side, each in the order of forward_sub and backward_sub_t: they wait less
        _four(K[i], K[i + 1], K[i + 2], K[i + 3], Sy, m)
        i += 4
    while i < n:
        forward_sub(Sy, m, K[i])
        backward_sub_t(Sy, m, K[i])
        i += 1


@jit
def norm_by(L: np.ndarray, m: int, v: np.ndarray) -> float:
    """|L^-1 v|^2 with L [>=m,>=m] lower triangular; v [>=m] <- L^-1 v."""
    forward_sub(L, m, v)
    s = 0.0
    for a in range(m):
        s += v[a] * v[a]
    return s


@jit
def apply_innovation(K: np.ndarray, nu: np.ndarray, m: int, Sy: np.ndarray, x: np.ndarray, w: np.ndarray) -> float:
    """x [n] += K nu for the innovation nu [>=m]; returns NIS = nu^T (Sy Sy^T)^-1 nu. w [>=m] is workspace."""
    for i in range(x.shape[0]):
        s = 0.0
        for a in range(m):
            s += K[i, a] * nu[a]
        x[i] += s
    for a in range(m):
        w[a] = nu[a]
    return norm_by(Sy, m, w)


@jit
def log_likelihood(nu: np.ndarray, Sy: np.ndarray, m: int, w: np.ndarray) -> float:
    """Natural logarithm of N(nu; 0, Sy Sy^T) for the first m innovations; w [>=m] is workspace."""
    ll = -0.5 * m * LOG_2PI
    for a in range(m):
        w[a] = nu[a]
    forward_sub(Sy, m, w)
    for a in range(m):
        ll -= 0.5 * w[a] * w[a] + math.log(Sy[a, a])
    return ll


@jit
def add_factor(P: np.ndarray, n: int, SQ: np.ndarray) -> None:
    """P [n,n] += SQ SQ^T, SQ [n,nq]; both triangles."""
    add_symmetric(SQ, SQ, n, SQ.shape[1], P)


@jit
def subtract_kpk(P: np.ndarray, n: int, K: np.ndarray, Sy: np.ndarray, m: int, U: np.ndarray) -> None:
    """P [n,n] -= K (Sy Sy^T) K^T through U = K Sy [n,>=m] (workspace); Lee 2011 (3.13g)."""
    for i in range(n):
        for a in range(m):
            s = 0.0
            for b in range(a, m):
                s += K[i, b] * Sy[b, a]
            U[i, a] = s
    for i in range(n):
        for j in range(i + 1):
            s = P[i, j]
            for a in range(m):
                s -= U[i, a] * U[j, a]
            P[i, j] = s
            P[j, i] = s


@jit
def root_diagonal(P: np.ndarray, out: np.ndarray) -> None:
    """out [n] <- square roots of the diagonal of P [n,n]; a negative variance gives 0."""
    for i in range(out.shape[0]):
        out[i] = math.sqrt(max(P[i, i], 0.0))
