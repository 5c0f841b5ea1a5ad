"""Wake of a tanker as the onboard software believes it: two horseshoe vortices, and what air-data probes read in it.

Frame F: origin at the tanker's centre of gravity, x along its air velocity, y right, z down [m]. Source: sevil.md
sections 3 and 3.2 (Sevil 2013, equations 2.35-2.36, with the direction of the induced velocity added).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_euler

# layout of the wake vector `wk`: per surface, position of the bound vortex in F [m], vortex spacing [m], core radius
# [m] and lift [N] (tail negative: download); then the eddy viscosity [m^2/s]
WK_WING_X, WK_WING_Y, WK_WING_Z, WK_WING_SPACING, WK_WING_CORE, WK_WING_LIFT = range(6)
WK_TAIL_X, WK_TAIL_Y, WK_TAIL_Z, WK_TAIL_SPACING, WK_TAIL_CORE, WK_TAIL_LIFT = range(6, 12)
WK_NU = 12
WK_SIZE = 13


@jit
def horseshoe(
    x: float, y: float, z: float, y0: float, core: float, gamma: float, nu: float, V: float
) -> tuple[float, float, float]:
    """Velocity [m/s] at offset (x, y, z) [m] from the middle of the bound segment of one horseshoe vortex.

    Bound segment (0, -y0, 0) -> (0, y0, 0), trailing filaments to x = -infinity; circulation gamma [m^2/s] runs in
    along the left filament, left to right on the bound segment and out along the right one. Each straight filament gives
    gamma (cos g1 + cos g2) / 2 / (2 pi (h^2 + core^2)) t x h; the trailing ones are multiplied by
    1 - exp(-h^2 / (4 nu tau)), tau = max(0, -x) / V the age of the air there, 1 when tau = 0 (sevil.md section 3).
    The bound segment does not age: at any distance behind it of more than a core its factor is 1 to the last bit.
    On a filament itself, without a core, the result is zero. Returns (u, v, w) in F.
    """
    u = v = w = 0.0
    c2 = core * core
    k = gamma / (4.0 * math.pi)
    age = 4.0 * nu * -x / V if x < 0.0 else 0.0  # 4 nu tau [m^2]
    for side in range(2):
        hy = y + y0 if side == 0 else y - y0
        r2 = hy * hy + z * z
        if r2 + c2 <= 0.0:
            continue
        r = math.sqrt(r2 + x * x)
        f = k / (r2 + c2)
        if r > 0.0:
            f *= 1.0 - x / r
        if r2 < 40.0 * age:  # beyond, the bracket is 1 in double precision
            f *= 1.0 - math.exp(-r2 / age)
        if side == 0:
            f = -f  # inwards: t = +x on the left, -x on the right
        v += f * z
        w -= f * hy
    r2 = x * x + z * z
    if r2 > 0.0:
        left, right = y0 + y, y0 - y
        f = k / (r2 + c2) * (left / math.sqrt(r2 + left * left) + right / math.sqrt(r2 + right * right))
        u += f * z
        w -= f * x
    return u, v, w


@jit
def wake_wind(
    x: float, y: float, z: float, wk: np.ndarray, kw: float, kt: float, V: float, rho: float, out: np.ndarray
) -> None:
    """out [3] <- wind [m/s, F] induced by the tanker's wake at the point (x, y, z) [m, F]; positive z is downwash.

    wk [13] wake vector (WK_*); kw, kt [-] multiply the circulation of wing and tail; V [m/s] tanker airspeed, rho
    [kg/m^3]. Circulation = lift / (rho V spacing), filaments at +- spacing / 2 (sevil.md section 3).
    """
    q = 1.0 / (rho * V)
    gw = kw * q * wk[WK_WING_LIFT] / wk[WK_WING_SPACING]
    gt = kt * q * wk[WK_TAIL_LIFT] / wk[WK_TAIL_SPACING]
    u, v, w = horseshoe(
        x - wk[WK_WING_X],
        y - wk[WK_WING_Y],
        z - wk[WK_WING_Z],
        0.5 * wk[WK_WING_SPACING],
        wk[WK_WING_CORE],
        gw,
        wk[WK_NU],
        V,
    )
    ut, vt, wt = horseshoe(
        x - wk[WK_TAIL_X],
        y - wk[WK_TAIL_Y],
        z - wk[WK_TAIL_Z],
        0.5 * wk[WK_TAIL_SPACING],
        wk[WK_TAIL_CORE],
        gt,
        wk[WK_NU],
        V,
    )
    out[0] = u + ut
    out[1] = v + vt
    out[2] = w + wt


@jit_own
def probe_readings(
    xi: np.ndarray,
    e: np.ndarray,
    xi_dot: np.ndarray,
    V_T: float,
    rho: float,
    w: np.ndarray,
    omega: np.ndarray,
    probes: np.ndarray,
    wk: np.ndarray,
    kw: float,
    kt: float,
    out: np.ndarray,
) -> None:
    """out [3k] <- what k air-data probes read in the wake: V1..k [m/s], beta1..k [rad], alpha1..k [rad].

    xi [3] own reference point [m, F], xi_dot [3] its rate [m/s, F]; e [3] = (psi, theta, phi) of the own body
    relative to F [rad]; V_T [m/s] tanker airspeed, rho [kg/m^3]; w [3] uniform extra wind [m/s, F]; omega [3] own body
    rate relative to inertial space [rad/s, body]; probes [k, 3] probe positions [m, body]; wk, kw, kt as in
    `wake_wind`.

        P_i = xi + C^T rho_i,  u_i = C (v_F - W(P_i) - w) + omega x rho_i,  v_F = (V_T, 0, 0) + xi_dot
        V = |u|,  beta = asin(v / V),  alpha = atan2(w, u)                       (sevil.md section 3.2)
    """
    n = probes.shape[0]
    C = np.empty(9)
    W = np.empty(3)
    dcm_from_euler(e[0], e[1], e[2], C)
    for i in range(n):
        bx, by, bz = probes[i, 0], probes[i, 1], probes[i, 2]
        wake_wind(
            xi[0] + (C[0] * bx + C[3] * by + C[6] * bz),
            xi[1] + (C[1] * bx + C[4] * by + C[7] * bz),
            xi[2] + (C[2] * bx + C[5] * by + C[8] * bz),
            wk,
            kw,
            kt,
            V_T,
            rho,
            W,
        )
        fx = V_T + xi_dot[0] - W[0] - w[0]
        fy = xi_dot[1] - W[1] - w[1]
        fz = xi_dot[2] - W[2] - w[2]
        ux = C[0] * fx + C[1] * fy + C[2] * fz + (omega[1] * bz - omega[2] * by)
        uy = C[3] * fx + C[4] * fy + C[5] * fz + (omega[2] * bx - omega[0] * bz)
        uz = C[6] * fx + C[7] * fy + C[8] * fz + (omega[0] * by - omega[1] * bx)
        V = math.sqrt(ux * ux + uy * uy + uz * uz)
        out[i] = V
        out[n + i] = math.asin(max(-1.0, min(1.0, uy / V))) if V > 0.0 else 0.0
        out[2 * n + i] = math.atan2(uz, ux)
