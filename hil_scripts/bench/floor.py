"""The least a program with compiled kernels costs to start: `python -m hil_scripts.bench.floor` imports numpy and numba as they
are and calls one kernel that is compiled already."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def total(x: np.ndarray) -> float:
    """Sum of x [n]."""
    s = 0.0
    for v in x:
        s += v
    return s


if __name__ == "__main__":
    total(np.ones(3))
