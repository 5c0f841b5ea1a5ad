"""Rows of the wake position as a witness, in loops of fixed order: their choice, and what they say. Source: separation.md 8."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.linalg import product, solve
from flightsw.missions.receiver.airdata.expected import J_KW, J_W, J_X, J_Y, M_READ

FREE_MPS = 100.0  # [m/s] of the common wind: as good as nothing known
MOST_M = 1.5  # [m] of noise, the worse row: readings that say no more are no witness
LEAST = 4  # readings, more than a wind has components
Y, Z = 0, 1  # rows, across and down


@jit_own
def choose(good: np.ndarray, J: np.ndarray, var: np.ndarray, N: np.ndarray) -> bool:
    """N [2,9] <- rows of the readings good [m] that give y and z by least squares with a free common wind, turned so that their
    noises are independent; False, N as it was: these readings do not tell. J [9,9]: Jacobian, var [9]: noise, of all readings.

    The turn is one Jacobi rotation (Golub and Van Loan, Matrix Computations, 4th ed., sec. 8.5.2).
    """
    m = good.shape[0]
    if m < LEAST:
        return False
    R, B = np.empty((m, m)), np.empty((m, 2))
    for i in range(m):
        for j in range(m):
            s = 0.0
            for k in range(J_W, J_W + 3):
                s += J[good[i], k] * J[good[j], k]
            R[i, j] = FREE_MPS * FREE_MPS * s
        R[i, i] += var[good[i]]
        B[i, Y], B[i, Z] = J[good[i], J_Y], J[good[i], J_Y + 1]
    if not solve(R, B):
        return False
    a, b, d = 0.0, 0.0, 0.0  # the information on y and z
    for i in range(m):
        y, z = J[good[i], J_Y], J[good[i], J_Y + 1]
        a += y * B[i, Y]
        b += 0.5 * (y * B[i, Z] + z * B[i, Y])
        d += z * B[i, Z]
    t = 0.0
    if b != 0.0:
        q = (d - a) / (2.0 * b)
        t = math.copysign(1.0 / (abs(q) + math.sqrt(1.0 + q * q)), q)
    first, second = a - t * b, d + t * b
    if not min(first, second) > 1.0 / (MOST_M * MOST_M):
        return False
    c = 1.0 / math.sqrt(1.0 + t * t)
    s = t * c
    N[:] = 0.0
    for i in range(m):
        N[Y, good[i]] = (c * B[i, Y] - s * B[i, Z]) / first
        N[Z, good[i]] = (s * B[i, Y] + c * B[i, Z]) / second
    return True


@jit
def noise(N: np.ndarray, var: np.ndarray, own: np.ndarray, r: np.ndarray) -> float:
    """r [2] <- variance [m^2] of the rows N [2,9] by the readings' noise var [9] and their own air own [9,9]; the larger."""
    for i in range(2):
        r[i] = 0.0
        for j in range(M_READ):
            s = N[i, j] * var[j]
            for k in range(M_READ):
                s += own[j, k] * N[i, k]
            r[i] += N[i, j] * s
    return max(r[Y], r[Z])


@jit_own
def tell(
    N: np.ndarray, J: np.ndarray, off: np.ndarray, x: np.ndarray, R_nf: np.ndarray, offsets: np.ndarray, learnt: np.ndarray,
    y: np.ndarray, H: np.ndarray, lasting: np.ndarray,
) -> None:  # fmt: skip
    """y [2] m, H [2,3] and variances of the lasting error, lasting [2] m^2, <- the rows N [2,9] of readings that are off [9] from
    what is expected at x [3] m, F, where their Jacobian is J [9,9]. R_nf [3,3]: NED to F; offsets [9], learnt [3]: variances of
    the readings' offsets, of circulations and height."""
    slopes = np.empty((2, 9))
    product(N, J, slopes)
    for i in range(2):
        y[i], lasting[i] = 0.0, 0.0
        for j in range(M_READ):
            y[i] += N[i, j] * off[j]
            lasting[i] += N[i, j] * N[i, j] * offsets[j]
        for k in range(3):
            y[i] += slopes[i, J_X + k] * x[k]
            lasting[i] += slopes[i, J_KW + k] * slopes[i, J_KW + k] * learnt[k]
            H[i, k] = 0.0
            for j in range(3):
                H[i, k] += slopes[i, J_X + j] * R_nf[j, k]
