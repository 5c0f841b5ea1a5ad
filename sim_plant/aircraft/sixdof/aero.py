"""Aerodynamic and thrust force and moment of one aircraft in still or moving air."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.series import series_loads
from sim_plant.aircraft.sixdof.wing import beyond, slope_factor, wave_drag
from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.kernels.earth import air_height, flow_turned, weight
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
    body x, P_BELOW under the cg; S_YAW is the moment of its being unequal. Beyond the straight part of the lift curve,
    and off the reference Mach number: wing.py; a stalled wing damps roll by the slope it has left. With a series in the
    place of derivatives: series.py. alphadot is that of a
    steady wind (no wind derivative), over a round earth with what turns there (earth.md 7); as it enters CL linearly,
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

    _, _, rho, a = air(air_height(-x[n.S_P + 2], par), par)
    qs = 0.5 * rho * v_air * v_air * par[n.P_S]
    hb, hc = 0.5 * par[n.P_B] / v_air, 0.5 * par[n.P_C] / v_air
    pr, qr, rr = p - w[3], q - w[4], r - w[5]
    if par[n.P_SERIES] > 0.0:
        fx, fy, fz, mx, my, mz, lift, drag, alphadot = series_loads(
            x, (da, de, dr), mass, par, (ub, vb, wb, v_air, alpha, beta), (pr, qr, rr), (c20, c22), qs
        )
        return fx, fy, fz, mx, my, mz, v_air, beta, alpha, lift, drag, alphadot, rho, a
    ps, rs = pr * ca + rr * sa, rr * ca - pr * sa

    damp = fm = 1.0
    if par[n.P_MACH] > 0.0:
        fm = slope_factor(v_air / a, par)
    if par[n.P_ROUND_OFF] > 0.0 and not par[n.P_STRAIGHT_LO] <= alpha <= par[n.P_STRAIGHT_HI]:
        tail = par[n.CL_DE] * de
        wing, cd, damp = beyond(alpha, tail, par)
        cl_static = fm * (wing + tail)
    else:
        cl_static = fm * (par[n.CL0] + par[n.CL_ALPHA] * alpha + par[n.CL_DE] * de)
        cd = par[n.CD0] + par[n.K_POLAR] * cl_static * cl_static
    if par[n.P_MACH] > 0.0:
        cd += wave_drag(v_air / a, cl_static, par)
    cl_alphadot = fm * par[n.CL_ALPHADOT]
    cl = cl_static + fm * par[n.CL_Q] * hc * qr
    cy = fm * (par[n.CY_BETA] * beta + hb * (par[n.CY_P] * ps + par[n.CY_R] * rs) + par[n.CY_DR] * dr)
    # alphadot: first with the lift known so far, then corrected for its own lift
    drag, side, lift = qs * cd, qs * cy, qs * cl
    fx = -drag * ca * cb - side * ca * sb + lift * sa + x[n.S_T]
    fz = -drag * sa * cb - side * sa * sb - lift * ca
    g = weight(x[n.S_P], -x[n.S_P + 2], par)
    udot = fx / mass + c20 * g - (q * wb - r * vb)
    wdot = fz / mass + c22 * g - (p * vb - q * ub)
    if par[n.P_ROUND] > 0.0:
        tn, te, td = flow_turned(x, w[0], w[1], w[2], par)
        udot -= c00 * tn + c10 * te + c20 * td
        wdot -= c02 * tn + c12 * te + c22 * td
    alphadot = (ub * wdot - wb * udot) / uw2 / (1.0 + qs * cl_alphadot * hc / (mass * v_air * cb))
    extra = qs * cl_alphadot * hc * alphadot
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
        + hb * (damp * par[n.CL_ROLL_P] * ps + par[n.CL_ROLL_R] * rs)
        + par[n.CL_ROLL_DA] * da
        + par[n.CL_ROLL_DR] * dr
    )
    c_yaw = par[n.CN_BETA] * beta + hb * (par[n.CN_P] * ps + par[n.CN_R] * rs) + par[n.CN_DA] * da + par[n.CN_DR] * dr
    mx = fm * qs * par[n.P_B] * (c_roll * ca - c_yaw * sa)
    mz = fm * qs * par[n.P_B] * (c_roll * sa + c_yaw * ca)
    my = fm * qs * par[n.P_C] * cm
    if x[n.S_YAW] != 0.0:
        mz += x[n.S_YAW]
    if par[n.P_BELOW] != 0.0:
        my += par[n.P_BELOW] * x[n.S_T]
    if par[n.P_FUEL_X] != 0.0:
        ahead = (mass - par[n.P_EMPTY] - par[n.P_FUEL_REF]) * par[n.P_FUEL_X] / mass
        my += ahead * fz
        mz -= ahead * fy
    return fx, fy, fz, mx, my, mz, v_air, beta, alpha, lift, drag, alphadot, rho, a
