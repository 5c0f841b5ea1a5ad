"""Equations of motion in wind axes, written from lee.md sections 2 and 3 alone: the yardstick of the body-axis
programs.

Plain numpy, one aircraft at a time, no speed in mind. Frames: I = north-east-down, B = body. Air-relative velocity
u_a = R_BW [V, 0, 0]; aerodynamic force in wind axes [-D, -S, -L] with S positive to the left. Moments are built up in
stability axes (aircraft-data.md, table heads) and turned to body axes by alpha.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft

G = np.array([0.0, 0.0, 9.80665])  # [m/s^2] NED

Array = np.ndarray


def skew_s(w: Array) -> Array:
    """S(w) = -[w x] (lee.md section 2)."""
    p, q, r = w
    return np.array([[0.0, r, -q], [-r, 0.0, p], [q, -p, 0.0]])


def r_bw(beta: float, alpha: float) -> Array:
    """Wind to body axes."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array([[ca * cb, -ca * sb, -sa], [sb, cb, 0.0], [sa * cb, -sa * sb, ca]])


def r_bi(psi: float, theta: float, phi: float) -> Array:
    """Inertial to body components, R1(phi) R2(theta) R3(psi), from the three elementary rotations."""
    c, s = math.cos, math.sin
    r3 = np.array([[c(psi), s(psi), 0], [-s(psi), c(psi), 0], [0, 0, 1]])
    r2 = np.array([[c(theta), 0, -s(theta)], [0, 1, 0], [s(theta), 0, c(theta)]])
    r1 = np.array([[1, 0, 0], [0, c(phi), s(phi)], [0, -s(phi), c(phi)]])
    return r1 @ r2 @ r3


def eps(V: float, beta: float, alpha: float) -> Array:
    """d(u_a)/d(V, beta, alpha): columns by differentiation of R_BW [V, 0, 0]."""
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    return np.array([[ca * cb, -V * ca * sb, -V * sa * cb], [sb, V * cb, 0.0], [sa * cb, -V * sa * sb, V * ca * cb]])


def euler_rates(w: Array, theta: float, phi: float) -> Array:
    """(psi, theta, phi) rates from body rates: solved from w = f(rates) rather than from the closed form."""
    m = np.array(
        [
            [-math.sin(theta), 0.0, 1.0],
            [math.sin(phi) * math.cos(theta), math.cos(phi), 0.0],
            [math.cos(phi) * math.cos(theta), -math.sin(phi), 0.0],
        ]
    )
    return np.linalg.solve(m, w)


def density(h: float) -> float:
    """US Standard Atmosphere 1976 below 11 km [kg/m^3], constants of aircraft-data.md section 8."""
    t = 288.15 - 0.0065 * h
    return 101325.0 * (t / 288.15) ** (9.80665 / (0.0065 * 287.053)) / (287.053 * t)


@dataclass(frozen=True)
class Body:
    """Mass, inertia matrix (Ixz as +integral of x z dm, so -Ixz off the diagonal) and the aircraft's data."""

    ac: Aircraft
    m: float
    I: Array  # noqa: E741 - the letter of the source


def body(ac: Aircraft, mass_kg: float) -> Body:
    """Mass properties interpolated linearly in mass."""
    t = ac.inertia
    ix, iy, iz, ixz = (
        float(np.interp(mass_kg, t.mass_kg, c)) for c in (t.Ixx_kgm2, t.Iyy_kgm2, t.Izz_kgm2, t.Ixz_kgm2)
    )
    return Body(ac, mass_kg, np.array([[ix, 0, -ixz], [0, iy, 0], [-ixz, 0, iz]]))


