"""Range-only rendezvous: the three-state extended Kalman filter, and the window of innovations every estimator feeds.

Rendezvous frame R: origin at the control point, +x towards the initial point the receiver comes from, +y 90 deg
counter-clockwise from +x seen from above; SI units. Source: Rivard (1982), equations 29 to 47 as corrected in
rivard.md section 5 (P23 unchanged by propagation, R a variance, cross term of the bias correction available).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.correction import scalar_update
from flightsw.kernels.jit import jit, jit_own

# parameter vector of the three-state filter
E3_U = 0  # nominal along-track ground velocity of the receiver [m/s], negative
E3_A0 = 1  # planned altitude separation [m]
E3_R = 2  # variance of a range [m^2]
E3_QX = 3  # noise of the along-track velocity [m^2/s^3]
E3_QY = 4  # noise of the cross-track position [m^2/s]
E3_VAR0 = 5  # variance of the first range [m^2]
E3_VARV = 6  # variance of the along-track velocity at the start [m^2/s^2]
E3_CROSS = 7  # 1: full second-order bias correction, 0: the source's, without the x-y term
E3_N = 8

# state x [3] and its covariance P [3,3]: y [m], deviation of the along-track velocity [m/s], x [m]. (In this order a scalar
# update multiplies the gain of x by the cross covariance of y, as in Rivard's equation 46, not the other way round.)
(S3_Y, S3_V, S3_X, S3_N) = range(4)
# innovation and its variance, of whatever was fused last
NU, NU_VAR = 0, 1


@jit
def ahead(d: float, y: float, a: float) -> float:
    """Along-track distance [m] of an aircraft at slant range d, lateral y, vertical a [m]; never below a tenth of d."""
    q = d * d - y * y - a * a
    low = 0.01 * d * d
    return math.sqrt(q if q > low else low)


@jit
def ekf3_start(
    x: np.ndarray, P: np.ndarray, d: float, x_t: float, y_t: float, y_hat: float, sigma_y: float, e: np.ndarray
) -> None:
    """x [3], P [3,3] <- estimate from the first slant range d [m] at own (x_t, y_t) [m] and the crew's y_hat +- sigma_y [m].

    X = sqrt(d^2 - Y^2 - a0^2), P11 = (d^2 var + Y^2 sy^2)/X^2, P13 = -(Y/X) sy^2 (Rivard 30 to 34).
    """
    Y = y_hat - y_t
    X = ahead(d, Y, e[E3_A0])
    x[S3_X], x[S3_V], x[S3_Y] = x_t + X, 0.0, y_hat
    v = sigma_y * sigma_y
    P[S3_X, S3_X] = (d * d * e[E3_VAR0] + Y * Y * v) / (X * X)
    P[S3_X, S3_V] = P[S3_V, S3_X] = 0.0
    P[S3_X, S3_Y] = P[S3_Y, S3_X] = -Y / X * v
    P[S3_V, S3_V] = e[E3_VARV]
    P[S3_V, S3_Y] = P[S3_Y, S3_V] = 0.0
    P[S3_Y, S3_Y] = v


@jit
def ekf3_predict(x: np.ndarray, P: np.ndarray, dt: float, e: np.ndarray) -> None:
    """Propagate x [3], P [3,3] by dt [s] (Rivard 36; the left side of 36e is P23, which does not change)."""
    q = e[E3_QX]
    x[S3_X] += (x[S3_V] + e[E3_U]) * dt
    P[S3_X, S3_X] += 2.0 * P[S3_X, S3_V] * dt + P[S3_V, S3_V] * dt * dt + q * dt * dt * dt / 3.0
    P[S3_X, S3_V] += P[S3_V, S3_V] * dt + 0.5 * q * dt * dt
    P[S3_V, S3_X] = P[S3_X, S3_V]
    P[S3_X, S3_Y] += P[S3_V, S3_Y] * dt
    P[S3_Y, S3_X] = P[S3_X, S3_Y]
    P[S3_V, S3_V] += q * dt
    P[S3_Y, S3_Y] += e[E3_QY] * dt


@jit_own
def ekf3_fuse(x: np.ndarray, P: np.ndarray, hx: float, hy: float, nu: float, R: float, out: np.ndarray) -> None:
    """Fuse one innovation nu of variance R whose row has slopes hx, hy in x and y; out [2] <- nu and its variance."""
    k = np.empty(S3_N)
    k[S3_X] = P[S3_X, S3_X] * hx + P[S3_X, S3_Y] * hy
    k[S3_V] = P[S3_V, S3_X] * hx + P[S3_V, S3_Y] * hy
    k[S3_Y] = P[S3_Y, S3_X] * hx + P[S3_Y, S3_Y] * hy
    out[NU], out[NU_VAR] = nu, k[S3_X] * hx + k[S3_Y] * hy + R
    scalar_update(x, P, k, nu, out[NU_VAR])


@jit
def ekf3_range(
    x: np.ndarray, P: np.ndarray, z: float, x_t: float, y_t: float, gate: float, e: np.ndarray, out: np.ndarray
) -> bool:
    """Fuse the slant range z [m] taken at own position (x_t, y_t) [m]; False when its NIS exceeds gate (> 0).

    zhat = d + b_c, b_c = 0.5[(1/d - X^2/d^3) P11 + (1/d - Y^2/d^3) P33 - 2 X Y P13/d^3] (Rivard 39, with its missing term
    when E3_CROSS is 1). out [2] <- innovation [m] and its variance [m^2].
    """
    X, Y = x[S3_X] - x_t, x[S3_Y] - y_t
    d2 = X * X + Y * Y + e[E3_A0] * e[E3_A0]
    d = math.sqrt(d2)
    d3 = d * d2
    xx, xy, yy = P[S3_X, S3_X], P[S3_X, S3_Y], P[S3_Y, S3_Y]
    b = 0.5 * ((1.0 / d - X * X / d3) * xx + (1.0 / d - Y * Y / d3) * yy)
    b -= e[E3_CROSS] * X * Y * xy / d3
    hx, hy = X / d, Y / d
    nu = z - d - b
    S = hx * hx * xx + 2.0 * hx * hy * xy + hy * hy * yy + e[E3_R]
    if gate > 0.0 and nu * nu > gate * S:
        out[NU], out[NU_VAR] = nu, S
        return False
    ekf3_fuse(x, P, hx, hy, nu, e[E3_R], out)
    return True


@jit
def wrap(a: float) -> float:
    """Angle [rad] in (-pi, pi]."""
    return a - 2.0 * math.pi * math.ceil((a - math.pi) / (2.0 * math.pi))


@jit
def ekf3_bearing(
    x: np.ndarray, P: np.ndarray, z: float, x_t: float, y_t: float, R: float, out: np.ndarray
) -> None:  # fmt: skip
    """Fuse the line-of-sight angle z [rad] from own position, counter-clockwise from +x, variance R [rad^2]."""
    X, Y = x[S3_X] - x_t, x[S3_Y] - y_t
    d2 = X * X + Y * Y
    ekf3_fuse(x, P, -Y / d2, X / d2, wrap(z - math.atan2(Y, X)), R, out)


@jit
def ekf3_position(x: np.ndarray, P: np.ndarray, x_r: float, y_r: float, R: float, out: np.ndarray) -> None:
    """Fuse the receiver's own position (x_r, y_r) [m] from the data link, variance R [m^2] per axis."""
    ekf3_fuse(x, P, 1.0, 0.0, x_r - x[S3_X], R, out)
    ekf3_fuse(x, P, 0.0, 1.0, y_r - x[S3_Y], R, out)


