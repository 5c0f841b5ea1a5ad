"""A receiver's estimator step in compiled pieces, and all of them in one call (receiver/estimator.py)."""

from __future__ import annotations

import math

import numpy as np

from flightsw import refusal as rd
from flightsw.filters.srukf import draw, recombine, row_norms
from flightsw.kernels.atmosphere import density
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    mul33,
    mul33_t,
    quat_from_euler,
    to_parent,
)
from flightsw.missions.receiver.tanker_link import carried
from flightsw.sixdof.aids import (
    ATT,
    DT,
    NOW,
    QW,
    RT,
    TAKING,
    USE,
    USE_AIR,
    USE_ATT,
    USE_GYRO,
    USE_VEL,
    air_data,
    attitude,
    averaged,
    gnss_velocity,
    gyro,
)
from flightsw.sixdof.estimator_core import R_PEER_RATE, R_POS, R_VEL, fill_noise, inertial, sane
from flightsw.sixdof.judged import DONE, LOST, O_END, O_M, O_NIS, O_PROBES, O_RHO, O_SIFTED, O_X, judged
from flightsw.sixdof.layout import (
    M_OWN_VEL,
    M_POS,
    M_VEL,
    NX,
    TK_END,
    TK_P,
    TK_START,
    X_ALPHA,
    X_BETA,
    X_P,
    X_PHI,
    X_PSI,
    X_THETA,
    X_V,
    X_WN,
    X_X,
    X_Y,
    X_Z,
)
from flightsw.sixdof.measure import measure_relative
from flightsw.sixdof.motion import air_velocity, propagate_relative, relative_rates

# inputs before those of the own sensors: the tanker's three stages from its sample [s], height the density is taken at [m]; age
# of the relative reading [s], what the gate alone is told of it [m], position [m], velocity [m/s]; rows that are queued already
STAGES, HEIGHT, REL_AGE, REL_SLACK, REL_POS, REL_VEL, BEFORE = 0, 3, 4, 5, 6, 9, 12
OWN = 13
USE_REL_POS, USE_REL_VEL = 32, 64

# outputs from O_X on: the state, the rate of change of xi, inertial acceleration NED, quaternion, inertial body rates, angles and
# position NED, inertial velocity NED, 1-sigma of the state
O_RATE = O_X + NX
O_ACC = O_RATE + 3
O_Q = O_ACC + 3
O_W = O_Q + 4
O_EULER = O_W + 3
O_POS = O_EULER + 3
O_VEL = O_POS + 3
O_SIGMA = O_VEL + 3
RELATIVE_OUT = O_SIGMA + NX


