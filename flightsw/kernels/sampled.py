"""Sampled linear models and matrix products for designs made at start-up, in compiled loops of fixed order."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.discrete import discretise
from flightsw.kernels.linalg import product

Array = np.ndarray


def multiply(A: Array, B: Array) -> Array:
    """A B [n,m] of A [n,k] and B [k,m] of any memory layout, in one order of summation. Raises ValueError for other shapes."""
    if A.ndim != 2 or B.ndim != 2 or A.shape[1] != B.shape[0]:
        raise ValueError(f"product of {A.shape} and {B.shape}; allowed: [n,k] and [k,m]")
    out = np.zeros((A.shape[0], B.shape[1]))
    product(np.ascontiguousarray(A, dtype=float), np.ascontiguousarray(B, dtype=float), out)
    return out


def sampled(A: Array, B: Array | None, Xi: Array | None, dt: float) -> tuple[Array, Array, Array]:
    """F = exp(A dt) [n,n], G = int exp(A s) ds B [n,m] and Qd = int exp(A s) Xi exp(A s)' ds [n,n] over dt [s].

    A [n,n] and the intensity Xi [n,n] per second, B [n,m] an input held over the step; None counts as none (m = 0, Xi = 0).
    Only exp(+A s) is formed, so that a stable A has no growing mode to cancel, whatever dt.
    """
    n = len(A)
    B = np.zeros((n, 0)) if B is None else np.ascontiguousarray(B, dtype=float)
    Xi = np.zeros((n, n)) if Xi is None else np.ascontiguousarray(Xi, dtype=float)
    F, G, Qd = np.zeros((n, n)), np.zeros(B.shape), np.zeros((n, n))
    discretise(np.ascontiguousarray(A, dtype=float), B, Xi, dt, F, G, Qd, np.zeros((4, n, n)))
    return F, G, Qd
