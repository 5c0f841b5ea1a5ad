"""What a receiver may measure beyond sixdof/measure.py: single probes in a wind that varies over the airframe, the wind
itself, and the rates of change that differencing of coloured measurements asks for.

Measurement codes continue those of the relative estimator: 18..20 wind NED (calculated), 21 + 3 i + (0, 1, 2) airspeed,
sideslip and incidence at probe i.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.layout import (
    M_OWN_VEL,
    M_RATE,
    M_VEL,
    NX,
    RELATIVE_CHANNELS,
    TK_P,
    TK_PD,
    TK_Q,
    TK_QD,
    TK_R,
    TK_RD,
    TK_VN,
    X_ALPHA,
    X_BETA,
    X_P,
    X_PE,
    X_PHI,
    X_PSI,
    X_Q,
    X_QE,
    X_R,
    X_RE,
    X_THETA,
    X_V,
    X_WN,
    X_X,
    X_Y,
    X_Z,
)
from flightsw.sixdof.motion import air_velocity, relative_rates

WIND_CODE = RELATIVE_CHANNELS
PROBE_CODE = WIND_CODE + 3


@jit
def probe_flow(x: np.ndarray, rot: bool, R: np.ndarray, tk: np.ndarray, pos: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- airspeed [m/s], sideslip, incidence [rad] at `pos` [3] (body axes) of the relative state x.

    Flow = u_a + w x r - dW, w the inertial rates. dW, the wind there less the effective wind, is what the one gradient per
    lifting surface says (lee.md 3.5): dWy = r_eff x, dWz = p_eff y - q_eff x. rot: x[15:18] holds p, q, r_eff; else zero.
    """
    p = x[X_P] + R[0] * tk[TK_P] + R[1] * tk[TK_Q] + R[2] * tk[TK_R]
    q = x[X_Q] + R[3] * tk[TK_P] + R[4] * tk[TK_Q] + R[5] * tk[TK_R]
    r = x[X_R] + R[6] * tk[TK_P] + R[7] * tk[TK_Q] + R[8] * tk[TK_R]
    a, b, c = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
    a += q * pos[2] - r * pos[1]
    b += r * pos[0] - p * pos[2]
    c += p * pos[1] - q * pos[0]
    if rot:
        b -= x[X_RE] * pos[0]
        c -= x[X_PE] * pos[1] - x[X_QE] * pos[0]
    s = math.sqrt(a * a + b * b + c * c)
    out[0] = s
    out[1] = math.asin(b / s)
    out[2] = math.atan2(c, a)


@jit_own
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
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        last = -1
        for j in range(first, m):
            k = codes[j]
            if k < PROBE_CODE:
                Y[s, j] = x[X_WN + k - WIND_CODE]
            else:
                i = (k - PROBE_CODE) // 3
                if i != last:
                    probe_flow(x, rot, R, tk, pos[i], v)
                    last = i
                Y[s, j] = v[k - PROBE_CODE - 3 * i]


@jit_own
def differenced_relative(
    X: np.ndarray, nx: int, codes: np.ndarray, m: int, u: np.ndarray, rho: float, P: np.ndarray, tk: np.ndarray,
    a_t: np.ndarray, cf: float, cx: float, Y: np.ndarray,
) -> None:  # fmt: skip
    """Y [k,>=m] <- cf dh/dt + cx h of the relative points X [k,>=nx] for codes 0..17 of sixdof/measure.py.

    nx: 15, or 18 with rotational wind. a_t [3]: tanker's inertial acceleration NED [m/s^2]. Rates of the state through
    relative_rates; body rates: inertial angular acceleration; d2(xi)/dt2 = R_BTI (a_R - a_T) - 2 w_T x xi' - w_T x (w_T x xi) -
    w_T' x xi; own velocity: inertial acceleration (specific force plus gravity).
    """
    R = np.empty(9)
    fm = np.empty(9)
    d = np.empty(NX)
    f_t = np.empty(3)
    a_r = np.empty(3)
    h = np.empty(RELATIVE_CHANNELS)
    dh = np.empty(RELATIVE_CHANNELS)
    w0, w1, w2 = tk[TK_P], tk[TK_Q], tk[TK_R]
    e0, e1, e2 = tk[TK_PD], tk[TK_QD], tk[TK_RD]
    for s in range(X.shape[0]):
        x = X[s, :nx]
        relative_rates(x, u, rho, P, tk, R, fm, d)
        t0 = R[0] * w0 + R[1] * w1 + R[2] * w2
        t1 = R[3] * w0 + R[4] * w1 + R[5] * w2
        t2 = R[6] * w0 + R[7] * w1 + R[8] * w2
        for i in range(M_VEL):
            h[i] = x[i]
            dh[i] = d[i]
        h[M_RATE] += t0
        h[M_RATE + 1] += t1
        h[M_RATE + 2] += t2
        # relative_rates took d(R w_T)/dt off the inertial angular acceleration: put it back
        dh[M_RATE] += -(x[X_Q] * t2 - x[X_R] * t1) + R[0] * e0 + R[1] * e1 + R[2] * e2
        dh[M_RATE + 1] += -(x[X_R] * t0 - x[X_P] * t2) + R[3] * e0 + R[4] * e1 + R[5] * e2
        dh[M_RATE + 2] += -(x[X_P] * t1 - x[X_Q] * t0) + R[6] * e0 + R[7] * e1 + R[8] * e2
        for i in range(3):
            f_t[i] = R[i] * fm[0] + R[3 + i] * fm[1] + R[6 + i] * fm[2]
        for i in range(3):
            a_r[i] = tk[i] * f_t[0] + tk[3 + i] * f_t[1] + tk[6 + i] * f_t[2]
        a_r[2] += G0
        # w_T x xi, and inertial velocity from it
        c0 = w1 * x[X_Z] - w2 * x[X_Y]
        c1 = w2 * x[X_X] - w0 * x[X_Z]
        c2 = w0 * x[X_Y] - w1 * x[X_X]
        g0, g1, g2 = d[X_X] + c0, d[X_Y] + c1, d[X_Z] + c2
        b0, b1, b2 = 2.0 * d[X_X] + c0, 2.0 * d[X_Y] + c1, 2.0 * d[X_Z] + c2
        k0 = w1 * b2 - w2 * b1 + e1 * x[X_Z] - e2 * x[X_Y]
        k1 = w2 * b0 - w0 * b2 + e2 * x[X_X] - e0 * x[X_Z]
        k2 = w0 * b1 - w1 * b0 + e0 * x[X_Y] - e1 * x[X_X]
        for i in range(3):
            h[M_VEL + i] = d[X_X + i]
            acc = 0.0
            for j in range(3):
                acc += tk[3 * i + j] * (a_r[j] - a_t[j])
            dh[M_VEL + i] = acc - (k0 if i == 0 else (k1 if i == 1 else k2))
            h[M_OWN_VEL + i] = tk[i] * g0 + tk[3 + i] * g1 + tk[6 + i] * g2 + tk[TK_VN + i]
            dh[M_OWN_VEL + i] = a_r[i]
        for j in range(m):
            q = codes[j]
            Y[s, j] = cf * dh[q] + cx * h[q]
