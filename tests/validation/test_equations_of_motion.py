"""Three formulations of the same mechanics against each other, to 1e-7 (acceptance 5).

The plant (body axes, quaternion, no wind derivative) and the onboard model kernels are compared with the wind-axis
equations of lee.md 3.1 and the relative equations of 3.2 as written in `wind_axis.py`, in smooth time-varying wind.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.sixdof.motion import free_rates, relative_rates, relative_velocity
from flightsw.sixdof.params import parameter_vector as onboard_parameters
from sim_plant.aircraft.sixdof.eom import derivative
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.kernels import layout as n
from tests.validation import wind_axis as wa

TOL = 1e-7
AIRCRAFT = {"kc135r": 120e3, "learjet24": 4989.5}
# size of one unit of each rate: V, beta, alpha, w (3), angles (3), position (3)
SCALE = np.array([1.0, 1e-2, 1e-2, 1e-1, 1e-1, 1e-1, 1e-1, 1e-1, 1e-1, 100.0, 100.0, 100.0])

Array = np.ndarray


class Wind:
    """Smooth wind field in time, with its exact derivative."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.mean, self.amp = rng.uniform(-15, 15, 3), rng.uniform(1, 6, 3)
        self.om, self.ph = rng.uniform(0.2, 2.0, 3), rng.uniform(-3, 3, 3)

    def at(self, t: float) -> Array:
        return self.mean + self.amp * np.sin(self.om * t + self.ph)

    def rate(self, t: float) -> Array:
        return self.amp * self.om * np.cos(self.om * t + self.ph)


def random_case(rng: np.random.Generator, name: str) -> tuple[Array, Array]:
    """A flight state [12] in the wind-axis layout (V, beta, alpha, p, q, r, psi, theta, phi, position) and controls
    [4].
    """
    x = np.zeros(12)
    x[0:3] = rng.uniform(140, 230), rng.uniform(-0.2, 0.2), rng.uniform(-0.1, 0.2)
    x[3:6] = rng.uniform(-0.5, 0.5, 3)
    x[6:9] = rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), rng.uniform(-1.2, 1.2)
    x[9:12] = *rng.uniform(-5e3, 5e3, 2), rng.uniform(-9000, -3000)
    thrust = {"kc135r": 70e3, "learjet24": 6e3}[name]
    return x, np.array([*rng.uniform(-0.25, 0.25, 3), rng.uniform(0.2, 2.0) * thrust])


def plant_state(x: Array, u: Array, wind: Array, fuel: float) -> Array:
    """The plant's state vector of a wind-axis state in wind (only elementary rotations: the plant's own kernels stay
    out).
    """
    s = np.zeros(n.NS)
    h = 0.5 * x[6:9]
    qz, qy, qx = ((math.cos(a), math.sin(a)) for a in h)
    z, y, q = (qz[0], 0, 0, qz[1]), (qy[0], 0, qy[1], 0), (qx[0], qx[1], 0, 0)

    def mul(a: tuple, b: tuple) -> tuple:
        return (
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        )

    s[0:4] = mul(mul(z, y), q)
    s[n.S_W : n.S_W + 3] = x[3:6]
    s[n.S_V : n.S_V + 3] = wa.r_bi(*x[6:9]).T @ wa.r_bw(x[1], x[2]) @ [x[0], 0, 0] + wind
    s[n.S_P : n.S_P + 3] = x[9:12]
    s[n.S_T], s[n.S_SURF : n.S_SURF + 3], s[n.S_FUEL] = u[3], u[:3], fuel
    return s


