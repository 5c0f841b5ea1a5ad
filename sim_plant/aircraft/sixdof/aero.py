"""Aerodynamic and thrust force and moment of one aircraft in still or moving air."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.earth import air_height, weight
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm

Load = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # F (3), M (3), V, beta, alpha, lift, drag, alphadot, rho, speed of sound


@jit
def loads(
    x: NDArray[np.float64],
    da: float,
    de: float,
    dr: float,
    w: NDArray[np.float64],
    mass: float,
    par: NDArray[np.float64],
) -> Load:
    """Force (no gravity) [N] and moment about the cg [N m] in body axes, and the flow that causes them.

    `x` rigid-body state, da, de, dr surface angles [rad], `w` effective wind (layout.py), mass [kg].
    Returns Fx, Fy, Fz, Mx, My, Mz, V [m/s], beta, alpha [rad], lift, drag [N], alphadot [rad/s], rho [kg/m^3], a [m/s].

    Coefficients: CL, CD along wind axes z and x, CY along wind y (positive right); CD = CD0 + K CLs^2 with the
    static lift CLs = CL0 + CLa alpha + CLde de. Cl, Cm, Cn are in stability axes with stability-axis rates and are
    turned to body by the momentary alpha. Rates are relative to the rotating air, w_b - w_eff. Thrust acts along
    body x through the cg. alphadot uses the inertial acceleration (no wind derivative); as it enters CL linearly,
    alphadot = alphadot_0 / (1 + qS CL_alphadot c / (2 V^2 m cos beta)).
    Source: derivative build-up as in Roskam, Airplane Flight Dynamics, with the sign table of the aircraft files.
    """
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(x[0], x[1], x[2], x[3])
    p, q, r = x[n.S_W], x[n.S_W + 1], x[n.S_W + 2]
    an, ae, ad = x[n.S_V] - w[0], x[n.S_V + 1] - w[1], x[n.S_V + 2] - w[2]
    ub = c00 * an + c10 * ae + c20 * ad
    vb = c01 * an + c11 * ae + c21 * ad
    wb = c02 * an + c12 * ae + c22 * ad
    uw2 = max(ub * ub + wb * wb, 1e-6)
    v_air = math.sqrt(uw2 + vb * vb)
    alpha = math.atan2(wb, ub)
    sb = vb / v_air
    beta = math.asin(sb)
    cb = math.sqrt(uw2) / v_air
    ca, sa = ub / math.sqrt(uw2), wb / math.sqrt(uw2)

    _, _, rho, a = isa(air_height(-x[n.S_P + 2], par))
    qs = 0.5 * rho * v_air * v_air * par[n.P_S]
    hb, hc = 0.5 * par[n.P_B] / v_air, 0.5 * par[n.P_C] / v_air
    pr, qr, rr = p - w[3], q - w[4], r - w[5]
    ps, rs = pr * ca + rr * sa, rr * ca - pr * sa

    cl_static = par[n.CL0] + par[n.CL_ALPHA] * alpha + par[n.CL_DE] * de
    cd = par[n.CD0] + par[n.K_POLAR] * cl_static * cl_static
    cl = cl_static + par[n.CL_Q] * hc * qr
    cy = par[n.CY_BETA] * beta + hb * (par[n.CY_P] * ps + par[n.CY_R] * rs) + par[n.CY_DR] * dr
    # alphadot: first with the lift known so far, then corrected for its own lift
    drag, side, lift = qs * cd, qs * cy, qs * cl
    fx = -drag * ca * cb - side * ca * sb + lift * sa + x[n.S_T]
    fz = -drag * sa * cb - side * sa * sb - lift * ca
    g = weight(x[n.S_P], -x[n.S_P + 2], par)
    udot = fx / mass + c20 * g - (q * wb - r * vb)
    wdot = fz / mass + c22 * g - (p * vb - q * ub)
    alphadot = (ub * wdot - wb * udot) / uw2 / (1.0 + qs * par[n.CL_ALPHADOT] * hc / (mass * v_air * cb))
    extra = qs * par[n.CL_ALPHADOT] * hc * alphadot
    lift += extra
    fx += extra * sa
    fz -= extra * ca
    fy = -drag * sb + side * cb

    cm = (
        par[n.CM0]
        + par[n.CM_ALPHA] * alpha
        + hc * (par[n.CM_Q] * qr + par[n.CM_ALPHADOT] * alphadot)
        + par[n.CM_DE] * de
    )
    c_roll = (
        par[n.CL_ROLL_BETA] * beta
        + hb * (par[n.CL_ROLL_P] * ps + par[n.CL_ROLL_R] * rs)
        + par[n.CL_ROLL_DA] * da
        + par[n.CL_ROLL_DR] * dr
    )
    c_yaw = par[n.CN_BETA] * beta + hb * (par[n.CN_P] * ps + par[n.CN_R] * rs) + par[n.CN_DA] * da + par[n.CN_DR] * dr
    mx = qs * par[n.P_B] * (c_roll * ca - c_yaw * sa)
    mz = qs * par[n.P_B] * (c_roll * sa + c_yaw * ca)
    my = qs * par[n.P_C] * cm
    return fx, fy, fz, mx, my, mz, v_air, beta, alpha, lift, drag, alphadot, rho, a
