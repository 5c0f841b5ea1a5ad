"""Onboard aircraft model: wind-axis equations of motion as compiled kernels (forces and moments: forces.py).

State order of a free aircraft (15): V, beta, alpha, p, q, r, psi, theta, phi, x, y, z, Wn, We, Wd.
State order relative to a tanker (15): V, beta, alpha, p, q, r (of receiver relative to tanker, receiver axes), psi, theta,
phi (tanker body to receiver body), xi (3, tanker axes), Wn, We, Wd. Lee 2011, equations (2.2)-(2.29), signs and errata as
re-derived; the aerodynamic build-up is in stability axes and includes the alpha-dot derivatives.

Controls u (4): aileron, elevator, rudder [rad], thrust [N]. Parameters P: flightsw.sixdof.params.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_of_turns
from flightsw.sixdof.forces import loads, rigid
from flightsw.sixdof.layout import (
    NX,
    TK_END,
    TK_MIDDLE,
    TK_P,
    TK_PD,
    TK_Q,
    TK_QD,
    TK_R,
    TK_RD,
    TK_START,
    TK_VD,
    TK_VE,
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
    X_WD,
    X_WE,
    X_WN,
    X_X,
    X_Y,
    X_Z,
)


@jit
def euler_rates(p: float, q: float, r: float, theta: float, ct: float, sf: float, cf: float, out: np.ndarray) -> None:
    """out [3] <- psi_dot, theta_dot, phi_dot of 3-2-1 angles; ct cosine of theta, sf, cf sine and cosine of phi."""
    a = q * sf + r * cf
    out[0] = a / ct
    out[1] = q * cf - r * sf
    out[2] = p + a * math.tan(theta)


@jit
def air_velocity(V: float, beta: float, alpha: float) -> tuple[float, float, float]:
    """Air-relative velocity [m/s] in body axes, R_BW [V, 0, 0]."""
    cb = math.cos(beta)
    return V * math.cos(alpha) * cb, V * math.sin(beta), V * math.sin(alpha) * cb


@jit
def free_rates(
    x: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, R: np.ndarray, fm: np.ndarray, d: np.ndarray
) -> None:
    """d [15] <- time derivative of the free aircraft state x [15]; R [9] <- R_BI, fm [9] <- specific force etc. (outputs)."""
    free_motion(x, u, rho, P, R, fm, d)
    d[X_WN] = d[X_WE] = d[X_WD] = 0.0


@jit
def free_motion(
    x: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, R: np.ndarray, fm: np.ndarray, d: np.ndarray
) -> None:
    """As free_rates, with the air-relative velocity NED [m/s] in the place of the wind's derivative."""
    V, beta, alpha, p, q, r = x[X_V], x[X_BETA], x[X_ALPHA], x[X_P], x[X_Q], x[X_R]
    st, ct, sf, cf = math.sin(x[X_THETA]), math.cos(x[X_THETA]), math.sin(x[X_PHI]), math.cos(x[X_PHI])
    cb, sb, ca, sa = math.cos(beta), math.sin(beta), math.cos(alpha), math.sin(alpha)
    dcm_of_turns(math.sin(x[X_PSI]), math.cos(x[X_PSI]), st, ct, sf, cf, R)
    loads(V, beta, alpha, cb, sb, ca, sa, p, q, r, u, rho, P, fm)
    rigid(V, cb, sb, ca, sa, p, q, r, fm, G0 * R[2], G0 * R[5], G0 * R[8], P, d)
    euler_rates(p, q, r, x[X_THETA], ct, sf, cf, d[X_PSI : X_PHI + 1])
    a, b, c = V * ca * cb, V * sb, V * sa * cb
    for i in range(3):
        d[X_WN + i] = R[i] * a + R[3 + i] * b + R[6 + i] * c
        d[X_X + i] = d[X_WN + i] + x[X_WN + i]


@jit
def relative_rates(
    x: np.ndarray,
    u: np.ndarray,
    rho: float,
    P: np.ndarray,
    tk: np.ndarray,
    R: np.ndarray,
    fm: np.ndarray,
    d: np.ndarray,
) -> None:
    """d [15] <- time derivative of the receiver state relative to the tanker, x [15] or x [18] with rotational wind.

    tk [18]: tanker R_BI [9], w_T [3], w_T_dot [3] (tanker axes), v_T (NED) [3]. R [9] <- R_BRBT. Lee (2.16)-(2.29), W_I form.
    x[15:18]: effective rotational wind [rad/s], receiver axes; it changes the rates the aerodynamics see and nothing else.
    """
    relative_motion(x, u, rho, P, tk, R, fm, d)
    d[X_WN] = d[X_WE] = d[X_WD] = 0.0


