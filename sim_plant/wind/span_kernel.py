"""Correlations of isotropic turbulence on lines side by side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit, jit_own

Arr = NDArray[np.float64]
KARMAN = 1.339  # [-] MIL-F-8785C 3.7.1.2
GAMMA_THIRD = 2.678938534707747  # [-] Gamma(1/3)
STEP, TERMS = 0.1, 360  # of the integral of K: below exp(-98) of it is lost by the step, nothing by the end


@jit
def bessel(z: float, by: Arr) -> tuple[float, float]:
    """K_1/3 and K_2/3 of z > 1e-13: integral of exp(-z cosh t) cosh(nu t) over t > 0 (DLMF 10.32.9) by the trapezoid, which
    converges exponentially; by [TERMS, 3]: cosh of t, t/3, 2t/3."""
    third = two = 0.5 * math.exp(-z)
    for i in range(1, by.shape[0]):
        x = z * by[i, 0]
        if x > 745.0:
            break
        e = math.exp(-x)
        third += e * by[i, 1]
        two += e * by[i, 2]
    return STEP * third, STEP * two


@jit_own
def correlate(karman: bool, y: Arr, step_m: float, L: float, out: Arr) -> None:
    """out [3, len(y), m] <- correlation [-] of u, v, w between lines y [m] apart, i * step_m [m] along; scale length L [m].

    g + (f - g) (x^2, y^2, 0) / r^2: Dryden f = exp(-r/L), von Karman 2^(2/3)/Gamma(1/3) z^(1/3) K_1/3(z), z = r/(1.339 L);
    g = f + r/2 df/dr. Batchelor (1953) eq. 3.4.5.
    """
    by = np.zeros((TERMS, 3))
    for i in range(TERMS):
        t = STEP * i
        by[i, 0], by[i, 1], by[i, 2] = math.cosh(t), math.cosh(t / 3.0), math.cosh(2.0 * t / 3.0)
    c = 2.0 ** (2.0 / 3.0) / GAMMA_THIRD
    for j in range(y.shape[0]):
        for i in range(out.shape[2]):
            x = i * step_m
            r2 = x * x + y[j] * y[j]
            r = math.sqrt(r2)
            if r < 1e-9 * L:
                out[0, j, i] = out[1, j, i] = out[2, j, i] = 1.0
                continue
            if karman:
                z = r / (KARMAN * L)
                third, two = bessel(z, by)
                lead = c * z ** (1.0 / 3.0)
                f, fall = lead * third, 0.5 * lead * z * two
            else:
                f = math.exp(-r / L)
                fall = f * 0.5 * r / L
            g = f - fall
            out[0, j, i] = g + fall * x * x / r2
            out[1, j, i] = g + fall * y[j] * y[j] / r2
            out[2, j, i] = g
