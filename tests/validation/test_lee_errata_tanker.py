"""Lee 2011, single aircraft: errata E1, E2, E3, E20, E21 of lee.md section 4.

The scalar equations of appendix A are written here as printed and set against the plant (body axes, quaternion, no wind
derivative) by differencing, in wind that varies with time. Left-hand names follow the source: A = aerodynamic force
[-D, -S, -L] in wind axes, moments (L, M, N) in body axes.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.params import parameter_vector as onboard_parameters
from flightsw.sixdof.sensed import sensed_rates
from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.aircraft.sixdof.observe import observe
from sim_plant.kernels import layout as n
from tests.validation import wind_axis as wa
from tests.validation.test_equations_of_motion import (
    SCALE,
    Wind,
    dcm_bn,
    plant_in_wind_axes,
    plant_parameters,
    plant_state,
    random_case,
)

MASS, EMPTY = 120e3, 44663.0
G = 9.80665
Array = np.ndarray


def lee_tanker() -> Aircraft:
    """KC-135R without incidence-rate derivatives, which Lee's build-up does not have."""
    ac = load_aircraft("kc135r")
    return dataclasses.replace(ac, aero=dataclasses.replace(ac.aero, CL_alphadot=0.0, Cm_alphadot=0.0))


@dataclasses.dataclass
class Flight:
    """One random instant: state and controls, wind, its rate, forces (D, S, L), moments, plant state and its rates."""

    x: Array
    u: Array
    w: Array
    wdot: Array
    D: float
    S: float
    L: float
    M: Array
    s: Array
    rates: Array


def flights(number: int, seed: int) -> list[Flight]:
    """Random flights of the tanker with the plant's rates turned to wind axes by differencing."""
    rng, ac = np.random.default_rng(seed), lee_tanker()
    b, par, out = wa.body(ac, MASS), plant_parameters(ac), []
    for _ in range(number):
        x, u = random_case(rng, "kc135r")
        wind, w_eff, t = Wind(rng), rng.uniform(-0.1, 0.1, 3), rng.uniform(0, 50)
        s = plant_state(x, u, wind.at(t), MASS - EMPTY)
        force, moment = wa.aero(b, x[0:3], x[3:6] - w_eff, u, wa.density(-x[11]), 0.0)
        rates = plant_in_wind_axes(s, u, par, wind, w_eff, t)
        out.append(Flight(x, u, wind.at(t), wind.rate(t), *(-force), moment, s, rates))
    return out


def a1_a3(f: Flight, T: float, d: float) -> Array:
    """(Vdot, betadot, alphadot) of (A.1)-(A.3) as printed; thrust T [N] inclined by d [rad]; R_ij of (A.8)."""
    V, be, al = f.x[0:3]
    p, q, r = f.x[3:6]
    _, th, ph = f.x[6:9]
    w1, w2, w3 = a8(*f.x[6:9]) @ f.wdot
    ca, sa, cb, sb, tb, sec = math.cos(al), math.sin(al), math.cos(be), math.sin(be), math.tan(be), 1 / math.cos(be)
    gx, gy, gz = -math.sin(th), math.sin(ph) * math.cos(th), math.cos(ph) * math.cos(th)
    Vd = G * (ca * cb * gx + sb * gy + cb * sa * gz) + (-f.D + T * math.cos(al + d) * cb) / MASS
    Vd += -w1 * ca * cb - w2 * sb - w3 * cb * sa
    bd = p * sa - r * ca + G / V * (-ca * sb * gx + cb * gy - sa * sb * gz)
    bd += -(f.S + T * math.cos(al + d) * sb) / (MASS * V) + (w1 * ca * sb - w2 * cb + w3 * sa * sb) / V
    ad = q - r * tb * sa - p * tb * ca + G / V * (-sec * sa * gx + ca * sec * gz)
    ad += -sec / (MASS * V) * (f.L + T * math.sin(al + d)) + sec / V * (w1 * sa - w3 * ca)
    return np.array([Vd, bd, ad])


