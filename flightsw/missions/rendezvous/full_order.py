"""One Gaussian component of the full-order rendezvous estimator: propagation, range by EKF or Gauss-Hermite, other sensors.

State m [8]: x [m], constant and fluctuating along-track velocity deviation [m/s], y [m], cross-track drift [m/s], altitude
error [m], constant and correlated range error [m]; the receiver's truth model of Rivard (1982), section III. The seven-state
filter is the same with the last state's sigma zero and its variance in R. Behind them may stand the errors of a bearing and
of a data link (aid_errors.py): whatever goes over all states goes over those too. Frame R (see range_filter.py), SI units.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.correction import scalar_update
from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.range_filter import ahead, wrap

(X, VC, VF, Y, VY, AE, B, N, N8) = range(9)
# discretisation D [8]: x per v_xf [s], decay of v_xf and of n [-]; noise xx [m^2], xf [m^2/s], ff [m^2/s^2], yy, nn [m^2]
(D_XF, D_F, D_N, D_QXX, D_QXF, D_QFF, D_QYY, D_QNN, D_SIZE) = range(9)
# row h [8] of a measurement: slopes in x, y, altitude error and both range errors, predicted value, variance that no straight
# line explains, innovation variance (units of the measurement, per m where a slope)
(H_X, H_Y, H_A, H_B, H_N, H_MEAN, H_REST, H_VAR, H_SIZE) = range(9)

# parameter vector
E8_U = 0  # nominal along-track ground velocity of the receiver [m/s], negative
E8_A0 = 1  # planned altitude separation [m]
E8_RE = 2  # earth radius [m]
E8_R = 3  # white variance of a range [m^2]
E8_TF, E8_SF = 4, 5  # correlation time [s], sigma [m/s] of the fluctuating velocity
E8_TN, E8_SN = 6, 7  # of the correlated range error [s], [m]
E8_QY = 8  # random walk of y [m^2/s]
# sigma at the start: constant velocity, drift [m/s], altitude, range error [m]
E8_SC, E8_SY, E8_SA, E8_SB = 9, 10, 11, 12
# errors of a bearing [rad] and of the position a data link sends [m]: constant, correlated, correlation time [s]
E8_BC, E8_BS, E8_BT, E8_LC, E8_LS, E8_LT = 13, 14, 15, 16, 17, 18
E8_N = 19

_SMALL = 0.02  # step over correlation time below which the series is the more exact form

# nodes and weights of the five-point Gauss-Hermite rule for a unit normal: x^2 = 0, 5 -+ sqrt(10)
_N1, _N2 = math.sqrt(5.0 - math.sqrt(10.0)), math.sqrt(5.0 + math.sqrt(10.0))
_W0, _W1, _W2 = 8.0 / 15.0, (7.0 + 2.0 * math.sqrt(10.0)) / 60.0, (7.0 - 2.0 * math.sqrt(10.0)) / 60.0
GH_NODE = (0.0, _N1, -_N1, _N2, -_N2)
GH_WEIGHT = (_W0, _W1, _W1, _W2, _W2)


@jit
def discretise(dt: float, e: np.ndarray, D: np.ndarray) -> None:
    """D [8] <- exact discretisation over dt [s]: x per v_xf, decay of v_xf and of n, noise xx, xf, ff, yy, nn.

    With r = dt/T_f, a = e^-r, q_f = 2 sigma^2/T_f: xx = q_f T_f^3 (r - 2(1-a) + (1-a^2)/2), xf = q_f T_f^2 (1-a)^2/2,
    ff = q_f T_f (1-a^2)/2. A step of any length; the series of xx in r where the closed form cancels.
    """
    T, s = e[E8_TF], e[E8_SF]
    r = dt / T
    one_a = -math.expm1(-r)
    if r < _SMALL:
        f = 1.0 / 3.0 + r * (-0.25 + r * (7.0 / 60.0 + r * (-1.0 / 24.0 + r * (31.0 / 2520.0 - r / 320.0))))
        f *= r * r * r
    else:
        f = r - 2.0 * one_a - 0.5 * math.expm1(-2.0 * r)
    D[D_XF] = T * one_a
    D[D_F] = math.exp(-r)
    D[D_N] = math.exp(-dt / e[E8_TN])
    D[D_QXX] = 2.0 * s * s * T * T * f
    D[D_QXF] = s * s * T * one_a * one_a
    D[D_QFF] = -s * s * math.expm1(-2.0 * r)
    D[D_QYY] = e[E8_QY] * dt
    D[D_QNN] = -e[E8_SN] * e[E8_SN] * math.expm1(-2.0 * dt / e[E8_TN])


@jit
def eight_mean(m: np.ndarray, dt: float, u: float, D: np.ndarray) -> None:
    """Propagate the mean m [8] by dt [s] with discretisation D [8]; u [m/s] the nominal along-track velocity."""
    m[X] += (u + m[VC]) * dt + D[D_XF] * m[VF]
    m[VF] *= D[D_F]
    m[Y] += m[VY] * dt
    m[N] *= D[D_N]


@jit
def eight_predict(m: np.ndarray, P: np.ndarray, dt: float, u: float, D: np.ndarray) -> None:
    """Propagate mean m [8+], covariance P [8+,8+] by dt [s], discretisation D [8]; u nominal along-track velocity [m/s]."""
    eight_mean(m, dt, u, D)
    n = m.shape[0]
    for j in range(n):
        P[X, j] += dt * P[VC, j] + D[D_XF] * P[VF, j]
        P[VF, j] *= D[D_F]
        P[Y, j] += dt * P[VY, j]
        P[N, j] *= D[D_N]
    for i in range(n):
        P[i, X] += dt * P[i, VC] + D[D_XF] * P[i, VF]
        P[i, VF] *= D[D_F]
        P[i, Y] += dt * P[i, VY]
        P[i, N] *= D[D_N]
    P[X, X] += D[D_QXX]
    P[X, VF] += D[D_QXF]
    P[VF, X] += D[D_QXF]
    P[VF, VF] += D[D_QFF]
    P[Y, Y] += D[D_QYY]
    P[N, N] += D[D_QNN]


@jit
def eight_start(
    m: np.ndarray, P: np.ndarray, d: float, x_t: float, y_t: float, y: float, sigma_y: float, shift: float,
    e: np.ndarray,
) -> None:  # fmt: skip
    """m [8+], P [8+,8+] <- estimate from the first slant range d [m] at own position, lateral position y +- sigma_y [m].

    x follows from d with its correlation to y, altitude error and both range errors; shift = 1 adds the second-order mean
    -sigma_y^2 (1/X + Y^2/X^3)/2, 0 leaves it out.
    """
    Yr = y - y_t
    a = e[E8_A0] + d * d / (2.0 * e[E8_RE])
    Xr = ahead(d, Yr, a)
    for i in range(m.shape[0]):
        m[i] = 0.0
        for j in range(m.shape[0]):
            P[i, j] = 0.0
    v = sigma_y * sigma_y
    m[X] = x_t + Xr - shift * 0.5 * v * (1.0 / Xr + Yr * Yr / (Xr * Xr * Xr))
    m[Y] = y
    P[VC, VC] = e[E8_SC] * e[E8_SC]
    P[VF, VF] = e[E8_SF] * e[E8_SF]
    P[Y, Y] = v
    P[VY, VY] = e[E8_SY] * e[E8_SY]
    P[AE, AE] = e[E8_SA] * e[E8_SA]
    P[B, B] = e[E8_SB] * e[E8_SB]
    P[N, N] = e[E8_SN] * e[E8_SN]
    ry, ra, rb = -Yr / Xr, -a / Xr, -d / Xr
    P[X, X] = ry * ry * P[Y, Y] + ra * ra * P[AE, AE] + rb * rb * (P[B, B] + P[N, N] + e[E8_R])
    P[X, Y] = P[Y, X] = ry * P[Y, Y]
    P[X, AE] = P[AE, X] = ra * P[AE, AE]
    P[X, B] = P[B, X] = rb * P[B, B]
    P[X, N] = P[N, X] = rb * P[N, N]


@jit
def slant(dx: float, dy: float, a: float, r_e: float) -> float:
    """Slant range [m] for horizontal separation (dx, dy) and altitude separation a [m], earth curvature to second order."""
    h2 = dx * dx + dy * dy
    v = a + h2 / (2.0 * r_e)
    return math.sqrt(h2 + v * v)


@jit
def range_ekf(m: np.ndarray, P: np.ndarray, x_t: float, y_t: float, e: np.ndarray, h: np.ndarray) -> None:
    """h [8] <- (h_x, h_y, h_a, h_b, h_n, predicted range [m], extra variance 0) linearised at the mean, second-order mean."""
    dx, dy = m[X] - x_t, m[Y] - y_t
    a = e[E8_A0] + m[AE] + (dx * dx + dy * dy) / (2.0 * e[E8_RE])
    d = math.sqrt(dx * dx + dy * dy + a * a)
    h[H_X], h[H_Y], h[H_A], h[H_B], h[H_N] = dx / d, dy / d, a / d, 1.0, 1.0
    b = (1.0 - h[H_X] * h[H_X]) * P[X, X] + (1.0 - h[H_Y] * h[H_Y]) * P[Y, Y] - 2.0 * h[H_X] * h[H_Y] * P[X, Y]
    h[H_MEAN] = d + m[B] + m[N] + 0.5 * b / d
    h[H_REST] = 0.0


@jit
def quadrature(
    m: np.ndarray, P: np.ndarray, x_t: float, y_t: float, angle: bool, a: float, r_e: float, h: np.ndarray
) -> None:
    """Statistical linearisation of range or line-of-sight angle over the (x, y) marginal by the 5 x 5 Gauss-Hermite rule.

    h [8]: slopes in x and y, mean, variance that no straight line explains. a altitude separation [m].
    """
    dx, dy = m[X] - x_t, m[Y] - y_t
    l11 = math.sqrt(P[X, X])
    l21 = P[X, Y] / l11
    q = P[Y, Y] - l21 * l21
    l22 = math.sqrt(q) if q > 0.0 else 0.0
    f0 = math.atan2(dy, dx) if angle else slant(dx, dy, a, r_e)
    s0, s1, s2, ss = 0.0, 0.0, 0.0, 0.0
    for i in range(5):
        u = GH_NODE[i]
        for j in range(5):
            w = GH_NODE[j]
            px, py = dx + l11 * u, dy + l21 * u + l22 * w
            f = wrap(math.atan2(py, px) - f0) if angle else slant(px, py, a, r_e) - f0
            g = GH_WEIGHT[i] * GH_WEIGHT[j]
            s0 += g * f
            s1 += g * f * u
            s2 += g * f * w
            ss += g * f * f
    rest = ss - s0 * s0 - s1 * s1 - s2 * s2
    # slopes per metre: solve L^T h = (s1, s2)
    h[H_Y] = s2 / l22 if l22 > 0.0 else 0.0
    h[H_X] = (s1 - l21 * h[H_Y]) / l11
    h[H_A] = h[H_B] = h[H_N] = 0.0
    h[H_MEAN] = f0 + s0
    h[H_REST] = rest if rest > 0.0 else 0.0


@jit
def range_quadrature(m: np.ndarray, P: np.ndarray, x_t: float, y_t: float, e: np.ndarray, h: np.ndarray) -> None:
    """h [8] <- (h_x, h_y, h_a, h_b, h_n, predicted range [m], residual variance [m^2]) by Gauss-Hermite over (x, y)."""
    a = e[E8_A0] + m[AE]
    quadrature(m, P, x_t, y_t, False, a, e[E8_RE], h)
    h[H_A] = (a + h[H_MEAN] * h[H_MEAN] / (2.0 * e[E8_RE])) / h[H_MEAN]
    h[H_B] = h[H_N] = 1.0
    h[H_MEAN] += m[B] + m[N]


@jit
def innovation_variance(P: np.ndarray, h: np.ndarray, R: float) -> float:
    """H P H^T + R + residual for the row H with entries at x, y, altitude error and the two range errors."""
    hx, hy, ha, hb, hn = h[H_X], h[H_Y], h[H_A], h[H_B], h[H_N]
    return (
        hx * (hx * P[X, X] + 2.0 * (hy * P[X, Y] + ha * P[X, AE] + hb * P[X, B] + hn * P[X, N]))
        + hy * (hy * P[Y, Y] + 2.0 * (ha * P[Y, AE] + hb * P[Y, B] + hn * P[Y, N]))
        + ha * (ha * P[AE, AE] + 2.0 * (hb * P[AE, B] + hn * P[AE, N]))
        + hb * (hb * P[B, B] + 2.0 * hn * P[B, N])
        + hn * hn * P[N, N]
        + R
        + h[H_REST]
    )


@jit
def eight_fuse(m: np.ndarray, P: np.ndarray, h: np.ndarray, nu: float, S: float, k: np.ndarray) -> None:
    """Correct m [8+], P [8+,8+] with innovation nu of variance S and the row h [8]; k [8+] scratch. P stays symmetric."""
    hx, hy, ha, hb, hn = h[H_X], h[H_Y], h[H_A], h[H_B], h[H_N]
    for i in range(m.shape[0]):
        k[i] = hx * P[i, X] + hy * P[i, Y] + ha * P[i, AE] + hb * P[i, B] + hn * P[i, N]
    scalar_update(m, P, k, nu, S)
