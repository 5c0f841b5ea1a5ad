"""Inertial velocity in the place of wind: the coordinates in which heading and wind do not feign each other's information.

Turning the heading psi by d about the vertical and the wind by -d x (air velocity) leaves every inertial velocity as it was:
no sensor but the compass tells the two apart in straight flight. With wind as a state that direction moves with every gust,
and a filter linearised anew at each step takes the moves for information on heading (the inconsistency of EKF-SLAM, Huang,
Mourikis, Roumeliotis 2010). With v_n = R_BI^T u_a + W in entries 12..14 it is d(psi) alone, whatever the gusts: the filter
works in these coordinates, wind is read off.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.layout import X_ALPHA, X_BETA, X_PHI, X_PSI, X_THETA, X_V, X_WN
from flightsw.sixdof.motion import air_velocity

COLUMNS = (X_V, X_BETA, X_ALPHA, X_PSI, X_THETA, X_PHI)  # states the air velocity NED depends on; columns of A below


@jit_own
def exchange(X: np.ndarray, sign: float) -> None:
    """X[:, 12:15] += sign R_BI^T u_a for every row of X [k,>=15], NED: sign +1 wind to inertial velocity, -1 back."""
    R = np.empty(9)
    for s in range(X.shape[0]):
        x = X[s]
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        a, b, c = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
        for i in range(3):
            x[X_WN + i] += sign * (R[i] * a + R[3 + i] * b + R[6 + i] * c)


@jit_own
def air_slope(x: np.ndarray, A: np.ndarray) -> None:
    """A [3,6] <- d(R_BI^T u_a)/d(V, beta, alpha, psi, theta, phi) at the state x [>=9], NED."""
    R = np.empty(9)
    dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
    cb, sb = math.cos(x[X_BETA]), math.sin(x[X_BETA])
    ca, sa = math.cos(x[X_ALPHA]), math.sin(x[X_ALPHA])
    V = x[X_V]
    # body-axis derivatives of u_a = V [ca cb, sb, sa cb]
    for i in range(3):
        n0, n1, n2 = R[i], R[3 + i], R[6 + i]
        A[i, 0] = n0 * ca * cb + n1 * sb + n2 * sa * cb
        A[i, 1] = V * (-n0 * ca * sb + n1 * cb - n2 * sa * sb)
        A[i, 2] = V * cb * (-n0 * sa + n2 * ca)
    v0, v1, v2 = V * A[0, 0], V * A[1, 0], V * A[2, 0]
    # rotation about the vertical, about the horizontal axis turned by psi, about the body's own x axis
    A[0, 3], A[1, 3], A[2, 3] = -v1, v0, 0.0
    c, s = math.cos(x[X_PSI]), math.sin(x[X_PSI])
    A[0, 4], A[1, 4], A[2, 4] = c * v2, s * v2, -s * v1 - c * v0
    A[0, 5] = R[1] * v2 - R[2] * v1
    A[1, 5] = R[2] * v0 - R[0] * v2
    A[2, 5] = R[0] * v1 - R[1] * v0


@jit
def shear(S: np.ndarray, A: np.ndarray, sign: float) -> None:
    """Rows 12..14 of the factor S [>=15,k] += sign A (rows V, beta, alpha, psi, theta, phi); A [3,6] of `air_slope`.

    Turns a factor of errors with wind into one with inertial velocity (+1) or back (-1); the result is not triangular.
    """
    for j in range(S.shape[1]):
        for i in range(3):
            d = A[i, 0] * S[X_V, j] + A[i, 1] * S[X_BETA, j] + A[i, 2] * S[X_ALPHA, j]
            S[X_WN + i, j] += sign * (d + A[i, 3] * S[X_PSI, j] + A[i, 4] * S[X_THETA, j] + A[i, 5] * S[X_PHI, j])
