"""Kernels of the wind estimate: histories, prediction, the three readings of air data, and the size of gusts."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_quat
from flightsw.sixdof.windcal.layout import (
    ALPHA,
    ALPHA_GM,
    ATT,
    ATT_GM,
    BETA,
    BETA_GM,
    GUST_N,
    H_AIR,
    H_QUAT,
    H_VEL,
    OFFSET,
    OFFSET_GM,
    SCALE,
    SLOW_E,
    SLOW_N,
    VEL,
    WAKE,
    Z_ALPHA,
    Z_BETA,
    Z_V,
    T,
)


@jit
def push(ring: np.ndarray, row: np.ndarray) -> None:
    """Move the rows of ring [k,m] up by one, the oldest is lost; its last <- row [m]."""
    k, m = ring.shape
    for i in range(k - 1):
        for j in range(m):
            ring[i, j] = ring[i + 1, j]
    for j in range(m):
        ring[k - 1, j] = row[j]


@jit
def between(ring: np.ndarray, t: float, beyond: float, out: np.ndarray) -> bool:
    """out [m] <- row of ring [k,m] (column 0: time [s], rising; NaN: none yet) at time t [s], linear between two of them.

    False, out spoilt, outside what is held; up to `beyond` [s] after the newest the last two are continued.
    """
    k, m = ring.shape
    newest = ring[k - 1, T]
    if not t <= newest + beyond:
        return False
    i = k - 2
    while i > 0 and ring[i, T] > t:
        i -= 1
    t0, t1 = ring[i, T], ring[i + 1, T]
    if not (t0 <= t and t1 > t0):
        return False
    s = (t - t0) / (t1 - t0)
    for j in range(m):
        out[j] = ring[i, j] + s * (ring[i + 1, j] - ring[i, j])
    return True


@jit
def aligned(
    motion: np.ndarray, attitude: np.ndarray, readings: np.ndarray, fix: np.ndarray, t: float, vane_lag: float, row: np.ndarray,
    v: np.ndarray, R: np.ndarray, z: np.ndarray,
) -> bool:  # fmt: skip
    """Everything at time t [s]: v [3] velocity NED [m/s], R [9] NED to body, z [3] readings (V, beta, alpha).

    motion [k,4], attitude [k,5], readings [k,4]: histories (layout.py). fix [3]: dead-reckoned velocity less the satellite's.
    z[0] is given and stays; vanes are those of vane_lag [s] after t. row [5] workspace. False: not held that long.
    """
    if not between(readings, t + vane_lag, 0.0, row):
        return False
    z[Z_BETA], z[Z_ALPHA] = row[H_AIR + Z_BETA], row[H_AIR + Z_ALPHA]
    if not between(attitude, t, 0.05, row):
        return False
    s = 0.0
    for i in range(4):
        s += row[H_QUAT + i] * row[H_QUAT + i]
    s = math.sqrt(s)
    if not s > 0.5:  # opposite signs of one attitude, or none
        return False
    for i in range(4):
        row[H_QUAT + i] /= s
    dcm_from_quat(row[H_QUAT : H_QUAT + 4], R)
    if not between(motion, t, 0.0, row):
        return False
    for i in range(3):
        v[i] = row[H_VEL + i] - fix[i]
    return True


@jit
def raw_wind(z: np.ndarray, v: np.ndarray, R: np.ndarray, w: np.ndarray) -> None:
    """w [3] NED <- v [3] NED less the air velocity of the readings z [3] (V, beta, alpha) turned by R [9] [m/s]."""
    cb = math.cos(z[Z_BETA])
    a, b, c = z[Z_V] * math.cos(z[Z_ALPHA]) * cb, z[Z_V] * math.sin(z[Z_BETA]), z[Z_V] * math.sin(z[Z_ALPHA]) * cb
    for i in range(3):
        w[i] = v[i] - (R[i] * a + R[3 + i] * b + R[6 + i] * c)


@jit
def model(dt: float, tau: np.ndarray, sd: np.ndarray, slow_q: float, f: np.ndarray, q: np.ndarray) -> None:
    """f [n], q [n] <- factors and noise of a step of dt [s]: first order of time constants tau [n] [s] (infinite: constant) and
    stationary sigmas sd [n]; the slow wind's horizontal parts walk by slow_q [m/s] per sqrt(s)."""
    for i in range(tau.shape[0]):
        f[i] = math.exp(-dt / tau[i])
        q[i] = sd[i] * math.sqrt(-math.expm1(-2.0 * dt / tau[i]))
    q[SLOW_N] = q[SLOW_E] = slow_q * math.sqrt(dt)


