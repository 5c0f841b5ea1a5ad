"""Plant kernels against published values and invariants: atmosphere, attitude, servo, propulsion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.propulsion import thrust_available
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa, pressure_altitude
from sim_plant.kernels.rot import euler_from_quat, quat_dcm, quat_from_euler, quat_mul, quat_normalise, quat_rate
from sim_plant.kernels.servo import servo_step

# US Standard Atmosphere 1976, geopotential height: T [K], p [Pa], rho [kg/m^3], a [m/s]
TABLE = [
    (0.0, 288.15, 101325.0, 1.2250, 340.29),
    (5000.0, 255.65, 54020.0, 0.73612, 320.53),
    (6096.0, 248.53, 46563.0, 0.6527, 316.03),
    (7010.0, 242.59, 41003.0, 0.5888, 312.23),
    (7620.0, 238.62, 37601.0, 0.5489, 309.67),
    (11000.0, 216.65, 22632.1, 0.36392, 295.07),
    (12192.0, 216.65, 18754.0, 0.3016, 295.07),
    (20000.0, 216.65, 5474.89, 0.08803, 295.07),
]
unit = st.floats(-1.0, 1.0)
angle = st.floats(-3.1, 3.1)


@pytest.mark.parametrize("row", TABLE)
def test_isa_matches_the_published_table(row: tuple[float, ...]) -> None:
    t, p, rho, a = isa(row[0])
    assert abs(t - row[1]) < 0.011
    assert abs(p / row[2] - 1.0) < 3e-5
    assert abs(rho / row[3] - 1.0) < 2e-4  # the table has four figures
    assert abs(a / row[4] - 1.0) < 3e-5


@settings(deadline=None)
@given(st.floats(-500.0, 19000.0))
def test_pressure_altitude_inverts_isa(h: float) -> None:
    assert abs(pressure_altitude(isa(h)[1]) - h) < 1e-6


@settings(deadline=None)
@given(angle, st.floats(-1.5, 1.5), angle)
def test_euler_angles_survive_the_quaternion(psi: float, theta: float, phi: float) -> None:
    back = euler_from_quat(*quat_from_euler(psi, theta, phi))
    assert np.allclose(back, (psi, theta, phi), atol=1e-7)


@settings(deadline=None)
@given(angle, st.floats(-1.5, 1.5), angle)
def test_dcm_is_a_proper_rotation_and_matches_elementary_rotations(psi: float, theta: float, phi: float) -> None:
    c = np.array(quat_dcm(*quat_from_euler(psi, theta, phi))).reshape(3, 3)
    assert np.allclose(c @ c.T, np.eye(3), atol=1e-14)
    assert abs(np.linalg.det(c) - 1.0) < 1e-13

    def rz(a: float) -> np.ndarray:
        return np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])

    def ry(a: float) -> np.ndarray:
        return np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])

    def rx(a: float) -> np.ndarray:
        return np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])

    assert np.allclose(c, rz(psi) @ ry(theta) @ rx(phi), atol=1e-14)


@settings(deadline=None)
@given(st.lists(unit, min_size=8, max_size=8).filter(lambda x: all(np.linalg.norm(x[i : i + 4]) > 0.1 for i in (0, 4))))
def test_quaternion_product_composes_rotations(x: list[float]) -> None:
    v = np.array(x)
    quat_normalise(v, 0)
    quat_normalise(v, 4)
    a, b = (np.array(quat_dcm(*v[i : i + 4])).reshape(3, 3) for i in (0, 4))
    assert np.allclose(np.array(quat_dcm(*quat_mul(*v))).reshape(3, 3), a @ b, atol=1e-13)


@settings(deadline=None)
@given(st.tuples(unit, unit, unit))
def test_quaternion_rate_turns_the_body_by_its_rates(w: tuple[float, float, float]) -> None:
    q = quat_from_euler(0.3, -0.2, 0.7)
    h = 1e-6
    c0 = np.array(quat_dcm(*q)).reshape(3, 3)
    moved = np.array(q) + h * np.array(quat_rate(*q, *w))
    c1 = np.array(quat_dcm(*moved)).reshape(3, 3)
    skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    assert np.allclose((c1 - c0) / h, c0 @ skew, atol=1e-5)


def _servo(cmd: float, steps: int, h: float, rate: float = 1e9) -> tuple[np.ndarray, np.ndarray]:
    par = parameter_vector(load_aircraft("learjet24"))
    par[n.P_RATE : n.P_RATE + 3] = rate
    s, c, out = np.zeros(n.NS), np.zeros(n.NC), []
    c[0:3] = cmd
    for _ in range(steps):
        servo_step(s, c, par, h)
        out.append(s[n.S_SURF + 1])
    return np.array(out), par


def test_servo_follows_the_second_order_step_response() -> None:
    got, par = _servo(0.1, 200, 0.0025)
    wn, z = par[n.P_WN], par[n.P_ZETA]
    t = 0.0025 * np.arange(1, 201)
    wd = wn * math.sqrt(1 - z * z)
    exact = 0.1 * (1 - np.exp(-z * wn * t) * (np.cos(wd * t) + z / math.sqrt(1 - z * z) * np.sin(wd * t)))
    assert np.max(np.abs(got - exact)) < 1e-12


def test_servo_keeps_its_rate_and_travel_limits() -> None:
    limit = math.radians(40.0)
    got, par = _servo(1.0, 400, 0.0025, limit)
    assert np.max(np.abs(np.diff(got))) <= limit * 0.0025 * (1 + 1e-12)
    assert np.max(got) <= par[n.P_HI + 1]
    assert abs(got[-1] - par[n.P_HI + 1]) < 1e-6


def test_a_jammed_surface_stays() -> None:
    par = parameter_vector(load_aircraft("kc135r"))
    s, c = np.zeros(n.NS), np.zeros(n.NC)
    s[n.S_SURF + 1], c[1], c[n.C_JAM + 1], c[2] = 0.02, -0.1, 1.0, 0.1
    for _ in range(100):
        servo_step(s, c, par, 0.0025)
    assert s[n.S_SURF + 1] == 0.02
    assert s[n.S_SURF + 2] > 0.05


def test_thrust_lapse_matches_the_sources() -> None:
    """Bypass law 0.40 at 7010 m, M 0.62 (154 kN); J85 table 0.486 at 7010 m, M 0.6 (aircraft-data.md 1.3, 2.3)."""
    tanker, jet = (parameter_vector(load_aircraft(f)) for f in ("kc135r", "learjet24"))
    rho = isa(7010.0)[2]
    assert abs(thrust_available(7010.0, 0.62, rho, tanker) / 154e3 - 1.0) < 0.01
    assert abs(thrust_available(7010.0, 0.6, rho, jet) / 26244.0 - 0.486) < 0.001
    # at a node of the table, and held beyond its ends
    assert thrust_available(6096.0, 0.6, rho, jet) == pytest.approx(0.532 * 26244.0, rel=1e-12)
    assert thrust_available(20000.0, 2.0, rho, jet) == pytest.approx(0.275 * 26244.0, rel=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 15000.0), st.floats(0.0, 0.9))
def test_compiled_and_interpreted_kernels_agree_to_the_bit(h: float, mach: float) -> None:
    par = parameter_vector(load_aircraft("learjet24"))
    plain = getattr(isa, "py_func", isa)
    assert plain(h) == isa(h)
    rho = isa(h)[2]
    assert getattr(thrust_available, "py_func", thrust_available)(h, mach, rho, par) == thrust_available(
        h, mach, rho, par
    )