@jit
def relative_motion(
    x: np.ndarray,
    u: np.ndarray,
    rho: float,
    P: np.ndarray,
    tk: np.ndarray,
    R: np.ndarray,
    fm: np.ndarray,
    d: np.ndarray,
) -> None:
    """As relative_rates, with the air-relative velocity in tanker axes [m/s] in the place of the wind's derivative."""
    V, beta, alpha = x[X_V], x[X_BETA], x[X_ALPHA]
    st, ct, sf, cf = math.sin(x[X_THETA]), math.cos(x[X_THETA]), math.sin(x[X_PHI]), math.cos(x[X_PHI])
    cb, sb, ca, sa = math.cos(beta), math.sin(beta), math.cos(alpha), math.sin(alpha)
    dcm_of_turns(math.sin(x[X_PSI]), math.cos(x[X_PSI]), st, ct, sf, cf, R)
    w0, w1, w2 = tk[TK_P], tk[TK_Q], tk[TK_R]
    # R w_T, and total inertial rates in receiver axes
    t0 = R[0] * w0 + R[1] * w1 + R[2] * w2
    t1 = R[3] * w0 + R[4] * w1 + R[5] * w2
    t2 = R[6] * w0 + R[7] * w1 + R[8] * w2
    p, q, r = x[X_P] + t0, x[X_Q] + t1, x[X_R] + t2
    if x.shape[0] > NX:
        loads(V, beta, alpha, cb, sb, ca, sa, p - x[X_PE], q - x[X_QE], r - x[X_RE], u, rho, P, fm)
    else:
        loads(V, beta, alpha, cb, sb, ca, sa, p, q, r, u, rho, P, fm)
    g0, g1, g2 = G0 * tk[2], G0 * tk[5], G0 * tk[8]  # gravity in tanker axes
    rigid(
        V, cb, sb, ca, sa, p, q, r, fm,
        R[0] * g0 + R[1] * g1 + R[2] * g2,
        R[3] * g0 + R[4] * g1 + R[5] * g2,
        R[6] * g0 + R[7] * g1 + R[8] * g2,
        P, d,
    )  # fmt: skip
    # d/dt(R w_T) = -w_rel x (R w_T) + R w_T_dot
    e0, e1, e2 = tk[TK_PD], tk[TK_QD], tk[TK_RD]
    d[X_P] -= -(x[X_Q] * t2 - x[X_R] * t1) + R[0] * e0 + R[1] * e1 + R[2] * e2
    d[X_Q] -= -(x[X_R] * t0 - x[X_P] * t2) + R[3] * e0 + R[4] * e1 + R[5] * e2
    d[X_R] -= -(x[X_P] * t1 - x[X_Q] * t0) + R[6] * e0 + R[7] * e1 + R[8] * e2
    euler_rates(x[X_P], x[X_Q], x[X_R], x[X_THETA], ct, sf, cf, d[X_PSI : X_PHI + 1])
    a, b, c = V * ca * cb, V * sb, V * sa * cb
    for i in range(3):
        d[X_WN + i] = R[i] * a + R[3 + i] * b + R[6 + i] * c
    _apart(x, d[X_WN], d[X_WE], d[X_WD], tk, d[X_X : X_Z + 1])


@jit
def relative_velocity(x: np.ndarray, tk: np.ndarray, R: np.ndarray, v: np.ndarray) -> None:
    """v [3] <- d(xi)/dt in tanker axes: R^T u_a + R_BTI (W - v_T) - w_T x xi (Lee 2.23); R [9] = R_BRBT of x."""
    a, b, c = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
    for i in range(3):
        v[i] = R[i] * a + R[3 + i] * b + R[6 + i] * c
    _apart(x, v[0], v[1], v[2], tk, v)


@jit
def _apart(x: np.ndarray, a: float, b: float, c: float, tk: np.ndarray, v: np.ndarray) -> None:
    """As relative_velocity, where R^T u_a = (a, b, c)."""
    n0, n1, n2 = x[X_WN] - tk[TK_VN], x[X_WE] - tk[TK_VE], x[X_WD] - tk[TK_VD]
    w0, w1, w2 = tk[TK_P], tk[TK_Q], tk[TK_R]
    v[0] = a + tk[0] * n0 + tk[1] * n1 + tk[2] * n2
    v[1] = b + tk[3] * n0 + tk[4] * n1 + tk[5] * n2
    v[2] = c + tk[6] * n0 + tk[7] * n1 + tk[8] * n2
    v[0] -= w1 * x[X_Z] - w2 * x[X_Y]
    v[1] -= w2 * x[X_X] - w0 * x[X_Z]
    v[2] -= w0 * x[X_Y] - w1 * x[X_X]


FIRST = 0  # the point the others are compared with


@jit
def _moves_alike(x: np.ndarray, first: np.ndarray) -> bool:
    """Whether the entries of x [>=15] before its position are those of first [9], none of them zero: aircraft whose positions and
    winds alone differ move alike through the air, to the bit. Of the points of a triangular factor those are two in five."""
    alike = 0
    for i in range(X_X):
        alike += 1 if x[i] == first[i] and x[i] != 0.0 else 0  # a zero has a sign
    return alike == X_X


