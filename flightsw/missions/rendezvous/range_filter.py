"""Range-only rendezvous: the three-state extended Kalman filter, and the window of innovations every estimator feeds.

Rendezvous frame R: origin at the control point, +x towards the initial point the receiver comes from, +y 90 deg
counter-clockwise from +x seen from above; SI units. Source: Rivard (1982), equations 29 to 47 as corrected in
rivard.md section 5 (P23 unchanged by propagation, R a variance, cross term of the bias correction available).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit

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

# state: x [m], deviation of the along-track velocity [m/s], y [m], then P11 P12 P13 P22 P23 P33, innovation, its variance
S3_N = 11


@jit
def ahead(d: float, y: float, a: float) -> float:
    """Along-track distance [m] of an aircraft at slant range d, lateral y, vertical a [m]; never below a tenth of d."""
    q = d * d - y * y - a * a
    low = 0.01 * d * d
    return math.sqrt(q if q > low else low)


@jit
def ekf3_start(s: np.ndarray, d: float, x_t: float, y_t: float, y_hat: float, sigma_y: float, e: np.ndarray) -> None:
    """s [11] <- estimate from the first slant range d [m] at own position (x_t, y_t) [m] and the crew's y_hat +- sigma_y [m].

    X = sqrt(d^2 - Y^2 - a0^2), P11 = (d^2 var + Y^2 sy^2)/X^2, P13 = -(Y/X) sy^2 (Rivard 30 to 34).
    """
    Y = y_hat - y_t
    X = ahead(d, Y, e[E3_A0])
    s[0], s[1], s[2] = x_t + X, 0.0, y_hat
    v = sigma_y * sigma_y
    s[3] = (d * d * e[E3_VAR0] + Y * Y * v) / (X * X)
    s[4] = 0.0
    s[5] = -Y / X * v
    s[6] = e[E3_VARV]
    s[7] = 0.0
    s[8] = v
    s[9] = 0.0
    s[10] = 1.0


@jit
def ekf3_predict(s: np.ndarray, dt: float, e: np.ndarray) -> None:
    """Propagate s [11] by dt [s] (Rivard 36; the left side of 36e is P23, which does not change)."""
    q = e[E3_QX]
    s[0] += (s[1] + e[E3_U]) * dt
    s[3] += 2.0 * s[4] * dt + s[6] * dt * dt + q * dt * dt * dt / 3.0
    s[4] += s[6] * dt + 0.5 * q * dt * dt
    s[5] += s[7] * dt
    s[6] += q * dt
    s[8] += e[E3_QY] * dt


@jit
def ekf3_scalar(s: np.ndarray, h1: float, h3: float, nu: float, R: float) -> None:
    """Fuse one innovation nu with row H = [h1, 0, h3] and variance R into s [11]."""
    a = s[3] * h1 + s[5] * h3
    b = s[4] * h1 + s[7] * h3
    c = s[5] * h1 + s[8] * h3
    S = a * h1 + c * h3 + R
    s[9], s[10] = nu, S
    ka, kb, kc = a / S, b / S, c / S
    s[0] += ka * nu
    s[1] += kb * nu
    s[2] += kc * nu
    s[3] -= ka * a
    s[4] -= ka * b
    s[5] -= ka * c
    s[6] -= kb * b
    s[7] -= kb * c
    s[8] -= kc * c


@jit
def ekf3_range(s: np.ndarray, z: float, x_t: float, y_t: float, gate: float, e: np.ndarray) -> bool:
    """Fuse the slant range z [m] taken at own position (x_t, y_t) [m]; False when its NIS exceeds gate (> 0).

    zhat = d + b_c, b_c = 0.5[(1/d - X^2/d^3) P11 + (1/d - Y^2/d^3) P33 - 2 X Y P13/d^3] (Rivard 39, with its missing term
    when E3_CROSS is 1).
    """
    X, Y = s[0] - x_t, s[2] - y_t
    d2 = X * X + Y * Y + e[E3_A0] * e[E3_A0]
    d = math.sqrt(d2)
    d3 = d * d2
    b = 0.5 * ((1.0 / d - X * X / d3) * s[3] + (1.0 / d - Y * Y / d3) * s[8])
    b -= e[E3_CROSS] * X * Y * s[5] / d3
    h1, h3 = X / d, Y / d
    nu = z - d - b
    S = h1 * h1 * s[3] + 2.0 * h1 * h3 * s[5] + h3 * h3 * s[8] + e[E3_R]
    if gate > 0.0 and nu * nu > gate * S:
        s[9], s[10] = nu, S
        return False
    ekf3_scalar(s, h1, h3, nu, e[E3_R])
    return True


@jit
def wrap(a: float) -> float:
    """Angle [rad] in (-pi, pi]."""
    return a - 2.0 * math.pi * math.ceil((a - math.pi) / (2.0 * math.pi))


@jit
def ekf3_bearing(s: np.ndarray, z: float, x_t: float, y_t: float, R: float) -> None:
    """Fuse the line-of-sight angle z [rad] from own position, counter-clockwise from +x, variance R [rad^2]."""
    X, Y = s[0] - x_t, s[2] - y_t
    d2 = X * X + Y * Y
    ekf3_scalar(s, -Y / d2, X / d2, wrap(z - math.atan2(Y, X)), R)


@jit
def ekf3_position(s: np.ndarray, x: float, y: float, R: float) -> None:
    """Fuse the receiver's own position (x, y) [m] from the data link, variance R [m^2] per axis."""
    ekf3_scalar(s, 1.0, 0.0, x - s[0], R)
    ekf3_scalar(s, 0.0, 1.0, y - s[2], R)


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