def a8(ps: float, th: float, ph: float) -> Array:
    """Inertial to body matrix of (A.8)."""
    c, s = math.cos, math.sin
    return np.array(
        [
            [c(th) * c(ps), c(th) * s(ps), -s(th)],
            [-c(ph) * s(ps) + s(ph) * s(th) * c(ps), c(ph) * c(ps) + s(ph) * s(th) * s(ps), s(ph) * c(th)],
            [s(ph) * s(ps) + c(ph) * s(th) * c(ps), -s(ph) * c(ps) + c(ph) * s(th) * s(ps), c(ph) * c(th)],
        ]
    )


def a9_a13(f: Flight, inertia: Array) -> Array:
    """Rates [9] of p, q, r (A.9), psi, theta, phi (A.12), x, y, z (A.13) as printed."""
    V, be, al, p, q, r, ps, th, ph = f.x[:9]
    ix, iy, iz, ixz = inertia[0, 0], inertia[1, 1], inertia[2, 2], -inertia[0, 2]
    ell, em, en = f.M
    D = ix * iz - ixz**2
    pd = (iz * ell + ixz * en + (ix - iy + iz) * ixz * p * q + (iz * iy - iz**2 - ixz**2) * q * r) / D
    qd = (em + (iz - ix) * r * p + (r**2 - p**2) * ixz) / iy
    rd = (ixz * ell + ix * en + (ixz**2 + ix**2 - ix * iy) * p * q + (iy - iz - ix) * ixz * q * r) / D
    turn = q * math.sin(ph) + r * math.cos(ph)
    angles = turn / math.cos(th), q * math.cos(ph) - r * math.sin(ph), p + turn * math.tan(th)
    R = a8(ps, th, ph)
    u = V * math.cos(be) * math.cos(al), V * math.sin(be), V * math.sin(al) * math.cos(be)
    pos = [u[0] * R[0, i] + u[1] * R[1, i] + u[2] * R[2, i] + f.w[i] for i in range(3)]
    return np.array([pd, qd, rd, *angles, *pos])


def a15(f: Flight, air: Array, T: float, *, printed: bool) -> Array:
    """(Wdot_B) of (A.15) from the rates `air` of V, beta, alpha; `printed`: cos(phi) cos(alpha) in the z row."""
    V, be, al, p, q, r, _, th, ph = f.x[:9]
    ca, sa, cb, sb = math.cos(al), math.sin(al), math.cos(be), math.sin(be)
    vd, bd, ad = air
    x = r * V * sb - q * V * sa * cb
    x += -G * math.sin(th) + (-f.D * cb * ca + f.S * ca * sb + f.L * sa + T) / MASS
    x -= vd * cb * ca - bd * V * sb * ca - ad * V * cb * sa
    y = -r * V * cb * ca + p * V * sa * cb + G * math.sin(ph) * math.cos(th) + (-f.D * sb - f.S * cb) / MASS
    y -= vd * sb + bd * V * cb
    z = q * V * cb * ca - p * V * sb + G * math.cos(ph) * math.cos(al if printed else th)
    z += (-f.D * sa * cb + f.S * sa * sb - f.L * ca) / MASS
    z -= vd * cb * sa - bd * V * sb * sa + ad * V * cb * ca
    return np.array([x, y, z])


