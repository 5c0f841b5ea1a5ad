"""A free aircraft's estimator step in compiled pieces, and all of them in one call (sixdof/estimator.py)."""

from __future__ import annotations

import numpy as np

from flightsw.filters.srukf import draw, recombine, row_norms
from flightsw.kernels.atmosphere import density
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler, dcm_from_quat, euler_from_dcm, quat_from_euler
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
    USE_POS,
    USE_VEL,
    air_data,
    attitude,
    averaged,
    gnss_position,
    gnss_velocity,
    gyro,
)
from flightsw.sixdof.estimator_core import fill_noise, inertial, sane
from flightsw.sixdof.judged import DONE, LOST, O_END, O_M, O_NIS, O_PROBES, O_RHO, O_SIFTED, O_X, judged
from flightsw.sixdof.layout import M_VEL, NX, X_P, X_PHI, X_PSI, X_THETA, X_X, X_Z
from flightsw.sixdof.measure import measure_free
from flightsw.sixdof.motion import free_rates, propagate_free

# outputs from O_X on: the state, the rate of change of position, inertial acceleration NED, quaternion, 1-sigma of the state
O_VEL = O_X + NX
O_ACC = O_VEL + 3
O_Q = O_ACC + 3
O_SIGMA = O_Q + 4
FREE_OUT = O_SIGMA + NX


@jit_own
def free_rows(
    s: np.ndarray, tune: np.ndarray, x: np.ndarray, d: np.ndarray, fm: np.ndarray, R: np.ndarray,
    pos: np.ndarray, w_air: np.ndarray, air: np.ndarray,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> tuple[int, int]:  # fmt: skip
    """Queue what is new of the inputs s (aids.own_sensors); rows there are, and probes averaged into air [3].

    x [>=15], its rates d [15], the model's specific force fm [9], pos [k,3] probes; w_air [3] <- body rates, R [9] <- workspace;
    tune [8], codes, y, r, group, slack as EstimatorCore.
    """
    use, m, n = int(s[USE]), 0, 0
    e = np.empty(3)
    for i in range(3):
        w_air[i] = x[X_P + i]
    if use & USE_AIR:
        n = averaged(s, pos, w_air, air)
        if n > 0:
            m = air_data(s, tune, n, air, d, codes, y, r, group, slack)
    if use & USE_GYRO:
        m = gyro(s, tune, d, m, codes, y, r, group, slack)
    if use & USE_ATT:
        dcm_from_quat(s[ATT : ATT + 4], R)
        euler_from_dcm(R, e)
        m = attitude(s, tune, e, x, d, m, codes, y, r, group, slack)
    if use & USE_POS:
        m = gnss_position(s, tune, d, m, codes, y, r, group, slack)
    if use & USE_VEL:
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        inertial(R, fm, e)
        m = gnss_velocity(s, M_VEL, e, m, codes, y, r, group, slack)
    return m, n


@jit
def free_told(x: np.ndarray, d: np.ndarray, fm: np.ndarray, R: np.ndarray, out: np.ndarray) -> None:
    """out [FREE_OUT] from O_X on but for the sigmas <- what is published of the state x [>=15] with rates d [15] and specific
    force fm [9]; R [9] <- R_BI."""
    for i in range(NX):
        out[O_X + i] = x[i]
    for i in range(3):
        out[O_VEL + i] = d[X_X + i]
    dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
    inertial(R, fm, out[O_ACC : O_ACC + 3])
    quat_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], out[O_Q : O_Q + 4])


@jit
def free_step(
    s: np.ndarray, u: np.ndarray, tune: np.ndarray, P: np.ndarray, pos: np.ndarray,
    x: np.ndarray, S: np.ndarray, X: np.ndarray, Y: np.ndarray, SQ: np.ndarray, A: np.ndarray, B: np.ndarray, D: np.ndarray,
    nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, sigma: np.ndarray, was_x: np.ndarray, was_S: np.ndarray,
    q: np.ndarray, J: np.ndarray, W: np.ndarray, R: np.ndarray, fm: np.ndarray, d: np.ndarray, w_air: np.ndarray, air: np.ndarray,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
    st: np.ndarray, bad: np.ndarray, var: np.ndarray, channel: np.ndarray, keep: np.ndarray, out: np.ndarray,
    g: float, w0m: float, w0c: float, wi: float, limit2: float, watched: int, correlated: bool,
) -> None:  # fmt: skip
    """Predict, queue, correct, judge and tell: one step while nothing is in dispute, out [FREE_OUT] <- what came of it.

    s [PROBES + 4 k] inputs (aids.own_sensors), u [4] controls; the rest as EstimatorCore, SquareRootUKF and GroupGate keep it, in
    place, w_air [3], R, fm [9], d [15] as the estimator's. Where it does not end with DONE, the corrected state is left for the
    owner to go on with.
    """
    dt, rho = s[DT], density(-x[X_Z])
    if dt > 0.0:
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        fill_noise(SQ, x, R, q, s[RT], s[QW], correlated, J)
        draw(x, S, g, X)
        propagate_free(X, u, rho, P, dt, W)
        recombine(X, w0m, w0c, wi, SQ, x, S, A)
    free_rates(x, u, rho, P, R, fm, d)
    m, probes = free_rows(s, tune, x, d, fm, R, pos, w_air, air, codes, y, r, group, slack)
    nis, sifted, end = 0.0, 0, DONE
    if m > 0:
        draw(x, S, g, X)
        measure_free(X, codes, m, Y)
        nis, sifted, end = judged(
            s[NOW], s[TAKING] > 0.0, limit2, watched, m, w0m, w0c, wi, X, Y, y, r, x, S, nu, K, Sy, A, B, D, was_x, was_S,
            group, slack, st, bad, var, channel, keep,
        )  # fmt: skip
    if end == DONE and not sane(x, S):
        end = LOST
    out[O_M], out[O_PROBES], out[O_END], out[O_SIFTED], out[O_NIS], out[O_RHO] = m, probes, end, sifted, nis, rho
    if end == DONE:
        free_rates(x, u, rho, P, R, fm, d)
        free_told(x, d, fm, R, out)
        row_norms(S, sigma)
        for i in range(NX):
            out[O_SIGMA + i] = sigma[i]
