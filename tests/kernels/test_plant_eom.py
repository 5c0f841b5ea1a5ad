"""The plant's equations of motion against independent formulations and conservation laws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.aircraft.sixdof.eom import derivative, inertia, step
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.trim import observation, trim
from sim_plant.kernels import layout as n
from sim_plant.kernels.rot import quat_dcm, quat_from_euler

G = np.array([0.0, 0.0, 9.80665])


def wind(t: float) -> np.ndarray:
    """Smooth wind [m/s, NED]."""
    return np.array([7 + 3 * np.sin(0.9 * t), -13 + 4 * np.sin(0.7 * t + 1), 0.6 * np.sin(1.1 * t)])


def wind_dot(t: float) -> np.ndarray:
    return np.array([2.7 * np.cos(0.9 * t), 2.8 * np.cos(0.7 * t + 1), 0.66 * np.cos(1.1 * t)])


def r_bi(psi: float, theta: float, phi: float) -> np.ndarray:
    """R1(phi) R2(theta) R3(psi) of lee.md section 2."""
    cp, sp, ct, st, cf, sf = np.cos(psi), np.sin(psi), np.cos(theta), np.sin(theta), np.cos(phi), np.sin(phi)
    r3 = np.array([[cp, sp, 0], [-sp, cp, 0], [0, 0, 1]])
    r2 = np.array([[ct, 0, -st], [0, 1, 0], [st, 0, ct]])
    r1 = np.array([[1, 0, 0], [0, cf, sf], [0, -sf, cf]])
    return r1 @ r2 @ r3


def wind_axis_rates(
    t: float, x: np.ndarray, ac: Aircraft, mass: float, ine: np.ndarray, surf: np.ndarray, thrust: float
):
    """lee.md 3.1 for x = V, beta, alpha, p, q, r, psi, theta, phi, position, derivatives from the file."""
    v, b, a = x[0:3]
    w = x[3:6]
    r = r_bi(*x[6:9])
    ca, sa, cb, sb = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    r_bw = np.array([[ca * cb, -ca * sb, -sa], [sb, cb, 0], [sa * cb, -sa * sb, ca]])
    eps = np.array([[ca * cb, -v * ca * sb, -v * sa * cb], [sb, v * cb, 0], [sa * cb, -v * sa * sb, v * ca * cb]])
    h = -x[11]
    temp = 288.15 - 0.0065 * h
    rho = 101325.0 * (temp / 288.15) ** (9.80665 / (0.0065 * 287.053)) / (287.053 * temp)
    k, geo = ac.aero, ac.geometry
    qs, kb, kc = 0.5 * rho * v * v * geo.S_m2, geo.b_m / 2 / v, geo.c_m / 2 / v
    da, de, dr = surf
    ps, rs = w[0] * ca + w[2] * sa, w[2] * ca - w[0] * sa
    s_w = np.array([[0, w[2], -w[1]], [-w[2], 0, w[0]], [w[1], -w[0], 0]])
    cls = k.CL0 + k.CL_alpha * a + k.CL_de * de
    u_a = r_bw @ [v, 0, 0]
    ad_inertial = 0.0
    for _ in range(60):  # implicit in alphadot: plain iteration, contraction about 0.01
        lift = qs * (cls + kc * (k.CL_q * w[1] + k.CL_alphadot * ad_inertial))
        side = -qs * (k.CY_beta * b + kb * (k.CY_p * ps + k.CY_r * rs) + k.CY_dr * dr)  # positive to the left
        force = r_bw @ [-qs * (k.CD0 + k.K * cls * cls), -side, -lift] + [thrust, 0, 0]
        still = np.linalg.solve(eps, s_w @ u_a + r @ G + force / mass)  # rates without the wind's acceleration
        ad_inertial = still[2]
    vba = np.linalg.solve(eps, s_w @ u_a + r @ G + force / mass - r @ wind_dot(t))
    cm = k.Cm0 + k.Cm_alpha * a + kc * (k.Cm_q * w[1] + k.Cm_alphadot * ad_inertial) + k.Cm_de * de
    cl = k.Cl_beta * b + kb * (k.Cl_p * ps + k.Cl_r * rs) + k.Cl_da * da + k.Cl_dr * dr
    cn = k.Cn_beta * b + kb * (k.Cn_p * ps + k.Cn_r * rs) + k.Cn_da * da + k.Cn_dr * dr
    moment = qs * np.array([geo.b_m * (cl * ca - cn * sa), geo.c_m * cm, geo.b_m * (cl * sa + cn * ca)])
    wdot = np.linalg.solve(ine, moment + s_w @ (ine @ w))
    theta, phi = x[7:9]
    sf, cf = np.sin(phi), np.cos(phi)
    euler = [
        (w[1] * sf + w[2] * cf) / np.cos(theta),
        w[1] * cf - w[2] * sf,
        w[0] + np.tan(theta) * (w[1] * sf + w[2] * cf),
    ]
    return np.array([*vba, *wdot, *euler, *(r.T @ u_a + wind(t))])


@pytest.mark.parametrize("name", ["kc135r", "learjet24"])
def test_body_axis_plant_equals_wind_axis_equations_in_time_varying_wind(name: str) -> None:
    """Two formulations, one with the wind only, one with its derivative, agree to 1e-7 over a lively manoeuvre."""
    ac = load_aircraft(name)
    par = parameter_vector(ac)
    par[n.P_TAU], par[n.P_TSFC] = 1e15, 0.0  # thrust and mass held
    fuel = ac.mass.default_fuel_kg
    w0 = np.zeros(n.NW)
    w0[:3] = wind(0.0)
    s = trim(np.array([0.0, 0.0, -7010.0]), w0[:3] * [1, 1, 0] + [195.0, 0, 0], w0, fuel, par)
    s[n.S_W : n.S_W + 3] = [0.05, 0.01, -0.02]
    surf = s[n.S_SURF : n.S_SURF + 3] + [0.01, -0.01, 0.01]
    s[n.S_SURF : n.S_SURF + 3] = surf
    c = np.zeros(n.NC)
    c[0:3] = surf

    o = observation(s, w0, par)
    x0 = np.array([o[n.O_V], o[n.O_BETA], o[n.O_ALPHA], *s[4:7], *o[n.O_EULER : n.O_EULER + 3], *s[10:13]])
    mass = ac.mass.empty_kg + fuel
    ixx, iyy, izz, ixz = inertia(mass, par)
    ine = np.array([[ixx, 0, -ixz], [0, iyy, 0], [-ixz, 0, izz]])
    t_end, dt = 4.0, 2e-4
    args = (ac, mass, ine, surf, float(s[n.S_T]))
    ref = solve_ivp(wind_axis_rates, (0, t_end), x0, "DOP853", rtol=1e-12, atol=1e-12, args=args).y[:, -1]

    scratch, w = np.zeros((4, n.NS)), np.zeros(n.NW)
    for k in range(round(t_end / dt)):
        w[:3] = wind((k + 0.5) * dt)  # the plant holds the wind over a step; its mean makes that second order
        step(s, c, w, par, dt, scratch)
    w[:3] = wind(t_end)
    o = observation(s, w, par)
    got = np.array([o[n.O_V], o[n.O_BETA], o[n.O_ALPHA], *s[4:7], *o[n.O_EULER : n.O_EULER + 3], *s[10:13]])
    scale = np.array([195.0, 1, 1, 1, 1, 1, 1, 1, 1, 780.0, 780.0, 7010.0])
    assert np.max(np.abs((got - ref) / scale)) < 1e-7
    assert np.max(np.abs(got[3:9] - x0[3:9])) > 0.02  # it did manoeuvre


def _vacuum(name: str) -> tuple[np.ndarray, np.ndarray]:
    """A tumbling aircraft without air, engine or fuel flow."""
    ac = load_aircraft(name)
    par = parameter_vector(ac)
    par[n.P_S], par[n.P_TSFC], par[n.P_IDLE] = 0.0, 0.0, 0.0
    s = np.zeros(n.NS)
    s[0:4] = quat_from_euler(0.4, 0.3, -0.8)
    s[4:7], s[7:10], s[10:13], s[n.S_FUEL] = (
        [0.5, 0.3, -0.4],
        [150.0, 20.0, -5.0],
        [0, 0, -7000.0],
        ac.mass.default_fuel_kg,
    )
    return s, par


def test_without_air_momentum_and_energy_are_conserved() -> None:
    s, par = _vacuum("learjet24")
    ixx, iyy, izz, ixz = inertia(par[n.P_EMPTY] + s[n.S_FUEL], par)
    ine = np.array([[ixx, 0, -ixz], [0, iyy, 0], [-ixz, 0, izz]])

    def spin(x: np.ndarray) -> np.ndarray:
        h = np.array(quat_dcm(*x[0:4])).reshape(3, 3) @ ine @ x[4:7]
        return np.array([*h, 0.5 * x[4:7] @ ine @ x[4:7]])

    before, v0, p0 = spin(s), s[7:10].copy(), s[10:13].copy()
    c, w, scratch = np.zeros(n.NC), np.zeros(n.NW), np.zeros((4, n.NS))
    for _ in range(1000):
        step(s, c, w, par, 0.01, scratch)
    assert np.allclose(spin(s), before, rtol=1e-7)
    assert abs(np.linalg.norm(s[0:4]) - 1.0) < 1e-14
    assert np.allclose(s[7:10], v0 + 10.0 * G, rtol=1e-12)
    assert np.allclose(s[10:13], p0 + 10.0 * v0 + 50.0 * G, rtol=1e-12)


def test_runge_kutta_converges_with_fourth_order() -> None:
    ac = load_aircraft("learjet24")
    par = parameter_vector(ac)
    s0 = trim(np.array([0.0, 0.0, -7010.0]), np.array([195.0, 0, 0]), np.zeros(n.NW), ac.mass.default_fuel_kg, par)
    s0[4:7] = [0.3, 0.1, -0.1]
    par[n.P_TSFC] = 0.0
    ends = []
    for dt in (0.04, 0.02, 0.0025):
        s, c, scratch = s0.copy(), np.zeros(n.NC), np.zeros((4, n.NS))
        c[0:3], c[3] = s0[n.S_SURF : n.S_SURF + 3], 0.5
        for _ in range(round(1.0 / dt)):
            step(s, c, np.zeros(n.NW), par, dt, scratch)
        ends.append(s[: n.N_RIGID].copy())
    e1, e2 = np.linalg.norm(ends[0] - ends[2]), np.linalg.norm(ends[1] - ends[2])
    assert 12.0 < e1 / e2 < 20.0


def test_rotating_air_takes_damping_away() -> None:
    """Rotating with the air, the aircraft feels no rate damping; the moment equals that of a non-rotating one."""
    ac = load_aircraft("learjet24")
    par = parameter_vector(ac)
    s = trim(np.array([0.0, 0.0, -7010.0]), np.array([195.0, 0, 0]), np.zeros(n.NW), ac.mass.default_fuel_kg, par)
    still, moving, w = np.zeros(n.N_RIGID), np.zeros(n.N_RIGID), np.zeros(n.NW)
    surf = s[n.S_SURF : n.S_SURF + 3]
    derivative(s, *surf, 0.0, w, s[n.S_FUEL], par, still)
    s[4] = w[3] = 0.1
    derivative(s, *surf, 0.0, w, s[n.S_FUEL], par, moving)
    assert abs(moving[4] - still[4]) < 1e-9
    w[3] = 0.0
    derivative(s, *surf, 0.0, w, s[n.S_FUEL], par, moving)
    assert moving[4] - still[4] < -0.05


def test_compiled_and_interpreted_step_agree_to_the_bit() -> None:
    ac = load_aircraft("kc135r")
    par = parameter_vector(ac)
    s = trim(np.array([0.0, 0.0, -7010.0]), np.array([195.0, 0, 0]), np.zeros(n.NW), ac.mass.default_fuel_kg, par)
    a, b = np.zeros(n.N_RIGID), np.zeros(n.N_RIGID)
    args = (s, 0.01, -0.02, 0.03, 0.5, np.array([1.0, 2, 3, 0.01, 0.02, 0.03]), s[n.S_FUEL], par)
    derivative(*args, a)
    getattr(derivative, "py_func", derivative)(*args, b)
    assert np.array_equal(a, b)