def test_E01_side_force_follows_the_rudder_and_one_area_serves_force_and_moment() -> None:
    """(2.6b) prints C_S_delta_T, must be C_S_delta_r; S_T of (2.5b) is a force left and an area right; S_a of (2.9) = S."""
    ac, par = lee_tanker(), plant_parameters(lee_tanker())
    f = flights(1, 1)[0]

    def side_and_roll(da: float, dr: float, thrust: float) -> tuple[float, float]:
        s = f.s.copy()
        s[n.S_T] = thrust
        out = loads(s[: n.N_RIGID], float(da), f.u[1], float(dr), np.zeros(6), MASS, par)
        sb, cb = math.sin(out[7]), math.cos(out[7])
        ca, sa = math.cos(out[8]), math.sin(out[8])
        side = -(-ca * sb * (out[0] - thrust) + cb * out[1] - sa * sb * out[2])  # Lee's S: positive to the left
        q = 0.5 * out[12] * out[6] ** 2
        return side / (q * ac.geometry.S_m2), (ca * out[3] + sa * out[5]) / (q * ac.geometry.S_m2 * ac.geometry.b_m)

    h, T = 1e-3, f.u[3]
    by_rudder = (side_and_roll(0, h, T)[0] - side_and_roll(0, -h, T)[0]) / (2 * h)
    by_thrust = side_and_roll(0, 0, 2 * T)[0] - side_and_roll(0, 0, T)[0]
    by_aileron = (side_and_roll(h, 0, T)[1] - side_and_roll(-h, 0, T)[1]) / (2 * h)
    print(f"dC_S/d rudder {by_rudder:.6f}, C_S change with doubled thrust {by_thrust:.1e}")
    assert abs(by_rudder + ac.aero.CY_dr) < 1e-9  # C_S_dr = -C_Y_dr: area of the force
    assert abs(by_aileron - ac.aero.Cl_da) < 1e-9  # the same area in the moment
    assert abs(by_thrust) < 1e-12 * T < abs(by_rudder)  # nothing of the thrust in the side force: 0 against 0.175


def test_E02_gravity_in_the_wind_equation_has_cos_theta() -> None:
    """(A.15) z row prints m g cos(phi) cos(alpha); correct m g cos(phi) cos(theta). Wind rate of (A.14) recovered."""
    good, bad, gentle = 0.0, 0.0, 0.0
    for f in flights(60, 2):
        R = a8(*f.x[6:9])
        air = f.rates[:3]
        good = max(good, np.abs(R.T @ a15(f, air, f.u[3], printed=False) - f.wdot).max())
        err = np.linalg.norm(R.T @ a15(f, air, f.u[3], printed=True) - f.wdot)
        assert abs(err - G * abs(math.cos(f.x[8]) * (math.cos(f.x[2]) - math.cos(f.x[7])))) < 1e-5
        bad = max(bad, err)
        if abs(f.x[7]) < 0.3:
            gentle = max(gentle, err)
    print(f"corrected {good:.1e} m/s^2; printed up to {bad:.2f} m/s^2 ({gentle:.2f} with pitch below 0.3 rad)")
    assert good < 2e-6
    assert bad > 1.0
    assert gentle > 0.3


def test_E03_appendix_a_is_right() -> None:
    """(A.1)-(A.3), (A.8), (A.9), (A.12)-(A.14) are right as printed: plant by differencing, and matrix form (2.1)."""
    b, worst, matrix = wa.body(lee_tanker(), MASS), 0.0, 0.0
    rng = np.random.default_rng(33)
    for f in flights(60, 3):
        R = a8(*f.x[6:9])
        got = np.concatenate((a1_a3(f, f.u[3], 0.0), a9_a13(f, b.I)))
        worst = max(worst, float(np.abs((got - f.rates) / (SCALE + np.abs(f.rates))).max()))
        # (A.14) turns body components back: with the wind rate's own body components it must be the identity
        back = [R[0, i] * (R @ f.wdot)[0] + R[1, i] * (R @ f.wdot)[1] + R[2, i] * (R @ f.wdot)[2] for i in range(3)]
        matrix = max(matrix, float(np.abs(np.array(back) - f.wdot).max()))
        # an inclined engine is not in the plant: (2.1)-(2.4) in matrix form
        d, (V, be, al) = rng.uniform(-0.2, 0.2), f.x[0:3]
        push = f.u[3] * np.array([math.cos(d), 0.0, -math.sin(d)]) / MASS
        rbw = wa.r_bw(be, al)
        body = wa.skew_s(f.x[3:6]) @ rbw @ [V, 0, 0] + wa.r_bi(*f.x[6:9]) @ (wa.G - f.wdot)
        want = np.linalg.solve(wa.eps(V, be, al), body + rbw @ [-f.D, -f.S, -f.L] / MASS + push)
        matrix = max(matrix, float(np.abs(a1_a3(f, f.u[3], d) - want).max()))
    print(f"against the plant {worst:.1e} (scaled), against the matrix form {matrix:.1e}")
    assert worst < 1e-7
    assert matrix < 1e-12


