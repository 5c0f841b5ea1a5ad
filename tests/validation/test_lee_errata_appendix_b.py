"""Lee 2011 appendix B, scalar receiver equations: errata E5, E9, E10, E11 of lee.md section 4.

Written as printed (where the scan can be read) and set against the matrix equations of `wind_axis.py` (lee.md 3.2) and
against two plant aircraft by differencing (`pairs` of test_lee_errata_receiver). R_ij is R_BRBT of (B.10).
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tests.validation import wind_axis as wa
from tests.validation.test_equations_of_motion import SCALE
from tests.validation.test_lee_errata_receiver import M_R, Pair, pairs

G = 9.80665
Array = np.ndarray


@pytest.fixture(scope="module")
def cases() -> list[Pair]:
    """Random formations shared by the tests of this file."""
    return pairs(60, 11)


def b10(ps: float, th: float, ph: float) -> Array:
    """R_BRBT of (B.10)."""
    c, s = math.cos, math.sin
    return np.array(
        [
            [c(th) * c(ps), c(th) * s(ps), -s(th)],
            [-c(ph) * s(ps) + s(ph) * s(th) * c(ps), c(ph) * c(ps) + s(ph) * s(th) * s(ps), s(ph) * c(th)],
            [s(ph) * s(ps) + c(ph) * s(th) * c(ps), -s(ph) * c(ps) + c(ph) * s(th) * s(ps), c(ph) * c(th)],
        ]
    )


def gravity(c: Pair, R: Array) -> Array:
    """The bracket -sin theta_T R_i1 + sin phi_T cos theta_T R_i2 + cos phi_T cos theta_T R_i3, i = 1..3."""
    _, th, ph = c.euler_t
    return np.array(
        [-math.sin(th) * r[0] + math.sin(ph) * math.cos(th) * r[1] + math.cos(ph) * math.cos(th) * r[2] for r in R]
    )


def b1_b3(c: Pair) -> Array:
    """(Vdot, betadot, alphadot) of (B.1)-(B.3), wind and its component rates in receiver body axes."""
    V, be, al = c.x[0:3]
    R = b10(*c.x[6:9])
    T1, T2, T3 = R @ c.w_t
    P, Q, Rr = c.x[3] + T1, c.x[4] + T2, c.x[5] + T3
    g1, g2, g3 = gravity(c, R)
    D, S, L = -c.A
    Tx, Ty, Tz = c.P
    wx, wy, wz = c.wb
    dx, dy, dz = c.wb_dot
    ca, sa, cb, sb, sec = math.cos(al), math.sin(al), math.cos(be), math.sin(be), 1 / math.cos(be)
    m = M_R
    vd = G * (ca * cb * g1 + sb * g2 + cb * sa * g3) + (-D + Tx * ca * cb + Ty * sb + Tz * cb * sa) / m
    vd += P * (wz * sb - wy * cb * sa) + Q * (-wz * ca * cb + wx * cb * sa) + Rr * (wy * ca * cb - wx * sb)
    vd -= dx * ca * cb + dy * sb + dz * cb * sa
    bd = P * sa - Rr * ca + G / V * (-ca * sb * g1 + cb * g2 - sa * sb * g3)
    bd -= (S + Tx * ca * sb - Ty * cb + Tz * sa * sb) / (m * V)
    bd += (P * (wz * cb + wy * sa * sb) + Q * (wz * ca * sb - wx * sa * sb) + Rr * (-wy * ca * sb - wx * cb)) / V
    bd -= (-dx * ca * sb + dy * cb - dz * sa * sb) / V
    ad = -P * sb * ca * sec + Q - Rr * sb * sa * sec + G / V * (-sec * sa * g1 + ca * sec * g3)
    ad -= (L * sec + Tx * sec * sa - Tz * ca * sec) / (m * V)
    ad += (-P * wy * ca * sec + Q * (wz * sa * sec + wx * ca * sec) - Rr * wy * sa * sec) / V
    ad -= (-dx * sec * sa + dz * ca * sec) / V
    return np.array([vd, bd, ad])


def b25_b27(c: Pair, air: Array) -> Array:
    """(Wdot_tmp) of (B.25)-(B.27) from the rates `air` of V, beta, alpha."""
    V, be, al = c.x[0:3]
    R = b10(*c.x[6:9])
    T1, T2, T3 = (c.w_t[0] * r[0] + c.w_t[1] * r[1] + c.w_t[2] * r[2] for r in R)  # (B.28)
    p, q, r = c.x[3:6]
    g1, g2, g3 = G * gravity(c, R)
    D, S, L = -c.A
    Tx, Ty, Tz = c.P
    vd, bd, ad = air
    ca, sa, cb, sb = math.cos(al), math.sin(al), math.cos(be), math.sin(be)
    x = V * sb * (r + T3) - V * sa * cb * (q + T2) + g1 + (-D * cb * ca + S * ca * sb + L * sa + Tx) / M_R
    x -= vd * cb * ca - bd * V * sb * ca - ad * V * cb * sa
    y = -V * cb * ca * (r + T3) + V * sa * cb * (p + T1) + g2 + (-D * sb - S * cb + Ty) / M_R
    y -= vd * sb + bd * V * cb
    z = V * cb * ca * (q + T2) - V * sb * (p + T1) + g3 + (-D * sa * cb + S * sa * sb - L * ca + Tz) / M_R
    z -= vd * cb * sa - bd * V * sb * sa + ad * V * cb * ca
    return np.array([x, y, z])


def b16_b21(c: Pair) -> Array:
    """Rates [6] of psi, theta, phi (B.16)-(B.18) and xi (B.19)-(B.21)."""
    V, be, al, p, q, r, _, th, ph, x, y, z = c.x
    R = b10(*c.x[6:9])
    pt, qt, rt = c.w_t
    turn = q * math.sin(ph) + r * math.cos(ph)
    angles = turn / math.cos(th), q * math.cos(ph) - r * math.sin(ph), p + turn * math.tan(th)
    u = V * math.cos(be) * math.cos(al), V * math.sin(be), V * math.sin(al) * math.cos(be)
    own = [sum((u[k] + c.wb[k]) * R[k, i] for k in range(3)) for i in range(3)]
    tanker = b10(*c.euler_t) @ c.v_t  # the brackets of (B.19)-(B.21) are the rows of (A.8) with psi_T, theta_T, phi_T
    lever = rt * y - qt * z, pt * z - rt * x, qt * x - pt * y
    return np.array([*angles, *(own[i] - tanker[i] + lever[i] for i in range(3))])


def b11_b13(c: Pair, d_p: float | None = None, sign: float = -1.0) -> Array:
    """(pdot, qdot, rdot) of (B.11)-(B.13), corrected; d_p: denominator of the moment term of (B.11); sign before its
    bracket."""
    R, (p, q, r), (ell, em, en) = b10(*c.x[6:9]), c.x[3:6], c.M
    ix, iy, iz, ixz = c.I[0, 0], c.I[1, 1], c.I[2, 2], -c.I[0, 2]
    D = ix * iz - ixz**2
    T1, T2, T3 = R @ c.w_t
    a1, a2, a3 = R @ c.w_t_dot
    P, Q, RR = p + T1, q + T2, r + T3
    pd = (iz * ell + ixz * en) / (d_p or D) + (iy * iz - iz**2 - ixz**2) / D * Q * RR
    pd += (iz * ixz + ixz * ix - ixz * iy) / D * P * Q + sign * (r * T2 - q * T3) - a1
    qd = em / iy + ixz / iy * (RR**2 - P**2) + (iz - ix) / iy * P * RR - (p * T3 - r * T1) - a2
    rd = (ixz * ell + ix * en) / D + ixz * (iy - iz - ix) / D * Q * RR + (ixz**2 + ix**2 - ix * iy) / D * P * Q
    rd += -(q * T1 - p * T2) - a3
    return np.array([pd, qd, rd])


def matrix_rates(c: Pair) -> Array:
    """wdot_rel of lee.md 3.2, solved with the inertia matrix."""
    w = c.x[3:6] + c.R @ c.w_t
    return np.linalg.solve(c.I, c.M + wa.skew_s(w) @ c.I @ w) - wa.skew_s(c.x[3:6]) @ c.R @ c.w_t - c.R @ c.w_t_dot


def test_E05_wind_rate_must_be_turned_through_both_aircraft(cases: list[Pair]) -> None:
    """(B.22)-(B.24) use R_ij = R_BRBT of (B.10): tanker axes; correct R_BRI = R_BRBT R_BTI, inertial axes."""
    good, axes, bad = 0.0, 0.0, []
    for c in cases:
        R, tmp = b10(*c.x[6:9]), b25_b27(c, c.rates[0:3])
        good = max(good, float(np.abs((R @ b10(*c.euler_t)).T @ tmp - c.wind_dot).max()))
        axes = max(axes, float(np.abs(R.T @ tmp - c.Rt @ c.wind_dot).max()))
        bad.append(float(np.linalg.norm(R.T @ tmp - c.wind_dot) / np.linalg.norm(c.wind_dot)))
    size = np.median([np.linalg.norm(c.wind_dot) for c in cases])
    print(
        f"correct {good:.1e} m/s^2; printed is the vector in tanker axes to {axes:.1e}; error median "
        f"{np.median(bad):.2f}, up to {max(bad):.2f} of the wind rate (median {size:.1f} m/s^2)"
    )
    assert good < 1e-6
    assert axes < 1e-6
    assert np.median(bad) > 1.0
    assert max(bad) < 2.0 + 1e-6  # a turned vector of the same length


def test_E09_denominator_and_sign_of_the_roll_equation(cases: list[Pair]) -> None:
    """(B.11) prints Ix Iz - Izz^2 and "=" before [r T2 - q T3]; correct Ix Iz - Ixz^2 and a minus."""
    good, den, plus = 0.0, [], []
    for c in cases:
        want = matrix_rates(c)[0]
        good = max(good, abs(b11_b13(c)[0] - want))
        den.append(abs(b11_b13(c, d_p=c.I[0, 0] * c.I[2, 2] - c.I[2, 2] ** 2)[0] - want))
        plus.append(abs(b11_b13(c, sign=+1.0)[0] - want))
    ratio = (c.I[0, 0] * c.I[2, 2] - c.I[0, 2] ** 2) / (c.I[0, 0] * c.I[2, 2] - c.I[2, 2] ** 2)
    print(
        f"correct {good:.1e}; printed denominator scales the moment term by {ratio:.2f}: median "
        f"{np.median(den):.1f} rad/s^2; plus for minus: median {np.median(plus):.3f}, max {max(plus):.2f} rad/s^2"
    )
    assert good < 1e-12
    assert ratio < -0.5  # the roll moment is even reversed
    assert np.median(den) > 1.0
    assert np.median(plus) > 0.05


def test_E10_pitch_is_right_and_the_yaw_line_has_its_own_left_side(cases: list[Pair]) -> None:
    """(B.12) right; (B.13) is printed without "rdot =", as a tail of (B.12); corrected yaw line of lee.md E10."""
    good, merged, plant = 0.0, [], 0.0
    for c in cases:
        got, want = b11_b13(c), matrix_rates(c)
        good = max(good, float(np.abs(got - want).max()))
        merged.append(abs(got[1] + got[2] - want[1]))  # read as it stands: qdot = (B.12) + (B.13)
        plant = max(plant, float(np.abs((got - c.rates[3:6]) / (SCALE[3:6] + np.abs(got))).max()))
    print(f"(B.12), (B.13) {good:.1e}, against the plants {plant:.1e}; merged lines median {np.median(merged):.2f}")
    assert good < 1e-12
    assert plant < 1e-7
    assert np.median(merged) > 0.1


def test_E11_translation_and_kinematics_of_appendix_b_are_right(cases: list[Pair]) -> None:
    """(B.1)-(B.3), (B.16)-(B.21), (B.25)-(B.29) are right as printed: matrix form, and two plants by differencing."""
    plant, matrix, wind, b29, rng = 0.0, 0.0, 0.0, 0.0, np.random.default_rng(11)
    for c in cases:
        V, be, al = c.x[0:3]
        w = c.x[3:6] + c.R @ c.w_t
        got = np.concatenate((b1_b3(c), b16_b21(c)))
        want = np.concatenate((c.rates[0:3], c.rates[6:12]))
        scale = np.concatenate((SCALE[0:3], SCALE[6:12]))
        plant = max(plant, float(np.abs((got - want) / (scale + np.abs(want))).max()))
        rbw, full = wa.r_bw(be, al), dataclasses.replace(c, P=rng.uniform(-6e3, 6e3, 3))  # thrust on all three axes
        force = c.Rr @ wa.G + (rbw @ c.A + full.P) / M_R
        body = wa.skew_s(w) @ (rbw @ [V, 0, 0] + c.wb) - c.wb_dot + force
        matrix = max(matrix, float(np.abs(b1_b3(full) - np.linalg.solve(wa.eps(V, be, al), body)).max()))
        pos = c.R.T @ (rbw @ [V, 0, 0] + c.wb) - c.Rt @ c.v_t + wa.skew_s(c.w_t) @ c.x[9:12]
        matrix = max(matrix, float(np.abs(got[6:9] - pos).max() / 100.0))
        matrix = max(matrix, float(np.abs(got[3:6] - wa.euler_rates(c.x[3:6], *c.x[7:9])).max()))
        tmp = wa.skew_s(w) @ rbw @ [V, 0, 0] + force - wa.eps(V, be, al) @ c.rates[0:3]
        wind = max(wind, float(np.abs(b25_b27(full, c.rates[0:3]) - tmp).max()))
        b29 = max(b29, float(np.abs(c.Rr @ c.wind_dot + wa.skew_s(w) @ c.wb - c.wb_dot).max()))
    print(f"plants {plant:.1e} (scaled), matrix {matrix:.1e}, (B.25)-(B.27) {wind:.1e}, (B.29) {b29:.1e} m/s^2")
    assert plant < 1e-7
    assert matrix < 1e-11
    assert wind < 1e-11
    assert b29 < 1e-7