def aero(b: Body, va: Array, w_rel: Array, u: Array, rho: float, alphadot: float) -> tuple[Array, Array]:
    """Aerodynamic force [N] in wind axes ([-D, -S, -L]) and moment [N m] in body axes.

    va = (V, beta, alpha), w_rel rates relative to the air, u = (aileron, elevator, rudder, thrust).
    """
    V, beta, alpha = va
    a, g = b.ac.aero, b.ac.geometry
    da, de, dr = u[:3]
    ca, sa = math.cos(alpha), math.sin(alpha)
    to_stability = np.array([[ca, 0, sa], [0, 1, 0], [-sa, 0, ca]])
    p, q, r = to_stability @ w_rel
    ph, qh, rh, adh = p * g.b_m / (2 * V), q * g.c_m / (2 * V), r * g.b_m / (2 * V), alphadot * g.c_m / (2 * V)
    static = a.CL0 + a.CL_alpha * alpha + a.CL_de * de
    CL = static + a.CL_q * qh + a.CL_alphadot * adh
    CD = a.CD0 + a.K * static**2
    CS = -(a.CY_beta * beta + a.CY_p * ph + a.CY_r * rh + a.CY_dr * dr)
    Cl = a.Cl_beta * beta + a.Cl_p * ph + a.Cl_r * rh + a.Cl_da * da + a.Cl_dr * dr
    Cm = a.Cm0 + a.Cm_alpha * alpha + a.Cm_q * qh + a.Cm_alphadot * adh + a.Cm_de * de
    Cn = a.Cn_beta * beta + a.Cn_p * ph + a.Cn_r * rh + a.Cn_da * da + a.Cn_dr * dr
    qs = 0.5 * rho * V * V * g.S_m2
    force = -qs * np.array([CD, CS, CL])
    moment = qs * to_stability.T @ np.array([g.b_m * Cl, g.c_m * Cm, g.b_m * Cn])
    return force, moment


def air_rates(
    b: Body, va: Array, w: Array, w_eff: Array, u: Array, rho: float, g_b: Array, wdot_b: Array
) -> tuple[Array, Array]:
    """(Vdot, betadot, alphadot) and body angular acceleration; lee.md 3.1, first two lines.

    g_b gravity and wdot_b = R_BI Wdot_I in body axes. The aerodynamic alpha-dot terms see the aircraft's own motion
    (the value without the wind's acceleration), as the aircraft data were measured in still air; they are linear in
    it.
    """
    V, beta, alpha = va
    rbw, inv = r_bw(beta, alpha), np.linalg.inv(eps(V, beta, alpha))
    thrust = np.array([u[3], 0.0, 0.0])
    still = skew_s(w) @ rbw @ [V, 0.0, 0.0] + g_b

    def motion(ad: float) -> Array:
        force, _ = aero(b, va, w - w_eff, u, rho, ad)
        return inv @ (still + (rbw @ force + thrust) / b.m)

    a0, a1 = motion(0.0)[2], motion(1.0)[2]
    ad = a0 / (1.0 - (a1 - a0))
    force, moment = aero(b, va, w - w_eff, u, rho, ad)
    rates = inv @ (still + (rbw @ force + thrust) / b.m - wdot_b)
    return rates, np.linalg.solve(b.I, moment + skew_s(w) @ b.I @ w)


def single(b: Body, x: Array, u: Array, wind: Array, wind_dot: Array, w_eff: Array) -> Array:
    """Rates [12] of V, beta, alpha, p, q, r, psi, theta, phi, x, y, z (lee.md 3.1)."""
    R = r_bi(*x[6:9])
    va, w = x[0:3], x[3:6]
    out = np.zeros(12)
    out[0:3], out[3:6] = air_rates(b, va, w, w_eff, u, density(-x[11]), R @ G, R @ wind_dot)
    out[6:9] = euler_rates(w, x[7], x[8])
    out[9:12] = R.T @ r_bw(x[1], x[2]) @ [x[0], 0.0, 0.0] + wind
    return out


def relative(
    b: Body,
    x: Array,
    u: Array,
    rho: float,
    wind: Array,
    wind_dot: Array,
    r_bti: Array,
    w_t: Array,
    w_t_dot: Array,
    v_t: Array,
) -> Array:
    """Rates [12] of V, beta, alpha, w_rel, psi, theta, phi (B_T -> B_R), xi (lee.md 3.2, W_I form).

    Tanker: r_bti inertial to its body axes, w_t and w_t_dot its rates (own axes), v_t its inertial velocity (NED).
    """
    R = r_bi(*x[6:9])
    w_r = x[3:6] + R @ w_t
    R_bri = R @ r_bti
    out = np.zeros(12)
    air, w_r_dot = air_rates(b, x[0:3], w_r, np.zeros(3), u, rho, R_bri @ G, R_bri @ wind_dot)
    out[0:3] = air
    out[3:6] = w_r_dot - skew_s(x[3:6]) @ R @ w_t - R @ w_t_dot
    out[6:9] = euler_rates(x[3:6], x[7], x[8])
    out[9:12] = R.T @ r_bw(x[1], x[2]) @ [x[0], 0.0, 0.0] + r_bti @ (wind - v_t) + skew_s(w_t) @ x[9:12]
    return out
