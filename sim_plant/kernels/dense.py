"""Sampled linear systems with explicit loops: the same bits in every process and on every processor.

The linear algebra library picks its kernels by processor; the last digits of what it returns would enter the truth.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit, jit_own

Arr = NDArray[np.float64]


@jit
def times(a: Arr, b: Arr, out: Arr) -> None:
    """out [n, m] <- a [n, k] b [k, m]."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            s = 0.0
            for k in range(a.shape[1]):
                s += a[i, k] * b[k, j]
            out[i, j] = s


@jit
def double_step(f: Arr, q: Arr, w: Arr) -> None:
    """(f, q) [n, n] of a step <- those of two: q + f q f^T, f f; w [n, n] is workspace."""
    n = f.shape[0]
    times(f, q, w)
    for i in range(n):
        for j in range(i + 1):
            s = 0.0
            for k in range(n):
                s += w[i, k] * f[j, k]
            q[i, j] += s
            if i != j:
                q[j, i] = q[i, j]
    times(f, f, w)
    for i in range(n):
        for j in range(n):
            f[i, j] = w[i, j]


@jit_own
def sample(a: Arr, bbt: Arr, dt: float, f: Arr, q: Arr) -> None:
    """f [n, n] <- exp(a dt), q [n, n] <- int_0^dt exp(a s) bbt exp(a s)^T ds; bbt [n, n] symmetric, per second.

    Lie series over a step with |a| h <= 1/8: q = sum h^k/k! D_k, D_1 = bbt, D_k+1 = a D_k + D_k a^T; then doubling.
    """
    n = a.shape[0]
    size = 0.0
    for j in range(n):
        s = 0.0
        for i in range(n):
            s += abs(a[i, j])
        size = max(size, s)
    h = dt
    steps = 0
    while size * h > 0.125:
        h *= 0.5
        steps += 1
    p, d, w = np.eye(n), bbt * h, np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            f[i, j], q[i, j] = p[i, j], d[i, j]
    for k in range(1, 13):
        times(a, p, w)
        for i in range(n):
            for j in range(n):
                p[i, j] = w[i, j] * h / k
                f[i, j] += p[i, j]
        times(a, d, w)
        for i in range(n):
            for j in range(n):
                d[i, j] = (w[i, j] + w[j, i]) * h / (k + 1)
                q[i, j] += d[i, j]
    for _ in range(steps):
        double_step(f, q, w)


@jit_own
def settle(f: Arr, q: Arr) -> bool:
    """q [n, n] <- stationary covariance p = f p f^T + q by doubling; f [n, n] is overwritten. False if f does not decay."""
    n = f.shape[0]
    w = np.zeros((n, n))
    for _ in range(64):
        double_step(f, q, w)
        gone = True
        for i in range(n):
            for j in range(n):
                gone = gone and abs(f[i, j]) < 1e-20
        if gone:
            return True
    return False


@jit
def lower_factor(p: Arr, out: Arr) -> bool:
    """out [n, n] <- lower triangle with out out^T = p [n, n]; False when p is not positive definite."""
    n = p.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
    for j in range(n):
        s = p[j, j]
        for k in range(j):
            s -= out[j, k] * out[j, k]
        if not s > 0.0:
            return False
        out[j, j] = math.sqrt(s)
        for i in range(j + 1, n):
            s = p[i, j]
            for k in range(j):
                s -= out[i, k] * out[j, k]
            out[i, j] = s / out[j, j]
    return True
