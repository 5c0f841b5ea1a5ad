"""Forces and moments on a rigid aircraft as compiled kernels: aerodynamic build-up in stability axes, and what they accelerate.

Sines and cosines of the flow angles come as arguments, cb, sb of beta and ca, sa of alpha: whoever asks for the rates of a state
needs them several times, and they take most of the time. Lee 2011, equations (2.2)-(2.15), signs and errata as re-derived.
Controls u (4): aileron, elevator, rudder [rad], thrust [N]. Parameters P: flightsw.sixdof.params.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.sixdof import params as pv
from flightsw.sixdof.layout import X_ALPHA, X_BETA, X_P, X_Q, X_R, X_V


@jit
def force_moment(
    V: float, beta: float, alpha: float, p: float, q: float, r: float, u: np.ndarray, rho: float, P: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """As `loads`, where the sines and cosines are not at hand."""
    cb, sb, ca, sa = math.cos(beta), math.sin(beta), math.cos(alpha), math.sin(alpha)
    loads(V, beta, alpha, cb, sb, ca, sa, p, q, r, u, rho, P, out)


@jit
def loads(
    V: float, beta: float, alpha: float, cb: float, sb: float, ca: float, sa: float, p: float, q: float, r: float,
    u: np.ndarray, rho: float, P: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Specific force and moment in body axes, and their sensitivity to alpha-dot.

    V [m/s], beta, alpha [rad], p, q, r [rad/s] relative to the air, u [4], rho [kg/m^3]. out [9] <- specific force
    without gravity fx, fy, fz [m/s^2]; moments L, M, N [N m] at alpha-dot = 0; d(fx), d(fz), d(M) per rad/s of alpha-dot.
    Moments: stability-axis derivatives rotated by alpha (Stevens and Lewis, section 2.3).
    """
    qS = 0.5 * rho * V * V * P[pv.S]
    hb = 0.5 * P[pv.B] / V
    hc = 0.5 * P[pv.C] / V
    da, de, dr, T = u[0], u[1], u[2], u[3]
    ps = p * ca + r * sa
    rs = r * ca - p * sa
    CLs = P[pv.CL0] + P[pv.CLA] * alpha + P[pv.CLDE] * de
    CL = CLs + P[pv.CLQ] * hc * q
    CD = P[pv.CD0] + P[pv.KI] * CLs * CLs
    CY = P[pv.CYB] * beta + hb * (P[pv.CYP] * ps + P[pv.CYR] * rs) + P[pv.CYDR] * dr
    Cl = P[pv.CLB] * beta + hb * (P[pv.CLP] * ps + P[pv.CLR] * rs) + P[pv.CLDA] * da + P[pv.CLDR] * dr
    Cm = P[pv.CM0] + P[pv.CMA] * alpha + P[pv.CMQ] * hc * q + P[pv.CMDE] * de
    Cn = P[pv.CNB] * beta + hb * (P[pv.CNP] * ps + P[pv.CNR] * rs) + P[pv.CNDA] * da + P[pv.CNDR] * dr
    # wind axes to body axes: [-D, Y, -L] through R_BW (Lee 2.11; his S is -Y)
    k = qS / P[pv.M]
    axial = CD * cb + CY * sb
    out[0] = k * (CL * sa - axial * ca) + T / P[pv.M]
    out[1] = k * (CY * cb - CD * sb)
    out[2] = -k * (CL * ca + axial * sa)
    out[3] = qS * P[pv.B] * (Cl * ca - Cn * sa)
    out[4] = qS * P[pv.C] * Cm
    out[5] = qS * P[pv.B] * (Cl * sa + Cn * ca)
    kad = k * P[pv.CLAD] * hc
    out[6] = kad * sa
    out[7] = -kad * ca
    out[8] = qS * P[pv.C] * P[pv.CMAD] * hc


@jit
def spin(L: float, M: float, N: float, p: float, q: float, r: float, P: np.ndarray) -> tuple[float, float, float]:
    """p', q', r' [rad/s^2] by Euler's equation with Ixz from moments L, M, N [N m] at inertial rates p, q, r [rad/s]."""
    Ix, Iy, Iz, Ixz = P[pv.IX], P[pv.IY], P[pv.IZ], P[pv.IXZ]
    hx = Ix * p - Ixz * r
    hz = Iz * r - Ixz * p
    mx = L - (q * hz - r * Iy * q)
    my = M - (r * hx - p * hz)
    mz = N - (p * Iy * q - q * hx)
    D = Ix * Iz - Ixz * Ixz
    return (Iz * mx + Ixz * mz) / D, my / Iy, (Ixz * mx + Ix * mz) / D


@jit
def moment_rates(
    V: float, beta: float, alpha: float, w: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, fm: np.ndarray,
) -> tuple[float, float, float]:  # fmt: skip
    """Angular acceleration p', q', r' rad/s^2 at body rates w [3] rad/s: Euler's equation with Ixz, the moments of force_moment
    without their alpha-dot part. Other arguments as there; fm [9] work space."""
    force_moment(V, beta, alpha, w[0], w[1], w[2], u, rho, P, fm)
    return spin(fm[3], fm[4], fm[5], w[0], w[1], w[2], P)


@jit
def rigid(
    V: float, cb: float, sb: float, ca: float, sa: float, p: float, q: float, r: float, fm: np.ndarray,
    gx: float, gy: float, gz: float, P: np.ndarray, d: np.ndarray,
) -> None:  # fmt: skip
    """d [6] <- V_dot, beta_dot, alpha_dot, p_dot, q_dot, r_dot (inertial rates p, q, r) from fm [9] and gravity in body axes.

    eps^-1 of Lee (2.2) and Euler's equation with Ixz; fm[0], fm[2], fm[4] are completed with the alpha-dot terms, so that
    fm[0:3] is the total specific force afterwards. The wind acceleration is taken as zero (a random walk has none).
    """
    uu, vv, ww = V * ca * cb, V * sb, V * sa * cb
    ax = fm[0] + gx + r * vv - q * ww
    ay = fm[1] + gy + p * ww - r * uu
    az = fm[2] + gz + q * uu - p * vv
    den = V * cb
    ad = (az * ca - ax * sa) / den
    # alpha_dot appears on both sides through CL_alphadot: linear, solved exactly
    ad = ad / (1.0 - (fm[7] * ca - fm[6] * sa) / den)
    ax += fm[6] * ad
    az += fm[7] * ad
    fm[0] += fm[6] * ad
    fm[2] += fm[7] * ad
    fm[4] += fm[8] * ad
    Vd = ax * ca * cb + ay * sb + az * sa * cb
    d[X_V] = Vd
    d[X_BETA] = (ay - Vd * sb) / den
    d[X_ALPHA] = ad
    d[X_P], d[X_Q], d[X_R] = spin(fm[3], fm[4], fm[5], p, q, r, P)
