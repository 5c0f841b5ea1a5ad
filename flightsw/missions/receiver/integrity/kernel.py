"""The bank's filters, all at once: Kalman filters over one state, told apart by what they leave out and what they distrust.

Every reading is a scalar row; rows of one instant have independent noise, so one after the other gives the joint correction
(Bierman 1977; separation.md 1, 2) and, summed, the joint log-likelihood.
A covariance [n,w] may be wider than its n columns (`width`), with zeros there: what goes over whole rows takes them along.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.receiver.integrity.layout import B_AB, B_D, B_U
from flightsw.missions.receiver.integrity.way_kernel import at

LANES = 4  # numbers a vector instruction takes


def width(n: int) -> int:
    """Columns w of a covariance of n states, whole vectors: of the odd ones at a row's end each would be worked by itself."""
    return -(-n // LANES) * LANES


@jit
def predict(
    X: np.ndarray, P: np.ndarray, decay: np.ndarray, q: np.ndarray, a: np.ndarray, accel2: float, dt: float
) -> None:  # fmt: skip
    """All filters dt [s] on: d' = u, u' = a + its slow error + white of density accel2 [m^2/s^3], the errors first-order
    Gauss-Markov.

    X [M,n], P [M,n,w]; a [3] m/s^2; decay [w] their phi over dt, q [M,n] variance added over dt.
    """
    n, w = X.shape[1], P.shape[2]
    for m in range(X.shape[0]):
        x, p = X[m], P[m]
        for i in range(3):
            x[B_D + i] += dt * (x[B_U + i] + 0.5 * dt * a[i])
            x[B_U + i] += dt * (a[i] + x[B_AB + i])
            for j in range(w):
                p[B_D + i, j] += dt * p[B_U + i, j]
                p[B_U + i, j] += dt * p[B_AB + i, j]
        for i in range(n):
            for k in range(3):
                p[i, B_D + k] += dt * p[i, B_U + k]
                p[i, B_U + k] += dt * p[i, B_AB + k]
        for i in range(n):
            x[i] *= decay[i]
            for j in range(w):
                p[i, j] *= decay[i] * decay[j]
            p[i, i] += q[m, i]
        for i in range(3):
            k, b = B_D + i, B_U + i
            p[b, b] += accel2 * dt
            p[k, k] += accel2 * dt * dt * dt / 3.0
            p[k, b] += 0.5 * accel2 * dt * dt
            p[b, k] += 0.5 * accel2 * dt * dt


@jit_own
def innovations(
    x: np.ndarray, p: np.ndarray, H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int, out: np.ndarray
) -> float:  # fmt: skip
    """out [>=k] <- innovations, in their sigmas, of the rows H [>=k,n], readings y, variances r, each by itself, at x [n],
    p [n,w]; the largest magnitude."""
    n, worst = x.shape[0], 0.0
    filled = np.empty(n, dtype=np.int64)
    for row in range(k):  # most of a row is zero
        some = 0
        for i in range(n):
            if H[row, i] != 0.0:
                filled[some] = i
                some += 1
        nu, s = y[row], r[row]
        for i in filled[:some]:
            h = H[row, i]
            nu -= h * x[i]
            for j in filled[:some]:
                s += h * p[i, j] * H[row, j]
        out[row] = nu / math.sqrt(s)
        worst = max(worst, abs(out[row]))
    return worst


@jit_own
def correct(
    X: np.ndarray, P: np.ndarray, L: np.ndarray, left_out: np.ndarray, bit: int,
    H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int,
) -> None:  # fmt: skip
    """Correct every filter that does not leave source `bit` out by the k rows of H [>=k,n], readings y, variances r.

    X [M,n], P [M,n,w]; L [M] log-likelihoods grow by those of the readings; left_out [M] bit masks.
    """
    n, w = X.shape[1], P.shape[2]
    g, filled, some = np.empty(w), np.empty((k, n), dtype=np.int64), np.zeros(k, dtype=np.int64)
    for row in range(k):  # most of a row is zero
        for i in range(n):
            if H[row, i] != 0.0:
                filled[row, some[row]] = i
                some[row] += 1
    for m in range(X.shape[0]):
        if left_out[m] & bit:
            continue
        x, p = X[m], P[m]
        for row in range(k):
            nu, s = y[row], r[row]
            g[:] = 0.0
            for i in filled[row, : some[row]]:
                h = H[row, i]
                nu -= h * x[i]
                for j in range(w):
                    g[j] += h * p[i, j]
            for i in filled[row, : some[row]]:
                s += H[row, i] * g[i]
            L[m] -= 0.5 * (nu * nu / s + math.log(2.0 * math.pi * s))
            for i in range(n):
                gain = g[i] / s
                x[i] += gain * nu
                for j in range(w):
                    p[i, j] -= gain * g[j]


@jit
def heard(
    X: np.ndarray, P: np.ndarray, L: np.ndarray, left_out: np.ndarray, bit: int,
    H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int, z: np.ndarray,
) -> None:  # fmt: skip
    """`correct`, and before it z [>=k] <- `innovations` against filter 0."""
    innovations(X[0], P[0], H, y, r, k, z)
    correct(X, P, L, left_out, bit, H, y, r, k)


@jit_own
def variances(p: np.ndarray, place: np.ndarray) -> tuple[float, float, float]:
    """h p h' of each row h of place [3,n] and a covariance p [n,w]; the three sums grow side by side, none waits for another."""
    n, some, x, y, z = place.shape[1], 0, 0.0, 0.0, 0.0
    filled = np.empty(n, dtype=np.int64)
    for i in range(n):  # most of place is zero
        if place[0, i] != 0.0 or place[1, i] != 0.0 or place[2, i] != 0.0:
            filled[some] = i
            some += 1
    for i in filled[:some]:
        a, b, c = place[0, i], place[1, i], place[2, i]
        for j in filled[:some]:
            x += a * p[i, j] * place[0, j]
            y += b * p[i, j] * place[1, j]
            z += c * p[i, j] * place[2, j]
    return x, y, z


@jit
def ahead(
    H: np.ndarray, y: np.ndarray, r: np.ndarray, tau: float,
    dx: float, dy: float, dz: float, ex: float, ey: float, ez: float, grown: float,
    H0: np.ndarray, y0: np.ndarray, r0: np.ndarray,
) -> None:  # fmt: skip
    """Rows H [ROWS,n], readings y, variances r as H0, y0, r0 of the state tau [s] before: d = d0 + u0 tau + a tau^2 / 2,
    u = u0 + a tau, with the slow error of a.

    (dx, dy, dz) [m], (ex, ey, ez) [m/s] NED: what position and velocity have gained beyond that; grown [m^2/s^2]: variance of the
    velocity on the way.
    """
    for i in range(H.shape[0]):
        row, out = H[i], H0[i]
        for j in range(H.shape[1]):
            out[j] = row[j]
        for j in range(3):
            at, by = row[B_D + j], row[B_U + j]
            out[B_U + j] += tau * at
            out[B_AB + j] += 0.5 * tau * tau * at + tau * by
        a, b, c = row[B_D], row[B_D + 1], row[B_D + 2]
        u, v, w = row[B_U], row[B_U + 1], row[B_U + 2]
        y0[i] = y[i] - ((a * dx + u * ex) + (b * dy + v * ey) + (c * dz + w * ez))
        r0[i] = r[i] + grown * ((a * a + b * b + c * c) * tau * tau / 3.0 + (u * u + v * v + w * w))


@jit
def sigmas(p: np.ndarray, place: np.ndarray, grown: float) -> tuple[float, float, float]:
    """1-sigma of place [3,n] times a state of covariance p [n,w], and of `grown` [m^2] beside it."""
    x, y, z = variances(p, place)
    return math.sqrt(x + grown), math.sqrt(y + grown), math.sqrt(z + grown)


@jit
def spread(
    X: np.ndarray, P: np.ndarray, place: np.ndarray, grown: float, z: np.ndarray, off: np.ndarray, sigma: np.ndarray
) -> None:
    """Of every filter of X [M,n], P [M,n,w]: off [M,3] <- |position less that of filter 0| [m], positions being place [3,n] times
    the state; z [M] <- the largest over its sigma, sqrt(P_m - P_0) (Blanch et al. 2012); sigma [M,3] <- 1-sigma of the position
    and of `grown` [m^2] beside it."""
    for m in range(X.shape[0]):
        z[m] = 0.0
        sigma[m, 0], sigma[m, 1], sigma[m, 2] = variances(P[m], place)
        for i in range(3):
            d = 0.0
            for j in range(X.shape[1]):
                d += place[i, j] * (X[m, j] - X[0, j])
            off[m, i] = abs(d)
            own, less = sigma[m, i], sigma[0, i]
            z[m] = max(z[m], off[m, i] / math.sqrt(max(own - less, 1e-4 * own)))
    for m in range(X.shape[0]):
        for i in range(3):
            sigma[m, i] = math.sqrt(sigma[m, i] + grown)


@jit
def surprise(
    X: np.ndarray, P: np.ndarray, H: np.ndarray, y: np.ndarray, r: np.ndarray, k: int, t_us: int, own_us: int,
    path: np.ndarray, steps: int, accel2: float,
    H0: np.ndarray, y0: np.ndarray, r0: np.ndarray, z: np.ndarray,
) -> float:  # fmt: skip
    """`innovations` z [>=k] against filter 0 of the k rows H [ROWS,n], y, r, which are of t_us; the largest magnitude.

    The filter is of own_us and carried on by the `steps` rows of path, known to accel2 [m^2/s^3]; H0, y0, r0 <- the rows of the
    filter's own time.
    """
    tau = max((t_us - own_us) * 1e-6, 0.0)
    ax, ay, az, bx, by, bz = at(path, steps, t_us)
    cx, cy, cz, ex, ey, ez = at(path, steps, own_us)
    dx, dy, dz = ax - cx - tau * ex, ay - cy - tau * ey, az - cz - tau * ez
    ahead(H, y, r, tau, dx, dy, dz, bx - ex, by - ey, bz - ez, accel2 * tau, H0, y0, r0)
    return innovations(X[0], P[0], H0, y0, r0, k, z)
