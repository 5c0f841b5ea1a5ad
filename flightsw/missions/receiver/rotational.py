"""What a receiver's variants measure beyond models.measure: single probes in a wind that varies over the airframe, the wind
itself, and the rates of change that differencing of coloured measurements asks for.

Measurement codes continue those of the relative estimator: 18..20 wind NED (calculated), 21 + 3 i + (0, 1, 2) airspeed,
sideslip and incidence at probe i.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.motion import air_velocity, relative_rates

WIND_CODE = 18
PROBE_CODE = 21


@jit
def probe_flow(x: np.ndarray, rot: bool, R: np.ndarray, tk: np.ndarray, pos: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- airspeed [m/s], sideslip, incidence [rad] at `pos` [3] (body axes) of the relative state x.

    Flow = u_a + w x r - dW, w the inertial rates. dW, the wind there less the effective wind, is what the one gradient per
    lifting surface says (lee.md 3.5): dWy = r_eff x, dWz = p_eff y - q_eff x. rot: x[15:18] holds p, q, r_eff; else zero.
    """
    p = x[3] + R[0] * tk[9] + R[1] * tk[10] + R[2] * tk[11]
    q = x[4] + R[3] * tk[9] + R[4] * tk[10] + R[5] * tk[11]
    r = x[5] + R[6] * tk[9] + R[7] * tk[10] + R[8] * tk[11]
    a, b, c = air_velocity(x[0], x[1], x[2])
    a += q * pos[2] - r * pos[1]
    b += r * pos[0] - p * pos[2]
    c += p * pos[1] - q * pos[0]
    if rot:
        b -= x[17] * pos[0]
        c -= x[15] * pos[1] - x[16] * pos[0]
    s = math.sqrt(a * a + b * b + c * c)
    out[0] = s
    out[1] = math.asin(b / s)
    out[2] = math.atan2(c, a)


@jit
def measure_local(
    X: np.ndarray, rot: bool, codes: np.ndarray, first: int, m: int, tk: np.ndarray, pos: np.ndarray, Y: np.ndarray
) -> None:
    """Columns first..m-1 of Y [k,>=m] <- expected measurements of the relative points X [k,>=15] for codes 18 and up.

    rot: X[:, 15:18] is the rotational wind; tk [18] tanker now; pos [N,3] probe positions, body axes [m].
    """
    R = np.empty(9)
    v = np.empty(3)
    for s in range(X.shape[0]):
        x = X[s]
        dcm_from_euler(x[6], x[7], x[8], R)
        last = -1
        for j in range(first, m):
            k = codes[j]
            if k < 21:
                Y[s, j] = x[k - 6]
            else:
                i = (k - 21) // 3
                if i != last:
                    probe_flow(x, rot, R, tk, pos[i], v)
                    last = i
                Y[s, j] = v[k - 21 - 3 * i]


@jit
def differenced_relative(
    X: np.ndarray, nx: int, codes: np.ndarray, m: int, u: np.ndarray, rho: float, P: np.ndarray, tk: np.ndarray,
    a_t: np.ndarray, cf: float, cx: float, Y: np.ndarray,
) -> None:  # fmt: skip
    """Y [k,>=m] <- cf dh/dt + cx h of the relative points X [k,>=nx] for codes 0..17 of models.measure.

    nx: 15, or 18 with rotational wind. a_t [3]: tanker's inertial acceleration NED [m/s^2]. Rates of the state through
    relative_rates; body rates: inertial angular acceleration; d2(xi)/dt2 = R_BTI (a_R - a_T) - 2 w_T x xi' - w_T x (w_T x xi) -
    w_T' x xi; own velocity: inertial acceleration (specific force plus gravity).
    """
    R = np.empty(9)
    fm = np.empty(9)
    d = np.empty(15)
    f_t = np.empty(3)
    a_r = np.empty(3)
    h = np.empty(18)
    dh = np.empty(18)
    w0, w1, w2 = tk[9], tk[10], tk[11]
    e0, e1, e2 = tk[12], tk[13], tk[14]
    for s in range(X.shape[0]):
        x = X[s, :nx]
        relative_rates(x, u, rho, P, tk, R, fm, d)
        t0 = R[0] * w0 + R[1] * w1 + R[2] * w2
        t1 = R[3] * w0 + R[4] * w1 + R[5] * w2
        t2 = R[6] * w0 + R[7] * w1 + R[8] * w2
        for i in range(12):
            h[i] = x[i]
            dh[i] = d[i]
        h[3] += t0
        h[4] += t1
        h[5] += t2
        # relative_rates took d(R w_T)/dt off the inertial angular acceleration: put it back
        dh[3] += -(x[4] * t2 - x[5] * t1) + R[0] * e0 + R[1] * e1 + R[2] * e2
        dh[4] += -(x[5] * t0 - x[3] * t2) + R[3] * e0 + R[4] * e1 + R[5] * e2
        dh[5] += -(x[3] * t1 - x[4] * t0) + R[6] * e0 + R[7] * e1 + R[8] * e2
        for i in range(3):
            f_t[i] = R[i] * fm[0] + R[3 + i] * fm[1] + R[6 + i] * fm[2]
        for i in range(3):
            a_r[i] = tk[i] * f_t[0] + tk[3 + i] * f_t[1] + tk[6 + i] * f_t[2]
        a_r[2] += G0
        # w_T x xi, and inertial velocity from it
        c0 = w1 * x[11] - w2 * x[10]
        c1 = w2 * x[9] - w0 * x[11]
        c2 = w0 * x[10] - w1 * x[9]
        g0, g1, g2 = d[9] + c0, d[10] + c1, d[11] + c2
        b0, b1, b2 = 2.0 * d[9] + c0, 2.0 * d[10] + c1, 2.0 * d[11] + c2
        k0 = w1 * b2 - w2 * b1 + e1 * x[11] - e2 * x[10]
        k1 = w2 * b0 - w0 * b2 + e2 * x[9] - e0 * x[11]
        k2 = w0 * b1 - w1 * b0 + e0 * x[10] - e1 * x[9]
        for i in range(3):
            h[12 + i] = d[9 + i]
            acc = 0.0
            for j in range(3):
                acc += tk[3 * i + j] * (a_r[j] - a_t[j])
            dh[12 + i] = acc - (k0 if i == 0 else (k1 if i == 1 else k2))
            h[15 + i] = tk[i] * g0 + tk[3 + i] * g1 + tk[6 + i] * g2 + tk[15 + i]
            dh[15 + i] = a_r[i]
        for j in range(m):
            q = codes[j]
            Y[s, j] = cf * dh[q] + cx * h[q]