@jit
def predict(x: np.ndarray, P: np.ndarray, f: np.ndarray, q: np.ndarray) -> None:
    """x [n], P [n,n] <- x', P' of x_i' = f_i x_i + q_i n_i, n white of unit variance (first order, every state its own)."""
    n = x.shape[0]
    for i in range(n):
        x[i] *= f[i]
        for j in range(i):
            s = P[i, j] * f[i] * f[j]
            P[i, j] = s
            P[j, i] = s
        P[i, i] = P[i, i] * f[i] * f[i] + q[i] * q[i]


@jit_own
def expected(x: np.ndarray, v: np.ndarray, R: np.ndarray, h: np.ndarray, H: np.ndarray) -> None:
    """h [3] <- what the probes are to read (V, beta, alpha) in state x [22 or 25], H [3,n] its derivative.

    v [3] satellite velocity NED [m/s]; R [9] NED to body as the attitude reference has it. With u the air velocity in body axes,
    a the reference's error, b that of the velocity, w the wind, m the wake's in body axes: u = (1 + [a]x) (R (v - b - w) - m),
    V_read = (1 + k) V + offsets, angle_read = angle + offsets. H is taken at the u of the slow wind alone: that of the gusty one
    would be correlated with what it multiplies.
    """
    n = x.shape[0]
    behind = n > WAKE
    air, slow = np.empty(3), np.empty(3)
    for i in range(3):
        s = v[i] - x[VEL + i] - x[SLOW_N + i]
        slow[i] = s
        air[i] = s - x[GUST_N + i]
    u, y = np.empty(3), np.empty(3)
    for pas in range(2):
        a = slow if pas == 0 else air
        for i in range(3):
            y[i] = R[3 * i] * a[0] + R[3 * i + 1] * a[1] + R[3 * i + 2] * a[2]
            if behind:
                y[i] -= x[WAKE + i]
        e0, e1, e2 = x[ATT] + x[ATT_GM], x[ATT + 1] + x[ATT_GM + 1], x[ATT + 2] + x[ATT_GM + 2]
        u[0] = y[0] + e1 * y[2] - e2 * y[1]
        u[1] = y[1] + e2 * y[0] - e0 * y[2]
        u[2] = y[2] + e0 * y[1] - e1 * y[0]
        if pas == 0:
            _derivative(u, y, x, R, behind, H)
    V = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    h[Z_V] = (1.0 + x[SCALE]) * V + x[OFFSET] + x[OFFSET_GM]
    h[Z_BETA] = math.asin(u[1] / V) + x[BETA] + x[BETA_GM]
    h[Z_ALPHA] = math.atan2(u[2], u[0]) + x[ALPHA] + x[ALPHA_GM]


@jit_own
def _derivative(u: np.ndarray, y: np.ndarray, x: np.ndarray, R: np.ndarray, behind: bool, H: np.ndarray) -> None:
    """H [3,n] <- derivative of `expected` at the air velocity u [3] = (1 + [a]x) y, y [3] as the attitude reference has it."""
    n = x.shape[0]
    V = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    flat = u[0] * u[0] + u[2] * u[2]
    D = np.empty((3, 3))  # of V, beta, alpha by u
    for j in range(3):
        D[Z_V, j] = u[j] / V
    s, c = u[1] / V, math.sqrt(flat) / V
    for j in range(3):
        D[Z_BETA, j] = -s * D[Z_V, j] / (V * c)
    D[Z_BETA, 1] += 1.0 / (V * c)
    D[Z_ALPHA, 0], D[Z_ALPHA, 1], D[Z_ALPHA, 2] = -u[2] / flat, 0.0, u[0] / flat
    e0, e1, e2 = x[ATT] + x[ATT_GM], x[ATT + 1] + x[ATT_GM + 1], x[ATT + 2] + x[ATT_GM + 2]
    for r in range(3):
        for i in range(n):
            H[r, i] = 0.0
        D0, D1, D2 = D[r, 0], D[r, 1], D[r, 2]
        # a x y = -[y]x a, and D (a x y) = (D x a) y
        H[r, ATT] = H[r, ATT_GM] = D2 * y[1] - D1 * y[2]
        H[r, ATT + 1] = H[r, ATT_GM + 1] = D0 * y[2] - D2 * y[0]
        H[r, ATT + 2] = H[r, ATT_GM + 2] = D1 * y[0] - D0 * y[1]
        D[r, 0], D[r, 1], D[r, 2] = D0 + D1 * e2 - D2 * e1, D1 + D2 * e0 - D0 * e2, D2 + D0 * e1 - D1 * e0
        for i in range(3):
            g = -(D[r, 0] * R[i] + D[r, 1] * R[3 + i] + D[r, 2] * R[6 + i])
            H[r, SLOW_N + i] = H[r, GUST_N + i] = H[r, VEL + i] = g
            if behind:
                H[r, WAKE + i] = -D[r, i]
    k = 1.0 + x[SCALE]
    for i in range(n):
        H[Z_V, i] *= k
    H[Z_V, SCALE] = V
    H[Z_V, OFFSET] = H[Z_V, OFFSET_GM] = 1.0
    H[Z_BETA, BETA] = H[Z_BETA, BETA_GM] = 1.0
    H[Z_ALPHA, ALPHA] = H[Z_ALPHA, ALPHA_GM] = 1.0


