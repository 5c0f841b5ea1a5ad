"""Expected readings of three probes in the wake, with their Jacobian.

Frame F and the reading order (V of each probe, then beta, then alpha) as in wake_kernel.py. Source: sevil.md 3.2.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.missions.receiver.airdata.wake_kernel import (
    WK_NU,
    WK_TAIL_LIFT,
    WK_TAIL_SPACING,
    WK_TAIL_X,
    WK_WING_CORE,
    WK_WING_LIFT,
    WK_WING_SPACING,
    WK_WING_X,
    WK_WING_Y,
    WK_WING_Z,
    horseshoe,
)

# point `p` [10] at which readings are expected: position and velocity across the tanker's path [m, m/s], circulation
# factors of wing and tail [-], vortices below the model [m], uniform wind [m/s, F]
P_Y, P_Z, P_VY, P_VZ, P_KW, P_KT, P_H, P_W = 0, 1, 2, 3, 4, 5, 6, 7
# frame `g` [11]: x and its rate [m, m/s], psi, theta, phi of the own body relative to F [rad], own body rates [rad/s],
# tanker airspeed [m/s], density [kg/m^3], share of the height P_H that the tail's vortices take part in [-]
G_X, G_XDOT, G_E, G_OMEGA, G_V, G_RHO, G_SHARE = 0, 1, 2, 5, 8, 9, 10
G_SIZE = 11
ATTITUDE, RATES = slice(G_E, G_OMEGA), slice(G_OMEGA, G_V)
# columns of the Jacobian [9, 9] of the readings
J_X, J_Y, J_Z, J_KW, J_KT, J_H, J_W = 0, 1, 2, 3, 4, 5, 6
AX_X, AX_Y, AX_Z = 0, 1, 2  # axes of a vector
STEP_M = 1e-3  # [m] of the central differences: error (step / core)^2, rounding 1e-13 / step
M_READ = 9
# readings [9]: the first of each variable, V [m/s], beta, alpha [rad]; three probes each
R_V, R_BETA, R_ALPHA = 0, 3, 6
OF_V, OF_BETA, OF_ALPHA = slice(R_V, R_BETA), slice(R_BETA, R_ALPHA), slice(R_ALPHA, M_READ)
WING, TAIL = WK_WING_X, WK_TAIL_X  # where a surface begins in the wake vector


@jit
def surface_wind(
    x: float, y: float, z: float, wk: np.ndarray, at: int, gamma: float, V: float
) -> tuple[float, float, float]:
    """Wind [m/s, F] of one surface of the wake vector wk [13] (at = WING or TAIL) of circulation gamma [m^2/s]."""
    x, y, z = x - wk[at + WK_WING_X], y - wk[at + WK_WING_Y], z - wk[at + WK_WING_Z]
    return horseshoe(x, y, z, 0.5 * wk[at + WK_WING_SPACING], wk[at + WK_WING_CORE], gamma, wk[WK_NU], V)


@jit_own
def expected(
    p: np.ndarray, g: np.ndarray, probes: np.ndarray, wk: np.ndarray, jac: bool, h: np.ndarray, J: np.ndarray
) -> None:
    """h [9] <- expected readings (m/s, rad, rad) at the point p [10] in the frame g [11]; J [9,9] <- their Jacobian.

    probes [3,3] positions [m, body]; wk [13] wake vector (wake_kernel.py). With jac false J is left alone. Columns of J:
    x, y, z [per m], circulation factors of wing and tail [per 1], height [per m], wind x, y, z [per m/s]; velocity acts as
    the opposite wind. V = |u|, beta = asin(v/V), alpha = atan2(w, u), u = C (v_F - W(P_i) - w) + omega x rho_i
    (sevil.md 3.2). Derivatives of the field are central differences, the rest is exact. A height P_H moves the vortices
    down, the tail's by G_SHARE of it.
    """
    C = np.empty(9)
    d = np.empty((9, 3))
    dcm_from_euler(g[G_E], g[G_E + 1], g[G_E + 2], C)
    V, hw, ht = g[G_V], p[P_H], p[P_H] * g[G_SHARE]
    q = 1.0 / (g[G_RHO] * V)
    gw = q * wk[WK_WING_LIFT] / wk[WK_WING_SPACING]
    gt = q * wk[WK_TAIL_LIFT] / wk[WK_TAIL_SPACING]
    for i in range(3):
        bx, by, bz = probes[i, AX_X], probes[i, AX_Y], probes[i, AX_Z]
        px = g[G_X] + (C[0] * bx + C[3] * by + C[6] * bz)
        py = p[P_Y] + (C[1] * bx + C[4] * by + C[7] * bz)
        pz = p[P_Z] + (C[2] * bx + C[5] * by + C[8] * bz)
        a0, a1, a2 = surface_wind(px, py, pz - hw, wk, WING, gw, V)
        b0, b1, b2 = surface_wind(px, py, pz - ht, wk, TAIL, gt, V)
        kw, kt = p[P_KW], p[P_KT]
        fx = V + g[G_XDOT] - (kw * a0 + kt * b0) - p[P_W]
        fy = p[P_VY] - (kw * a1 + kt * b1) - p[P_W + 1]
        fz = p[P_VZ] - (kw * a2 + kt * b2) - p[P_W + 2]
        ux = C[0] * fx + C[1] * fy + C[2] * fz + (g[G_OMEGA + 1] * bz - g[G_OMEGA + 2] * by)
        uy = C[3] * fx + C[4] * fy + C[5] * fz + (g[G_OMEGA + 2] * bx - g[G_OMEGA] * bz)
        uz = C[6] * fx + C[7] * fy + C[8] * fz + (g[G_OMEGA] * by - g[G_OMEGA + 1] * bx)
        s2 = max(ux * ux + uz * uz, 1e-12)
        s = math.sqrt(s2)
        V2 = s2 + uy * uy
        Va = math.sqrt(V2)
        h[R_V + i] = Va
        h[R_BETA + i] = math.atan2(uy, s)
        h[R_ALPHA + i] = math.atan2(uz, ux)
        if not jac:
            continue
        # d: wind changed by each column, minus its sign in u
        for c in range(3):
            dx = STEP_M if c == 0 else 0.0
            dy = STEP_M if c == 1 else 0.0
            dz = STEP_M if c == 2 else 0.0
            m0, m1, m2 = surface_wind(px + dx, py + dy, pz + dz - hw, wk, WING, gw, V)
            n0, n1, n2 = surface_wind(px - dx, py - dy, pz - dz - hw, wk, WING, gw, V)
            r0, r1, r2 = surface_wind(px + dx, py + dy, pz + dz - ht, wk, TAIL, gt, V)
            s0, s1, t2 = surface_wind(px - dx, py - dy, pz - dz - ht, wk, TAIL, gt, V)
            f = 0.5 / STEP_M
            m0, m1, m2 = f * kw * (m0 - n0), f * kw * (m1 - n1), f * kw * (m2 - n2)
            r0, r1, r2 = f * kt * (r0 - s0), f * kt * (r1 - s1), f * kt * (r2 - t2)
            d[c, AX_X], d[c, AX_Y], d[c, AX_Z] = m0 + r0, m1 + r1, m2 + r2
            if c == 2:
                share = g[G_SHARE]
                d[J_H, AX_X], d[J_H, AX_Y], d[J_H, AX_Z] = -m0 - share * r0, -m1 - share * r1, -m2 - share * r2
        d[J_KW, AX_X], d[J_KW, AX_Y], d[J_KW, AX_Z] = a0, a1, a2
        d[J_KT, AX_X], d[J_KT, AX_Y], d[J_KT, AX_Z] = b0, b1, b2
        for c in range(3):
            for k in range(3):
                d[J_W + c, k] = 1.0 if c == k else 0.0
        for c in range(9):
            dx, dy, dz = d[c, AX_X], d[c, AX_Y], d[c, AX_Z]
            e0 = -(C[0] * dx + C[1] * dy + C[2] * dz)
            e1 = -(C[3] * dx + C[4] * dy + C[5] * dz)
            e2 = -(C[6] * dx + C[7] * dy + C[8] * dz)
            J[R_V + i, c] = (ux * e0 + uy * e1 + uz * e2) / Va
            J[R_BETA + i, c] = (s2 * e1 - uy * (ux * e0 + uz * e2)) / (V2 * s)
            J[R_ALPHA + i, c] = (ux * e2 - uz * e0) / s2
