"""Onboard measurement models as compiled kernels: sigma points to expected measurements, and probe averaging.

Measurement codes (columns are selected by an integer list, so a missing sensor simply leaves its codes out):
free aircraft 0..11 = state entry, 12..14 = inertial velocity NED, 15..17 = wind NED (calculated);
relative 0..2 V, beta, alpha; 3..5 inertial body rates;
6..8 relative psi, theta, phi; 9..11 xi; 12..14 d(xi)/dt in tanker axes; 15..17 own inertial velocity NED.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.layout import (
    M_EULER,
    M_OWN_VEL,
    M_RATE,
    M_VEL,
    M_WIND,
    TK_P,
    TK_Q,
    TK_R,
    TK_VN,
    X_ALPHA,
    X_BETA,
    X_PHI,
    X_PSI,
    X_THETA,
    X_V,
    X_WN,
    X_X,
    X_Y,
    X_Z,
)
from flightsw.sixdof.motion import air_velocity, relative_velocity


@jit_own
def measure_free(X: np.ndarray, codes: np.ndarray, m: int, Y: np.ndarray) -> None:
    """Y [k,>=m] <- expected measurements of the points X [k,15] for codes [>=m] (inertial velocity = R_BI^T u_a + W)."""
    R = np.empty(9)
    v = np.empty(3)
    for s in range(X.shape[0]):
        x = X[s]
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        a, b, c = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
        for i in range(3):
            v[i] = R[i] * a + R[3 + i] * b + R[6 + i] * c + x[X_WN + i]
        for j in range(m):
            k = codes[j]
            Y[s, j] = x[k] if k < M_VEL else (v[k - M_VEL] if k < M_WIND else x[X_WN + k - M_WIND])


@jit_own
def measure_relative(X: np.ndarray, codes: np.ndarray, m: int, tk: np.ndarray, Y: np.ndarray) -> None:
    """Y [k,>=m] <- expected measurements of the relative points X [k,15]; tk [18] tanker now (see layout.py)."""
    R = np.empty(9)
    v = np.empty(3)
    vi = np.empty(3)
    w0, w1, w2 = tk[TK_P], tk[TK_Q], tk[TK_R]
    for s in range(X.shape[0]):
        x = X[s]
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        relative_velocity(x, tk, R, v)
        # tanker-axes inertial velocity of the receiver, then to NED
        a0 = v[0] + w1 * x[X_Z] - w2 * x[X_Y]
        a1 = v[1] + w2 * x[X_X] - w0 * x[X_Z]
        a2 = v[2] + w0 * x[X_Y] - w1 * x[X_X]
        for i in range(3):
            vi[i] = tk[i] * a0 + tk[3 + i] * a1 + tk[6 + i] * a2 + tk[TK_VN + i]
        for j in range(m):
            k = codes[j]
            if k < M_RATE or M_EULER <= k < M_VEL:
                Y[s, j] = x[k]
            elif k < M_EULER:
                i = 3 * (k - M_RATE)
                Y[s, j] = x[k] + R[i] * w0 + R[i + 1] * w1 + R[i + 2] * w2
            elif k < M_OWN_VEL:
                Y[s, j] = v[k - M_VEL]
            else:
                Y[s, j] = vi[k - M_OWN_VEL]


@jit
def average_probes(
    V: np.ndarray, alpha: np.ndarray, beta: np.ndarray, ok: np.ndarray, pos: np.ndarray, w: np.ndarray, out: np.ndarray
) -> int:
    """out [3] <- V [m/s], beta, alpha [rad] at the centre of gravity from N probes; returns how many were used.

    V, alpha, beta, ok [N]; pos [N,3] probe positions and w [3] rates in body axes: each reading is the air-relative
    velocity at the probe, u_a + w x r, so w x r is taken off before averaging the velocity vectors.
    """
    n = 0
    a = b = c = 0.0
    for i in range(V.shape[0]):
        if ok[i] == 0:
            continue
        n += 1
        cb = math.cos(beta[i])
        a += V[i] * math.cos(alpha[i]) * cb - (w[1] * pos[i, 2] - w[2] * pos[i, 1])
        b += V[i] * math.sin(beta[i]) - (w[2] * pos[i, 0] - w[0] * pos[i, 2])
        c += V[i] * math.sin(alpha[i]) * cb - (w[0] * pos[i, 1] - w[1] * pos[i, 0])
    if n == 0:
        return 0
    a, b, c = a / n, b / n, c / n
    s = math.sqrt(a * a + b * b + c * c)
    out[0] = s
    out[1] = math.asin(b / s)
    out[2] = math.atan2(c, a)
    return n