@jit_own
def correct(
    x: np.ndarray, P: np.ndarray, H: np.ndarray, nu: np.ndarray, r: np.ndarray, use: np.ndarray, gate: float, W: np.ndarray
) -> float:  # fmt: skip
    """x [n], P [n,n] <- corrected by the innovations nu [3] of variance r [3], H [3,n], one after the other; sum of nu^2/S.

    use [3] in: 1 for a reading to be judged; out: 2 where it was taken, 1 where it lies beyond `gate` sigmas. W [n] workspace.
    Kalman 1960, scalar form; P - P h h'P/S keeps its symmetry.
    """
    n = x.shape[0]
    nis = 0.0
    d = np.zeros(n)  # correction so far
    for k in range(3):
        if use[k] == 0:
            continue
        S = r[k]
        e = nu[k]
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += P[i, j] * H[k, j]
            W[i] = s
            e -= H[k, i] * d[i]
        for i in range(n):
            S += H[k, i] * W[i]
        ratio = e * e / S
        if not ratio <= gate * gate:
            use[k] = 1
            continue
        use[k] = 2
        nis += ratio
        for i in range(n):
            d[i] += W[i] * (e / S)
            for j in range(i + 1):
                s = P[i, j] - W[i] * W[j] / S
                P[i, j] = s
                P[j, i] = s
    for i in range(n):
        x[i] += d[i]
    return nis


@jit_own
def total(
    x: np.ndarray, P: np.ndarray, f: np.ndarray, q: np.ndarray, R: np.ndarray, w: np.ndarray, C: np.ndarray
) -> None:
    """w [3] <- wind NED [m/s] in all (slow, gust, wake) after a step of f [n], q [n] (see `predict`), C [3,3] its covariance.

    R [9] NED to body.
    """
    n = x.shape[0]
    behind = n > WAKE
    A = np.zeros((3, n))
    for i in range(3):
        A[i, SLOW_N + i] = f[SLOW_N + i]
        A[i, GUST_N + i] = f[GUST_N + i]
        if behind:
            for j in range(3):
                A[i, WAKE + j] = R[3 * j + i] * f[WAKE + j]
        w[i] = 0.0
        for j in range(n):
            w[i] += A[i, j] * x[j]
    for i in range(3):
        for j in range(i + 1):
            s = 0.0
            for k in range(n):
                if A[i, k] != 0.0:
                    for m in range(n):
                        if A[j, m] != 0.0:
                            s += A[i, k] * P[k, m] * A[j, m]
            if i == j:
                s += q[SLOW_N + i] * q[SLOW_N + i] + q[GUST_N + i] * q[GUST_N + i]
            if behind:
                for k in range(3):
                    s += R[3 * k + i] * R[3 * k + j] * q[WAKE + k] * q[WAKE + k]
            C[i, j] = s
            C[j, i] = s


@jit
def gust_size(trail: np.ndarray, L: float, V: float, decay: float, sums: np.ndarray) -> None:
    """sums [2] <- decayed sums whose quotient is the variance of a gust [m^2/s^2], from the raw wind of a time.

    trail [k,4] time [s] and raw wind NED [m/s], oldest first. The mean square of a difference over t of a first-order process is
    2 sigma^2 (1 - exp(-t V/L)) and twice the noise, which falls out between a long and the shortest difference.
    """
    k = trail.shape[0]
    long, short = trail[k - 1, T] - trail[0, T], trail[k - 1, T] - trail[k - 2, T]
    if not (0.0 < short < 0.2 and long < 3.0):  # a gap, or not filled yet
        return
    d = 0.0
    for i in range(1, 4):
        a, b = trail[k - 1, i] - trail[0, i], trail[k - 1, i] - trail[k - 2, i]
        d += a * a - b * b
    sums[0] = decay * sums[0] + d
    sums[1] = decay * sums[1] + 6.0 * (math.exp(-short * V / L) - math.exp(-long * V / L))
