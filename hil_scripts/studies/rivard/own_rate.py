"""Truth of a bearing and a data link at rates of their own, for geometry_kernel.py: errors correlated in time.

What comes ten times a second is not ten times as good. A set's bearing wanders with its servo and with reflections, a position
with the receiver's navigation. White errors of one sample in ten seconds, as the works take them, are continued here to any
rate as a first-order Gauss-Markov error of the same sigma. With a correlation time of 5 s samples ten seconds apart are as good
as independent (e^-2), as there, and the mean over a time long against that is as good as that of white samples ten seconds
apart (2 tau sigma^2 per second against 10 sigma^2): nothing is gained but that it comes at once. For a turn of 1.5 deg/s
5 s is also the least favourable time: slower errors hide it less, and faster ones average away.
"""

from __future__ import annotations

import math

import numba
import numpy as np

jit = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True)

A_B, A_X, A_Y, A_NEXT, A_N = range(5)  # errors of bearing [rad], x, y [m]; next normal


@jit
def draw(a: np.ndarray, U: np.ndarray) -> float:
    """The next unit normal of U [draws]."""
    z = U[int(a[A_NEXT])]
    a[A_NEXT] += 1.0
    return z


@jit
def start(a: np.ndarray, U: np.ndarray, bearing: float, link: float) -> None:
    """a [4] <- stationary errors of these sigmas [rad], [m]."""
    a[A_NEXT] = 0.0
    a[A_B] = bearing * draw(a, U)
    a[A_X] = link * draw(a, U)
    a[A_Y] = link * draw(a, U)


@jit
def fade(a: np.ndarray, at: int, count: int, dt: float, tau: float, sigma: float, U: np.ndarray) -> None:
    """Carry `count` errors from `at` on over dt [s]; tau 0: white."""
    f = math.exp(-dt / tau) if tau > 0.0 else 0.0
    for j in range(at, at + count):
        a[j] = f * a[j] + sigma * math.sqrt(1.0 - f * f) * draw(a, U)