def dcm_bn(q: Array) -> Array:
    """NED to body from the quaternion (Euler-Rodrigues)."""
    q0, v = q[0], q[1:4]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return ((q0 * q0 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * q0 * cross).T / (q @ q)


def angles(R: Array) -> Array:
    """(psi, theta, phi) of a parent-to-child matrix."""
    return np.array([math.atan2(R[0, 1], R[0, 0]), -math.asin(R[0, 2]), math.atan2(R[1, 2], R[2, 2])])


def flow(u: Array) -> Array:
    """(V, beta, alpha) of the air-relative velocity in body axes."""
    V = math.sqrt(u @ u)
    return np.array([V, math.asin(u[1] / V), math.atan2(u[2], u[0])])


def to_wind_axes(s: Array, wind: Array) -> Array:
    """Plant state -> V, beta, alpha, p, q, r, psi, theta, phi, x, y, z."""
    R = dcm_bn(s[0:4])
    return np.concatenate((flow(R @ (s[7:10] - wind)), s[4:7], angles(R), s[10:13]))


def plant_parameters(ac: Aircraft) -> Array:
    """The plant's parameters with the lift curve straight for ever, as in the equations it is compared with."""
    par = parameter_vector(ac)
    par[n.P_ROUND_OFF] = 0.0
    return par


def plant_rates(s: Array, u: Array, w: Array, par: Array) -> Array:
    """The plant's own derivative [N_RIGID] of its rigid state."""
    out = np.zeros(n.N_RIGID)
    derivative(s, u[0], u[1], u[2], 0.3, w, s[n.S_FUEL], par, out)
    return out


def along(value, h: float) -> Array:  # type: ignore[no-untyped-def]
    """d value / d t at 0 by the six-point central difference, truncation error of order h^6."""
    return (45 * (value(h) - value(-h)) - 9 * (value(2 * h) - value(-2 * h)) + value(3 * h) - value(-3 * h)) / (60 * h)


def plant_in_wind_axes(s: Array, u: Array, par: Array, wind: Wind, w_eff: Array, t: float) -> Array:
    """Rates of the wind-axis states that follow from the plant's derivative and the wind's motion, by differencing."""
    w = np.concatenate((wind.at(t), w_eff))
    d = plant_rates(s, u, w, par)
    # a straight line in state space has the tangent of the true path, which is all a first derivative sees
    return along(lambda h: to_wind_axes(s[: n.N_RIGID] + h * d, wind.at(t + h)), 2e-3)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_plant_agrees_with_the_wind_axis_equations_at_random_states(name: str) -> None:
    rng = np.random.default_rng(2011)
    ac, par = load_aircraft(name), plant_parameters(load_aircraft(name))
    b, worst = wa.body(ac, AIRCRAFT[name]), 0.0
    for _ in range(200):
        x, u = random_case(rng, name)
        wind, w_eff, t = Wind(rng), rng.uniform(-0.1, 0.1, 3), rng.uniform(0, 50)
        s = plant_state(x, u, wind.at(t), AIRCRAFT[name] - ac.mass.empty_kg)
        got = plant_in_wind_axes(s, u, par, wind, w_eff, t)
        want = wa.single(b, x, u, wind.at(t), wind.rate(t), w_eff)
        worst = max(worst, float(np.abs((got - want) / (SCALE + np.abs(want))).max()))
    print(f"{name}: largest scaled difference of the rates {worst:.2e}")
    assert worst < TOL


@pytest.mark.parametrize("name", AIRCRAFT)
def test_plant_and_wind_axis_equations_stay_together_for_ten_seconds(name: str) -> None:
    """Both sets integrated by one library solver from one state through the same time-varying wind and controls."""
    rng = np.random.default_rng(4)
    ac, par = load_aircraft(name), plant_parameters(load_aircraft(name))
    b, wind = wa.body(ac, AIRCRAFT[name]), Wind(rng)
    fuel = AIRCRAFT[name] - ac.mass.empty_kg
    x0 = np.array([195, 0.01, 0.05, 0, 0, 0, 0.3, 0.05, 0.1, 0, 0, -7010.0])
    thrust = {"kc135r": 70e3, "learjet24": 6e3}[name]

    def controls(t: float) -> Array:
        return np.array([0.01 * math.sin(0.9 * t), 0.01 * math.sin(0.5 * t), 0.01 * math.cos(0.7 * t), thrust])

    none = np.zeros(3)

    def f_ref(t: float, x: Array) -> Array:
        return wa.single(b, x, controls(t), wind.at(t), wind.rate(t), none)

    def f_plant(t: float, y: Array) -> Array:
        u = controls(t)
        s = np.concatenate((y, [u[3]], np.zeros(n.NS - 14)))
        s[n.S_FUEL] = fuel
        return plant_rates(s, u, np.concatenate((wind.at(t), none)), par)[:13]

    y0 = plant_state(x0, controls(0.0), wind.at(0.0), fuel)[:13]
    t = np.linspace(0, 10, 11)
    kw = {"method": "DOP853", "t_eval": t, "rtol": 1e-11, "atol": 1e-11}
    ref, plant = solve_ivp(f_ref, (0, 10), x0, **kw).y.T, solve_ivp(f_plant, (0, 10), y0, **kw).y.T
    got = np.array([to_wind_axes(np.append(y, 0.0), wind.at(tk)) for y, tk in zip(plant, t, strict=True)])
    diff = np.abs(got - ref) / (1.0 + np.abs(ref))
    print(f"{name}: largest relative difference of the states after 10 s {diff.max():.2e}")
    assert diff.max() < TOL


def relative_state(sr: Array, st: Array, wind_r: Array) -> Array:
    """(V, beta, alpha, w_rel, psi, theta, phi, xi) of two inertial plant states."""
    Rr, Rt = dcm_bn(sr[0:4]), dcm_bn(st[0:4])
    R = Rr @ Rt.T
    return np.concatenate(
        (flow(Rr @ (sr[7:10] - wind_r)), sr[4:7] - R @ st[4:7], angles(R), Rt @ (sr[10:13] - st[10:13]))
    )


def test_relative_equations_agree_with_differencing_two_plant_aircraft() -> None:
    """lee.md 3.2 against the plant flown twice, each aircraft in a wind of its own that varies with time."""
    rng = np.random.default_rng(36)
    rec, tan = load_aircraft("learjet24"), load_aircraft("kc135r")
    par_r, par_t = plant_parameters(rec), plant_parameters(tan)
    b, worst = wa.body(rec, AIRCRAFT["learjet24"]), 0.0
    for _ in range(100):
        xr, ur = random_case(rng, "learjet24")
        xt, ut = random_case(rng, "kc135r")
        xr[6:9] = xt[6:9] + rng.uniform(-0.3, 0.3, 3)  # not far from formation, so that the angles stay regular
        xr[9:12] = xt[9:12] + rng.uniform(-80, 80, 3)
        wr, wt, t = Wind(rng), Wind(rng), rng.uniform(0, 50)
        sr = plant_state(xr, ur, wr.at(t), AIRCRAFT["learjet24"] - rec.mass.empty_kg)
        st = plant_state(xt, ut, wt.at(t), AIRCRAFT["kc135r"] - tan.mass.empty_kg)
        dr = plant_rates(sr, ur, np.concatenate((wr.at(t), np.zeros(3))), par_r)
        dt = plant_rates(st, ut, np.concatenate((wt.at(t), np.zeros(3))), par_t)
        got = along(lambda h: relative_state(sr[: n.N_RIGID] + h * dr, st[: n.N_RIGID] + h * dt, wr.at(t + h)), 2e-3)  # noqa: B023
        x = relative_state(sr, st, wr.at(t))
        rho = wa.density(-sr[12])
        want = wa.relative(b, x, ur, rho, wr.at(t), wr.rate(t), dcm_bn(st[0:4]), st[4:7], dt[4:7], st[7:10])
        worst = max(worst, float(np.abs((got - want) / (SCALE + np.abs(want))).max()))
    print(f"relative equations: largest scaled difference of the rates {worst:.2e}")
    assert worst < TOL


def onboard_rates(x: Array, u: Array, rho: float, P: Array, wind: Array) -> Array:
    """free_rates of the onboard model, first 12 entries."""
    d = np.zeros(15)
    free_rates(np.concatenate((x, wind)), u, rho, P, np.zeros(9), np.zeros(9), d)
    assert not d[12:].any()
    return d[:12]


@pytest.mark.parametrize("name", AIRCRAFT)
def test_onboard_free_rates_agree_with_the_wind_axis_equations(name: str) -> None:
    """In steady wind (the onboard model holds it constant), sideslip included: force in wind axes, lee.md section 2."""
    rng = np.random.default_rng(15)
    ac = load_aircraft(name)
    P, b, worst = onboard_parameters(ac, AIRCRAFT[name]), wa.body(ac, AIRCRAFT[name]), np.zeros(12)
    for _ in range(300):
        x, u = random_case(rng, name)
        wind = rng.uniform(-20, 20, 3)
        got = onboard_rates(x, u, wa.density(-x[11]), P, wind)
        want = wa.single(b, x, u, wind, np.zeros(3), np.zeros(3))
        worst = np.maximum(worst, np.abs((got - want) / (SCALE + np.abs(want))))
    print(f"{name}: largest scaled difference of the onboard rates {worst.max():.2e}")
    assert worst.max() < TOL, f"{name}: by state {np.array2string(worst, precision=2)}"


@pytest.mark.parametrize("name", AIRCRAFT)
def test_onboard_free_rates_agree_with_the_plant(name: str) -> None:
    """Same aircraft, same state, steady wind: onboard model against the plant's derivative, sideslip included."""
    rng = np.random.default_rng(16)
    ac = load_aircraft(name)
    P, par, worst = onboard_parameters(ac, AIRCRAFT[name]), plant_parameters(ac), np.zeros(12)
    for _ in range(100):
        x, u = random_case(rng, name)
        wind = Wind(rng)
        wind.amp[:] = 0.0
        s = plant_state(x, u, wind.at(0.0), AIRCRAFT[name] - ac.mass.empty_kg)
        want = plant_in_wind_axes(s, u, par, wind, np.zeros(3), 0.0)
        got = onboard_rates(x, u, wa.density(-x[11]), P, wind.at(0.0))
        worst = np.maximum(worst, np.abs((got - want) / (SCALE + np.abs(want))))
    print(f"{name}: onboard against plant, largest scaled difference {worst.max():.2e}")
    assert worst.max() < TOL, f"{name}: by state {np.array2string(worst, precision=2)}"


def test_onboard_relative_rates_agree_with_the_relative_equations() -> None:
    """relative_rates against lee.md 3.2 in steady wind, sideslip included; xi-dot also from relative_velocity alone."""
    rng = np.random.default_rng(62)
    ac = load_aircraft("learjet24")
    P, b, worst = onboard_parameters(ac, 4989.5), wa.body(ac, 4989.5), np.zeros(12)
    for _ in range(300):
        x, u = random_case(rng, "learjet24")
        x[3:6], x[6:9], x[9:12] = rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(-80, 80, 3)
        wind = rng.uniform(-20, 20, 3)
        r_bti = wa.r_bi(rng.uniform(-3, 3), rng.uniform(-0.2, 0.2), rng.uniform(-0.6, 0.6))
        w_t, w_t_dot, v_t = rng.uniform(-0.1, 0.1, 3), rng.uniform(-0.1, 0.1, 3), rng.uniform(-200, 200, 3)
        tk = np.concatenate((r_bti.ravel(), w_t, w_t_dot, v_t))
        d, R, fm, v = np.zeros(15), np.zeros(9), np.zeros(9), np.zeros(3)
        x15 = np.concatenate((x, wind))
        relative_rates(x15, u, 0.59, P, tk, R, fm, d)
        relative_velocity(x15, tk, R, v)
        want = wa.relative(b, x, u, 0.59, wind, np.zeros(3), r_bti, w_t, w_t_dot, v_t)
        worst = np.maximum(worst, np.abs((d[:12] - want) / (SCALE + np.abs(want))))
        assert np.abs(v - want[9:12]).max() < 1e-9
    print(f"onboard relative rates: largest scaled difference {worst.max():.2e}")
    assert worst.max() < TOL, f"by state {np.array2string(worst, precision=2)}"


@pytest.mark.parametrize("name", AIRCRAFT)
def test_onboard_specific_force_completes_newton_in_inertial_axes(name: str) -> None:
    """fm[0:3] rotated to NED plus gravity is the acceleration whose integral the estimator publishes."""
    rng = np.random.default_rng(17)
    ac = load_aircraft(name)
    P, par = onboard_parameters(ac, AIRCRAFT[name]), plant_parameters(ac)
    for _ in range(50):
        x, u = random_case(rng, name)
        x[1] = 0.0  # wing-level flow: the axes of the side force and drag do not matter
        wind, R, fm, d = rng.uniform(-20, 20, 3), np.zeros(9), np.zeros(9), np.zeros(15)
        free_rates(np.concatenate((x, wind)), u, wa.density(-x[11]), P, R, fm, d)
        s = plant_state(x, u, wind, AIRCRAFT[name] - ac.mass.empty_kg)
        acc = plant_rates(s, u, np.concatenate((wind, np.zeros(3))), par)[7:10]
        assert np.abs(R.reshape(3, 3).T @ fm[:3] + wa.G - acc).max() < 1e-7