def test_E20_accelerometer_needs_gravity_and_the_rate_difference_the_sample_period() -> None:
    """(5.1) puts the accelerometer for all external force; specific force lacks gravity. "dt" of (5.2) is T."""
    par, P, good, bad, flight = plant_parameters(lee_tanker()), onboard_parameters(lee_tanker(), MASS), 0.0, np.inf, 0.0
    none, out = np.zeros(3), np.zeros(n.NO)
    for f in flights(40, 20):
        V, be, al = f.x[0:3]
        R = dcm_bn(f.s[0:4])
        w6 = np.concatenate((f.w, none))
        observe(f.s, w6, f.w, par, none, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(n.N_RIGID), out)
        e = wa.eps(V, be, al)
        printed = wa.skew_s(f.x[3:6]) @ wa.r_bw(be, al) @ [V, 0, 0] - R @ f.wdot + out[0:3]
        # rotational wind moves the forces but not this identity: rates from the forces the accelerometer felt
        u_dot = wa.skew_s(f.x[3:6]) @ (R @ (f.s[7:10] - f.w)) + R @ (out[n.O_ACC : n.O_ACC + 3] - f.wdot)
        want = np.linalg.solve(e, u_dot)
        good = max(good, float(np.abs(np.linalg.solve(e, printed + R @ wa.G) - want).max()))
        bad = min(bad, float(np.linalg.norm(e @ (np.linalg.solve(e, printed) - want))))
        # the estimator's own form, in steady wind
        d, R9, fm = np.zeros(15), np.zeros(9), np.zeros(9)
        dcm_from_euler(*f.x[6:9], R9)
        sensed_rates(
            np.concatenate((f.x, f.w)), f.u, out[n.O_RHO], P, np.concatenate((out[0:3], none)), False, R9, fm, d
        )
        flight = max(flight, float(np.abs(d[:3] - want - np.linalg.solve(e, R @ f.wdot)).max()))
    print(f"with gravity {good:.1e}, onboard kernel {flight:.1e}; as printed wrong by {bad:.5f} m/s^2 always")
    assert good < 1e-10
    assert flight < 1e-9
    assert abs(bad - G) < 1e-9
    # (5.2): a steady roll acceleration of 0.4 rad/s^2 sampled at T = 0.05 s, plant step 0.01 s
    T, dt, a = 0.05, 0.01, 0.4
    diff = a * 1.0 - a * (1.0 - T)
    assert abs(diff / T - a) < 1e-12
    assert abs(diff / dt / a - 5.0) < 1e-9


def test_E21_thrust_arm_is_positive_aft() -> None:
    """(2.25) pitch +dz Tx + dx Tz, yaw -dy Tx - dx Ty equal r x F only for r = (-dx, dy, dz): dx counted aft."""
    rng, worst, miss = np.random.default_rng(21), 0.0, 0.0
    for _ in range(100):
        dx, dy, dz, Tx, Ty, Tz = rng.uniform(-3, 3, 6)
        printed = np.array([-dz * Ty + dy * Tz, dz * Tx + dx * Tz, -dy * Tx - dx * Ty])
        force = np.array([Tx, Ty, Tz])
        worst = max(worst, float(np.abs(printed - np.cross([-dx, dy, dz], force)).max()))
        forward = printed - np.cross([dx, dy, dz], force)
        assert np.allclose(forward, [0.0, 2 * dx * Tz, -2 * dx * Ty], atol=1e-12)
        miss = max(miss, float(np.abs(forward).max()))
    print(f"dx aft {worst:.1e}; dx forward wrong by 2 dx T, up to {miss:.1f}")
    assert worst < 1e-14
    assert miss > 10.0