@jit_own
def propagate_free(X: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, dt: float, W: np.ndarray) -> None:
    """One RK4 step of dt [s] for every row of X [k,15] in place; u [4] held; W [5,15] workspace."""
    R, fm = np.empty(9), np.empty(9)
    first, air = np.empty(X_X), np.empty((4, 3))  # that row as it was, and its air-relative velocity in the four stages
    for s in range(X.shape[0]):
        x = X[s]
        if s > FIRST and _moves_alike(x, first):
            for i in range(3):
                w = x[X_WN + i]
                mid = air[1, i] + w + (air[2, i] + w)
                x[X_X + i] += dt / 6.0 * (air[0, i] + w + 2.0 * mid + (air[3, i] + w))
            for i in range(X_X):
                x[i] = X[FIRST, i]
            continue
        free_motion(x, u, rho, P, R, fm, W[0])
        for i in range(X_WN):
            W[4, i] = x[i] + 0.5 * dt * W[0, i]
        for i in range(X_WN, NX):
            W[4, i] = x[i]
        free_motion(W[4], u, rho, P, R, fm, W[1])
        for i in range(X_WN):
            W[4, i] = x[i] + 0.5 * dt * W[1, i]
        free_motion(W[4], u, rho, P, R, fm, W[2])
        for i in range(X_WN):
            W[4, i] = x[i] + dt * W[2, i]
        free_motion(W[4], u, rho, P, R, fm, W[3])
        if s == FIRST:
            for i in range(X_X):
                first[i] = x[i]
            for k in range(4):
                for i in range(3):
                    air[k, i] = W[k, X_WN + i]
        for i in range(X_WN):
            x[i] += dt / 6.0 * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i])


@jit_own
def propagate_relative(
    X: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, TKS: np.ndarray, dt: float, W: np.ndarray
) -> None:
    """One RK4 step of dt [s] for every row of X [k,>=nx] in place; TKS [3,18] tanker at start, middle and end.

    W [5,nx] is workspace and says how many entries of a row belong to the model: 15, or 18 with rotational wind (held).
    """
    nx = W.shape[1]
    R, fm = np.empty(9), np.empty(9)
    first, air = np.empty(X_X), np.empty((4, 3))  # as in propagate_free
    for s in range(X.shape[0]):
        x = X[s, :nx]
        if s > FIRST and nx == NX and _moves_alike(x, first):
            _beside(x, air, TKS, dt, W)
            for i in range(X_X):
                x[i] = X[FIRST, i]
            continue
        relative_motion(x, u, rho, P, TKS[TK_START], R, fm, W[0])
        for i in range(X_WN):
            W[4, i] = x[i] + 0.5 * dt * W[0, i]
        for i in range(X_WN, nx):
            W[4, i] = x[i]
        relative_motion(W[4], u, rho, P, TKS[TK_MIDDLE], R, fm, W[1])
        for i in range(X_WN):
            W[4, i] = x[i] + 0.5 * dt * W[1, i]
        relative_motion(W[4], u, rho, P, TKS[TK_MIDDLE], R, fm, W[2])
        for i in range(X_WN):
            W[4, i] = x[i] + dt * W[2, i]
        relative_motion(W[4], u, rho, P, TKS[TK_END], R, fm, W[3])
        if s == FIRST:
            for i in range(X_X):
                first[i] = x[i]
            for k in range(4):
                for i in range(3):
                    air[k, i] = W[k, X_WN + i]
        for i in range(X_WN):
            x[i] += dt / 6.0 * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i])


@jit
def _beside(x: np.ndarray, air: np.ndarray, TKS: np.ndarray, dt: float, W: np.ndarray) -> None:
    """The position of x [15] after propagate_relative's step, of which air [4,3] are the R^T u_a of the stages."""
    for i in range(X_X, NX):
        W[4, i] = x[i]
    for k in range(4):
        stage = TK_START if k == 0 else TK_END if k == 3 else TK_MIDDLE
        _apart(W[4], air[k, 0], air[k, 1], air[k, 2], TKS[stage], W[k, X_X : X_Z + 1])
        share = dt if k == 2 else 0.5 * dt
        for i in range(X_X, X_WN):
            W[4, i] = x[i] + share * W[k, i]
    for i in range(X_X, X_WN):
        x[i] += dt / 6.0 * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i])


@jit
def air_jacobian(V: float, beta: float, alpha: float, R: np.ndarray, G: np.ndarray) -> None:
    """G [3,3] <- -eps^-1 R: change of (V, beta, alpha) for a wind increment in the parent frame of R [9] (parent to body).

    The process-noise coupling of Lee's filter: a wind jump dW changes the air-relative velocity by -dW at once.
    """
    cb, sb = math.cos(beta), math.sin(beta)
    ca, sa = math.cos(alpha), math.sin(alpha)
    for j in range(3):
        x, y, z = R[j], R[3 + j], R[6 + j]
        dv = x * ca * cb + y * sb + z * sa * cb
        G[0, j] = -dv
        G[1, j] = -(y - dv * sb) / (V * cb)
        G[2, j] = -(z * ca - x * sa) / (V * cb)
