"""Dryden turbulence as an exactly discretised linear system.

Shaping filters of lee.md section 3.5 with erratum E13; their unit noise has autocorrelation pi delta(t) (lee.md trap 8).
One-sided spectra: u: sigma^2 2L/(pi V) / (1 + (L w/V)^2); v, w: sigma^2 L/(pi V) (1 + 3 (L w/V)^2) / (1 + (L w/V)^2)^2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.dense import lower_factor, sample, settle
from sim_plant.rng import BLOCK, generator
from sim_plant.wind.air import linear_block

Arr = NDArray[np.float64]


def shaping(V: float, L: float, sigma: float) -> tuple[Arr, Arr, Arr]:
    """Continuous A [5, 5], noise intensity B B^T [5, 5], output C [3, 5] for gusts (u, v, w) [m/s] at airspeed V [m/s],
    scale length L [m]. Source: MIL-F-8785C Dryden forms; lee.md section 3.5."""
    w0 = V / L
    a = np.zeros((5, 5))
    b = np.zeros(5)  # each state is driven by the noise of one axis
    c = np.zeros((3, 5))
    a[0, 0] = -w0
    b[0] = sigma * math.sqrt(2.0 * V / (math.pi * L))
    c[0, 0] = 1.0
    for axis, i in ((1, 1), (2, 3)):
        a[i, i + 1] = 1.0
        a[i + 1, i], a[i + 1, i + 1] = -w0 * w0, -2.0 * w0
        b[i + 1] = 1.0
        c[axis, i] = sigma / math.sqrt(math.pi) * w0**1.5
        c[axis, i + 1] = sigma * math.sqrt(3.0 * w0 / math.pi)
    return a, math.pi * np.diag(b * b), c


def discretise(a: Arr, bbt: Arr, dt: float) -> tuple[Arr, Arr]:
    """Transition matrix and covariance of the noise added in one step dt [s]; both [n, n]."""
    phi, q = np.zeros_like(a), np.zeros_like(a)
    sample(np.ascontiguousarray(a), np.ascontiguousarray(bbt), dt, phi, q)
    return phi, q


def factor(p: Arr) -> Arr:
    """Lower-triangular factor [n, n] of a covariance. Raises ArithmeticError when it is not positive definite."""
    out = np.zeros_like(p)
    if not lower_factor(p, out):
        raise ArithmeticError(f"covariance {p.tolist()} is not positive definite")
    return out


def noise_factor(q: Arr) -> Arr:
    """Factor [n, n] of a step's covariance; a tiny ridge keeps the nearly singular one of a short step alive."""
    return factor(q + np.diag(np.maximum(np.diag(q), 1e-300) * 1e-13))


def stationary_draw(phi: Arr, q: Arr, rng: np.random.Generator) -> Arr:
    """State [n] drawn from the stationary distribution of x' = phi x + n, cov n = q. Raises ArithmeticError without one."""
    p, unit, n = q.copy(), rng.standard_normal(len(q)), len(q)
    if not settle(phi.copy(), p):
        raise ArithmeticError(f"transition {phi.tolist()} does not decay")
    low = factor(p)
    return np.array([sum(low[i, j] * unit[j] for j in range(i + 1)) for i in range(n)])


class DrydenSeries:
    """Gust series (u, v, w) [m/s], one row per tick, in blocks of BLOCK rows; started from the stationary
    distribution."""

    def __init__(self, seed: int, name: str, V: float, L: float, sigma: float, dt: float) -> None:
        self.rows = np.zeros((BLOCK, 3))
        self._rng = generator(seed, name)
        self._active = sigma > 0.0
        if not self._active:
            return
        a, bbt, c = shaping(V, L, sigma)
        self._phi, q = discretise(a, bbt, dt)
        self._c, self._chol = c, noise_factor(q)
        self._x = stationary_draw(self._phi, q, self._rng)
        self._tmp = np.zeros(5)

    def advance(self) -> Arr:
        """Fill `rows` [BLOCK, 3] with the next values and return it (the array is reused)."""
        if self._active:
            noise = self._rng.standard_normal((BLOCK, 5))
            linear_block(self._x, self._phi, self._chol, self._c, noise, self._tmp, self.rows)
        return self.rows