# window of normalised innovations: [next slot, count, square limit, drift limit, mean square, drift, alarm, e_0 ... e_(n-1)]
W_NEXT, W_COUNT, W_LIMIT, W_DRIFT_LIMIT, W_SQUARE, W_DRIFT, W_ALARM, W_HEAD = 0, 1, 2, 3, 4, 5, 6, 7


@jit
def window_push(w: np.ndarray, e: float) -> None:
    """Enter the normalised innovation e = nu/sqrt(S) [-] into the window w [7+n] and judge it once the window is full.

    Two statistics of the last n: mean of e^2 (chi-square with n degrees of freedom over n) finds an innovation larger than
    its covariance allows; (sum e)^2/n (chi-square with 1) finds one that leans to a side. W_ALARM is 1 while either exceeds
    its limit.
    """
    n = w.shape[0] - W_HEAD
    i = int(w[W_NEXT])
    w[W_HEAD + i] = e
    w[W_NEXT] = (i + 1) % n
    if w[W_COUNT] < n:
        w[W_COUNT] += 1.0
    k = int(w[W_COUNT])
    q, t = 0.0, 0.0
    for j in range(k):
        q += w[W_HEAD + j] * w[W_HEAD + j]
        t += w[W_HEAD + j]
    w[W_SQUARE] = q / k
    w[W_DRIFT] = t * t / k
    over = w[W_SQUARE] > w[W_LIMIT] or w[W_DRIFT] > w[W_DRIFT_LIMIT]
    w[W_ALARM] = 1.0 if k == n and over else 0.0
