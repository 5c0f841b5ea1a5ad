"""Reference for sampled linear models: well conditioned for any step, unlike one exponential of the block matrix.

The block exponential of van Loan holds exp(-A dt) beside exp(A dt): for a step of many time constants the modes that grow in the
first swamp what is wanted (1e90 at 900 s of a 3.6 s mode), and what rounding makes of that depends on the processor's kernels.
Here a short step is summed as a series and then doubled: terms of one sign, nothing that cancels.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

Array = np.ndarray


def transition_and_noise(A: Array, Xi: Array, dt: float) -> tuple[Array, Array]:
    """exp(A dt) [n,n] and int_0^dt exp(A s) Xi exp(A s)^T ds [n,n]; A [n,n] without growing modes, Xi [n,n] symmetric."""
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(A).sum(axis=1).max() * dt, 1e-300)))) + 2)
    h = dt / 2.0**halvings
    F, D = expm(A * h), Xi * h
    Q = D.copy()
    for k in range(2, 20):
        D = (A @ D + D @ A.T) * (h / k)
        Q += D
    for _ in range(halvings):
        Q = Q + F @ Q @ F.T
        F = F @ F
    return F, 0.5 * (Q + Q.T)
