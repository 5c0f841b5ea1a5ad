"""Loads from coefficients that are a series in incidence and deflections, body axes throughout: the form of Lee (2011)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.earth import weight
from sim_plant.kernels.jit import jit

# the block at par[P_SERIES], in the order of the table of the kind that has one; angles [rad]
CD0, CD_ALPHA, CD_ALPHA2, CD_DE, CD_DE2, CD_DS, CD_DS2 = 0, 1, 2, 3, 4, 5, 6
CS0, CS_BETA, CS_DA, CS_DR = 7, 8, 9, 10
CL0, CL_ALPHA, CL_ALPHA2, ALPHA_REF, CL_Q, CL_DE, CL_DS = 11, 12, 13, 14, 15, 16, 17
CROLL0, CROLL_DA, CROLL_DR, CROLL_BETA, CROLL_P, CROLL_R = 18, 19, 20, 21, 22, 23
CM0, CM_ALPHA, CM_DE, CM_Q, CM_DS = 24, 25, 26, 27, 28
CN0, CN_DA, CN_DR, CN_BETA, CN_P, CN_R = 29, 30, 31, 32, 33, 34
STABILIZER, THRUST_UP, AFT, RIGHT, BELOW, N_SERIES = 35, 36, 37, 38, 39, 40

Six = tuple[float, float, float, float, float, float]


@jit
def coefficients(
    k: NDArray[np.float64], alpha: float, beta: float, p: float, q: float, r: float, da: float, de: float, dr: float
) -> Six:
    """C_D, C_S (positive to the left), C_L, roll, pitch, yaw of block `k` [N_SERIES]; alpha, beta, da, de, dr [rad]; p, q, r
    are b p / 2V, c q / 2V, b r / 2V relative to the air, in body axes. Source: lee.md (2.20), (2.26)."""
    ds, off = k[STABILIZER], alpha - k[ALPHA_REF]
    drag = k[CD0] + k[CD_ALPHA] * alpha + k[CD_ALPHA2] * alpha * alpha + k[CD_DE] * de + k[CD_DE2] * de * de
    drag += k[CD_DS] * ds + k[CD_DS2] * ds * ds
    side = k[CS0] + k[CS_BETA] * beta + k[CS_DA] * da + k[CS_DR] * dr
    lift = k[CL0] + k[CL_ALPHA] * alpha + k[CL_ALPHA2] * off * off + k[CL_Q] * q + k[CL_DE] * de + k[CL_DS] * ds
    roll = k[CROLL0] + k[CROLL_DA] * da + k[CROLL_DR] * dr + k[CROLL_BETA] * beta + k[CROLL_P] * p + k[CROLL_R] * r
    pitch = k[CM0] + k[CM_ALPHA] * alpha + k[CM_DE] * de + k[CM_Q] * q + k[CM_DS] * ds
    yaw = k[CN0] + k[CN_DA] * da + k[CN_DR] * dr + k[CN_BETA] * beta + k[CN_P] * p + k[CN_R] * r
    return drag, side, lift, roll, pitch, yaw


@jit
def series_loads(
    x: NDArray[np.float64],
    surfaces: tuple[float, float, float],
    mass: float,
    par: NDArray[np.float64],
    flow: tuple[float, float, float, float, float, float],
    rates: tuple[float, float, float],
    down: tuple[float, float],
    qs: float,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Force (no gravity) [N] and moment [N m] in body axes, then lift, drag [N] and alphadot [rad/s] (over a flat earth).

    x rigid-body state, surfaces aileron, elevator, rudder [rad], mass [kg]; flow: body velocity u, v, w relative to the air,
    its size [m/s], alpha, beta [rad]; rates p, q, r relative to the air [rad/s]; down: what body x and z have of down; qs [N]
    dynamic pressure times area. Thrust acts THRUST_UP above body x, at AFT, RIGHT, BELOW [m] of the centre of gravity.
    Source: lee.md (2.18), (2.20), (2.25) with E21, (2.26).
    """
    k = par[int(par[n.P_SERIES]) : int(par[n.P_SERIES]) + N_SERIES]
    u, v, w, speed, alpha, beta = flow
    hb, hc = 0.5 * par[n.P_B] / speed, 0.5 * par[n.P_C] / speed
    da, de, dr = surfaces
    cd, cs, cl, c_roll, cm, c_yaw = coefficients(
        k, alpha, beta, hb * rates[0], hc * rates[1], hb * rates[2], da, de, dr
    )
    drag, side, lift = qs * cd, qs * cs, qs * cl
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    tx, tz = x[n.S_T] * math.cos(k[THRUST_UP]), -x[n.S_T] * math.sin(k[THRUST_UP])
    fx = -drag * ca * cb + side * ca * sb + lift * sa + tx
    fy = -drag * sb - side * cb
    fz = -drag * sa * cb + side * sa * sb - lift * ca + tz
    mx = qs * par[n.P_B] * c_roll + k[RIGHT] * tz
    my = qs * par[n.P_C] * cm + k[BELOW] * tx + k[AFT] * tz
    mz = qs * par[n.P_B] * c_yaw - k[RIGHT] * tx + x[n.S_YAW]
    g = weight(x[n.S_P], -x[n.S_P + 2], par)
    p, q, r = x[n.S_W], x[n.S_W + 1], x[n.S_W + 2]
    udot = fx / mass + down[0] * g - (q * w - r * v)
    wdot = fz / mass + down[1] * g - (p * v - q * u)
    alphadot = (u * wdot - w * udot) / max(u * u + w * w, 1e-6)
    return fx, fy, fz, mx, my, mz, lift, drag, alphadot
