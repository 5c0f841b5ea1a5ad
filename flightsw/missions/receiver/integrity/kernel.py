"""The bank's filters, all at once: Kalman filters over one state, told apart by what they leave out and what they distrust.

Every reading is a scalar row; rows of one instant have independent noise, so one after the other gives the joint correction
(Bierman 1977; separation.md 1, 2) and, summed, the joint log-likelihood.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.layout import B_AB, B_D, B_U


@jit
def predict(
    X: np.ndarray, P: np.ndarray, decay: np.ndarray, q: np.ndarray, a: np.ndarray, accel2: float, dt: float
) -> None:  # fmt: skip
    """All filters dt [s] on: d' = u, u' = a + its slow error + white of density accel2 [m^2/s^3], the errors first-order
    Gauss-Markov.

    X [M,n], P [M,n,n]; a [3] m/s^2; decay [n] their phi over dt, q [M,n] variance added over dt.
    """
    n = X.shape[1]
    for m in range(X.shape[0]):
        x, p = X[m], P[m]
        for i in range(3):
            x[B_D + i] += dt * (x[B_U + i] + 0.5 * dt * a[i])
            x[B_U + i] += dt * (a[i] + x[B_AB + i])
            for j in range(n):
                p[B_D + i, j] += dt * p[B_U + i, j]
                p[B_U + i, j] += dt * p[B_AB + i, j]
        for i in range(n):
            for k in range(3):
                p[i, B_D + k] += dt * p[i, B_U + k]
                p[i, B_U + k] += dt * p[i, B_AB + k]
        for i in range(n):
            x[i] *= decay[i]
            for j in range(n):
                p[i, j] *= decay[i] * decay[j]
            p[i, i] += q[m, i]
        for i in range(3):
            k, b = B_D + i, B_U + i
            p[b, b] += accel2 * dt
            p[k, k] += accel2 * dt * dt * dt / 3.0
            p[k, b] += 0.5 * accel2 * dt * dt
            p[b, k] += 0.5 * accel2 * dt * dt


@jit
def innovations(
    x: np.ndarray, p: np.ndarray, H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int, out: np.ndarray
) -> float:  # fmt: skip
    """out [>=k] <- innovations, in their sigmas, of the rows H [>=k,n], readings y, variances r, each by itself, at x [n],
    p [n,n]; the largest magnitude."""
    n = x.shape[0]
    worst = 0.0
    for row in range(k):
        nu, s = y[row], r[row]
        for i in range(n):
            h = H[row, i]
            if h != 0.0:
                nu -= h * x[i]
                for j in range(n):
                    s += h * p[i, j] * H[row, j]
        out[row] = nu / math.sqrt(s)
        worst = max(worst, abs(out[row]))
    return worst


@jit
def correct(
    X: np.ndarray, P: np.ndarray, L: np.ndarray, left_out: np.ndarray, bit: int,
    H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int,
) -> None:  # fmt: skip
    """Correct every filter that does not leave source `bit` out by the k rows of H [>=k,n], readings y, variances r.

    X [M,n], P [M,n,n]; L [M] log-likelihoods grow by those of the readings; left_out [M] bit masks.
    """
    n = X.shape[1]
    g = np.empty(n)
    for m in range(X.shape[0]):
        if left_out[m] & bit:
            continue
        x, p = X[m], P[m]
        for row in range(k):
            nu, s = y[row], r[row]
            g[:] = 0.0
            for i in range(n):
                h = H[row, i]
                if h != 0.0:
                    nu -= h * x[i]
                    for j in range(n):
                        g[j] += h * p[i, j]
            for i in range(n):
                h = H[row, i]
                if h != 0.0:
                    s += h * g[i]
            L[m] -= 0.5 * (nu * nu / s + math.log(2.0 * math.pi * s))
            for i in range(n):
                gain = g[i] / s
                x[i] += gain * nu
                for j in range(n):
                    p[i, j] -= gain * g[j]


@jit
def variance(p: np.ndarray, h: np.ndarray) -> float:
    """h p h' of a row h [n] and a covariance p [n,n]."""
    n = h.shape[0]
    s = 0.0
    for i in range(n):
        if h[i] != 0.0:
            for j in range(n):
                s += h[i] * p[i, j] * h[j]
    return s


@jit
def separation(X: np.ndarray, P: np.ndarray, m: int, place: np.ndarray, out: np.ndarray) -> float:
    """out [3] <- |position of filter m less that of filter 0| [m], positions being place [3,n] times the state; the largest over
    its sigma, sqrt(P_m - P_0) (Blanch et al. 2012). X [M,n], P [M,n,n]."""
    worst = 0.0
    for i in range(3):
        d = 0.0
        for j in range(X.shape[1]):
            d += place[i, j] * (X[m, j] - X[0, j])
        out[i] = abs(d)
        own, less = variance(P[m], place[i]), variance(P[0], place[i])
        worst = max(worst, out[i] / math.sqrt(max(own - less, 1e-4 * own)))
    return worst
