"""Prediction that leans on inertial sensors instead of aerodynamics, and the rates of change of measurements.

"hybrid": translation from the accelerometers, rotation from the aerodynamic moments. "inertial": rotation from the gyro's own
difference as well (Lee 2011, chapter 5; the accelerometer gives specific force, so gravity is added).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_of_turns
from flightsw.sixdof.forces import loads, rigid
from flightsw.sixdof.layout import M_VEL, NX, X_ALPHA, X_BETA, X_P, X_PHI, X_PSI, X_Q, X_R, X_THETA, X_V, X_WN, X_X
from flightsw.sixdof.motion import euler_rates, free_rates


@jit
def sensed_rates(
    x: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, s: np.ndarray, inertial: bool, R: np.ndarray, fm: np.ndarray,
    d: np.ndarray,
) -> None:  # fmt: skip
    """d [15] <- rates of the free state x [15]; s [6]: specific force [m/s^2] and angular acceleration [rad/s^2], body axes.

    `inertial`: use the angular acceleration of s, else that of the aerodynamic moments. R [9], fm [9] as in free_rates.
    """
    V, beta, alpha, p, q, r = x[X_V], x[X_BETA], x[X_ALPHA], x[X_P], x[X_Q], x[X_R]
    st, ct, sf, cf = math.sin(x[X_THETA]), math.cos(x[X_THETA]), math.sin(x[X_PHI]), math.cos(x[X_PHI])
    cb, sb, ca, sa = math.cos(beta), math.sin(beta), math.cos(alpha), math.sin(alpha)
    dcm_of_turns(math.sin(x[X_PSI]), math.cos(x[X_PSI]), st, ct, sf, cf, R)
    loads(V, beta, alpha, cb, sb, ca, sa, p, q, r, u, rho, P, fm)
    fm[0], fm[1], fm[2] = s[0], s[1], s[2]
    fm[6] = fm[7] = 0.0  # already in what the accelerometer felt
    rigid(V, cb, sb, ca, sa, p, q, r, fm, G0 * R[2], G0 * R[5], G0 * R[8], P, d)
    if inertial:
        d[X_P], d[X_Q], d[X_R] = s[3], s[4], s[5]
    euler_rates(p, q, r, x[X_THETA], ct, sf, cf, d[X_PSI : X_PHI + 1])
    a, b, c = V * ca * cb, V * sb, V * sa * cb
    for i in range(3):
        d[X_X + i] = R[i] * a + R[3 + i] * b + R[6 + i] * c + x[X_WN + i]
        d[X_WN + i] = 0.0


@jit_own
def propagate_sensed(
    X: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, s: np.ndarray, inertial: bool, dt: float, W: np.ndarray
) -> None:
    """One RK4 step of dt [s] for every row of X [k,>=15] in place; s [6] held over the step; W [5,15] workspace."""
    R = np.empty(9)
    fm = np.empty(9)
    for k in range(X.shape[0]):
        x = X[k]
        sensed_rates(x, u, rho, P, s, inertial, R, fm, W[0])
        for i in range(NX):
            W[4, i] = x[i] + 0.5 * dt * W[0, i]
        sensed_rates(W[4], u, rho, P, s, inertial, R, fm, W[1])
        for i in range(NX):
            W[4, i] = x[i] + 0.5 * dt * W[1, i]
        sensed_rates(W[4], u, rho, P, s, inertial, R, fm, W[2])
        for i in range(NX):
            W[4, i] = x[i] + dt * W[2, i]
        sensed_rates(W[4], u, rho, P, s, inertial, R, fm, W[3])
        for i in range(NX):
            x[i] += dt / 6.0 * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i])


@jit_own
def measure_differenced(
    X: np.ndarray,
    codes: np.ndarray,
    m: int,
    u: np.ndarray,
    rho: float,
    P: np.ndarray,
    cf: float,
    cx: float,
    Y: np.ndarray,
) -> None:
    """Y [k,>=m] <- cf d(h)/dt + cx h for the measurement codes of sixdof/measure.py (0..14): what differencing turns y into.

    The rate of a state entry is the model's; that of the inertial velocity is the inertial acceleration.
    """
    R = np.empty(9)
    fm = np.empty(9)
    d = np.empty(NX)
    for k in range(X.shape[0]):
        x = X[k]
        free_rates(x, u, rho, P, R, fm, d)
        for j in range(m):
            q = codes[j]
            if q < M_VEL:
                Y[k, j] = cf * d[q] + cx * x[q]
            else:
                i = q - M_VEL
                acc = R[i] * fm[0] + R[3 + i] * fm[1] + R[6 + i] * fm[2]
                if i == 2:
                    acc += G0
                Y[k, j] = cf * acc + cx * d[X_X + i]