@jit
def inertial_rates(x: np.ndarray, R: np.ndarray, tk: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- own inertial body rates [rad/s]: those of the state x [>=15], and R w_T, R [9] = R_BRBT, tk [18] tanker."""
    p, q, r = tk[TK_P], tk[TK_P + 1], tk[TK_P + 2]
    for i in range(3):
        out[i] = x[X_P + i] + R[3 * i] * p + R[3 * i + 1] * q + R[3 * i + 2] * r


@jit_own
def attitude_behind(q: np.ndarray, tk: np.ndarray, out: np.ndarray) -> None:
    """out [9] <- R_BRI R_BTI^T: the own attitude reference q [4] relative to the tanker, tk [18] of now."""
    R = np.empty(9)
    dcm_from_quat(q, R)
    mul33_t(R, tk[:TK_P], out)


@jit_own
def relative_rows(
    s: np.ndarray, tune: np.ndarray, x: np.ndarray, d: np.ndarray, fm: np.ndarray, R: np.ndarray, Rn: np.ndarray,
    tk: np.ndarray, pos: np.ndarray, w_air: np.ndarray, air: np.ndarray,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Queue what is new of the inputs s; rows there are, and probes averaged into air [3], which only come first.

    R [9] R_BRBT, tk [18] tanker now; w_air [3] <- inertial body rates, Rn [9] <- workspace; other arguments as free_rows.
    """
    own, e = s[OWN:], np.empty(3)
    use, m, n = int(own[USE]), int(s[BEFORE]), 0
    mul33(R, tk[:TK_P], Rn)
    inertial_rates(x, R, tk, w_air)
    if use & USE_AIR:
        n = averaged(own, pos, w_air, air)
        if n > 0:
            m = air_data(own, tune, n, air, d, codes, y, r, group, slack)
    if use & USE_GYRO:
        m = gyro(own, tune, d, m, codes, y, r, group, slack)
    if use & USE_VEL:
        inertial(Rn, fm, e)
        m = gnss_velocity(own, M_OWN_VEL, e, m, codes, y, r, group, slack)
    if use & USE_REL_POS:
        for i in range(3):
            codes[m], group[m] = M_POS + i, rd.REL_POS
            y[m], r[m], slack[m] = s[REL_POS + i] + d[X_X + i] * s[REL_AGE], tune[R_POS], s[REL_SLACK]
            m += 1
    if use & USE_REL_VEL:
        # the tanker's rates are taken as exact in w_T x xi: the gate has to know better
        swing = tune[R_PEER_RATE] * math.sqrt(x[X_X] * x[X_X] + x[X_Y] * x[X_Y] + x[X_Z] * x[X_Z])
        for i in range(3):
            codes[m], group[m] = M_VEL + i, rd.REL_VEL
            y[m], r[m], slack[m] = s[REL_VEL + i], tune[R_VEL], swing
            m += 1
    if use & USE_ATT:
        attitude_behind(own[ATT : ATT + 4], tk, Rn)
        euler_from_dcm(Rn, e)
        # the tanker's attitude is taken as exact: the gate has to know better
        m = attitude(own, tune, e, x, d, m, codes, y, r, group, slack)
    return m, n


@jit_own
def relative_told(
    x: np.ndarray, d: np.ndarray, fm: np.ndarray, R: np.ndarray, Rn: np.ndarray, tk: np.ndarray, at: np.ndarray,
    w_air: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """out [RELATIVE_OUT] from O_X on but for the sigmas <- what is published of the state x [>=15] with rates d [15], specific
    force fm [9], R [9] R_BRBT, tk [18] tanker now, at [3] NED [m]; Rn [9] <- R_BRI, w_air [3] <- inertial body rates."""
    for i in range(NX):
        out[O_X + i] = x[i]
    for i in range(3):
        out[O_RATE + i] = d[X_X + i]
    mul33(R, tk[:TK_P], Rn)
    inertial_rates(x, R, tk, w_air)
    e = out[O_EULER : O_EULER + 3]
    euler_from_dcm(Rn, e)
    quat_from_euler(e[0], e[1], e[2], out[O_Q : O_Q + 4])
    v, u_a = np.empty(3), np.empty(3)
    to_parent(tk, x[X_X : X_Z + 1], v)
    for i in range(3):
        out[O_W + i] = w_air[i]
        out[O_POS + i] = at[i] + v[i]
    u_a[0], u_a[1], u_a[2] = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
    # inertial velocity = air-relative velocity + wind
    to_parent(Rn, u_a, v)
    for i in range(3):
        out[O_VEL + i] = v[i] + x[X_WN + i]
    inertial(Rn, fm, out[O_ACC : O_ACC + 3])


@jit
def relative_step(
    s: np.ndarray, u: np.ndarray, tune: np.ndarray, P: np.ndarray, pos: np.ndarray,
    x: np.ndarray, S: np.ndarray, X: np.ndarray, Y: np.ndarray, SQ: np.ndarray, A: np.ndarray, B: np.ndarray, D: np.ndarray,
    nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, sigma: np.ndarray, was_x: np.ndarray, was_S: np.ndarray,
    q: np.ndarray, J: np.ndarray, W: np.ndarray, R: np.ndarray, fm: np.ndarray, d: np.ndarray, w_air: np.ndarray, air: np.ndarray,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
    st: np.ndarray, bad: np.ndarray, var: np.ndarray, channel: np.ndarray, keep: np.ndarray, out: np.ndarray,
    g: float, w0m: float, w0c: float, wi: float, limit2: float, watched: int, correlated: bool,
    Rn: np.ndarray, tks: np.ndarray, tR: np.ndarray, tw: np.ndarray, tv: np.ndarray, ta: np.ndarray, tpos: np.ndarray,
) -> None:  # fmt: skip
    """As free_step, behind a tanker with the last sample tR [9] NED to body, tw [3], tv, ta, tpos [3] NED.

    tks [3,18] <- its stages; s [OWN + PROBES + 4 k] inputs, Rn [9] as the estimator's, out [RELATIVE_OUT].
    """
    own = s[OWN:]
    dt, rho, tk = own[DT], density(s[HEIGHT]), tks[TK_END]
    for i in range(3):
        carried(tR, tw, tv, ta, s[STAGES + i], tks[i])
    if dt > 0.0:
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        mul33(R, tks[TK_START, :TK_P], Rn)
        fill_noise(SQ, x, Rn, q, own[RT], own[QW], correlated, J)
        draw(x, S, g, X)
        propagate_relative(X, u, rho, P, tks, dt, W)
        recombine(X, w0m, w0c, wi, SQ, x, S, A)
    relative_rates(x, u, rho, P, tk, R, fm, d)
    m, probes = relative_rows(s, tune, x, d, fm, R, Rn, tk, pos, w_air, air, codes, y, r, group, slack)
    nis, sifted, end = 0.0, 0, DONE
    if m > 0:
        draw(x, S, g, X)
        measure_relative(X, codes, m, tk, Y)
        nis, sifted, end = judged(
            own[NOW], own[TAKING] > 0.0, limit2, watched, m, w0m, w0c, wi, X, Y, y, r, x, S, nu, K, Sy, A, B, D, was_x, was_S,
            group, slack, st, bad, var, channel, keep,
        )  # fmt: skip
    if end == DONE and not sane(x, S):
        end = LOST
    out[O_M], out[O_PROBES], out[O_END], out[O_SIFTED], out[O_NIS], out[O_RHO] = m, probes, end, sifted, nis, rho
    if end == DONE:
        relative_rates(x, u, rho, P, tk, R, fm, d)
        at, t = W[0], s[STAGES + TK_END]  # the propagation's work space, which it needs no more
        for i in range(3):
            at[i] = tpos[i] + tv[i] * t + 0.5 * ta[i] * t * t
        relative_told(x, d, fm, R, Rn, tk, at, w_air, out)
        row_norms(S, sigma)
        for i in range(NX):
            out[O_SIGMA + i] = sigma[i]
