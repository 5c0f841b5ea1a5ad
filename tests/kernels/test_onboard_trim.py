"""Trim, modes and linearisation of the onboard model against aircraft-data.md sections 1.4 and 2.4 and finer
derivatives.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.kernels.atmosphere import density
from flightsw.sixdof.params import parameter_vector
from flightsw.sixdof.trim import (
    TrimError,
    free_derivative,
    linearise_free,
    linearise_relative,
    relative_derivative,
    tanker_stage,
    trim_free,
    trim_relative,
)

# mass [kg], V [m/s], alpha, elevator [deg], thrust [kN], short period, phugoid, Dutch roll (rad/s, zeta), roll s,
# spiral
LEARJET = [
    (5896.7, 190, 1.11, 1.83, 5.95, (3.73, 0.46), (0.0774, 0.062), (2.11, 0.071), 1.24, -0.0025),
    (5896.7, 195, 0.97, 1.90, 6.15, (3.83, 0.46), (0.0762, 0.064), (2.17, 0.072), 1.22, -0.0025),
    (5896.7, 200, 0.85, 1.97, 6.37, (3.93, 0.46), (0.0751, 0.066), (2.22, 0.072), 1.19, -0.0024),
    (4989.5, 190, 0.70, 2.05, 5.65, (3.83, 0.48), (0.0766, 0.071), (2.39, 0.074), 0.76, -0.0026),
    (4989.5, 195, 0.58, 2.11, 5.87, (3.93, 0.48), (0.0753, 0.074), (2.45, 0.075), 0.74, -0.0025),
    (4989.5, 200, 0.48, 2.17, 6.11, (4.03, 0.48), (0.0743, 0.076), (2.51, 0.075), 0.72, -0.0025),
    (4082.3, 195, 0.19, 2.32, 5.64, (4.05, 0.52), (0.0742, 0.089), (2.91, 0.055), 0.26, -0.0026),
]
TANKER = [
    (85e3, 195, 1.58, 1.50, 55.2, (1.79, 0.47), (0.0749, 0.034), (1.46, 0.098), 0.69, 0.0019),
    (100e3, 190, 2.64, 0.58, 59.7, (1.59, 0.44), (0.0770, 0.029), (1.31, 0.090), 0.83, 0.0019),
    (100e3, 195, 2.36, 0.82, 60.7, (1.63, 0.44), (0.0758, 0.030), (1.35, 0.090), 0.81, 0.0018),
    (100e3, 200, 2.10, 1.04, 61.9, (1.67, 0.44), (0.0747, 0.030), (1.38, 0.089), 0.79, 0.0018),
    (120e3, 190, 3.73, -0.38, 69.0, (1.43, 0.41), (0.0778, 0.026), (1.21, 0.081), 0.99, 0.0019),
    (120e3, 195, 3.40, -0.09, 69.5, (1.47, 0.41), (0.0766, 0.027), (1.23, 0.081), 0.97, 0.0018),
    (120e3, 200, 3.09, 0.18, 70.2, (1.51, 0.41), (0.0755, 0.027), (1.26, 0.081), 0.94, 0.0018),
]
ROWS = [("learjet24", *r) for r in LEARJET] + [("kc135r", *r) for r in TANKER]
LON, LAT = [0, 2, 4, 7], [1, 3, 5, 8]
H = 7010.0
TURNS = [math.radians(x) for x in (-1.7, 0.0, 1.7)]


def modes(a: np.ndarray) -> tuple[list[tuple[float, float]], list[float]]:
    """Oscillatory (frequency, damping) fast first, and real roots ascending."""
    e = np.linalg.eigvals(a)
    return sorted(((abs(x), -x.real / abs(x)) for x in e if x.imag > 1e-6), reverse=True), sorted(
        x.real for x in e if abs(x.imag) <= 1e-6
    )


@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r[0]}-{r[1]:.0f}-{r[2]}")
def test_trim_and_modes_match_the_published_tables(row: tuple) -> None:
    name, mass, V, alpha, de, thrust, short, phugoid, dutch, roll, spiral = row
    ac = load_aircraft(name)
    t = trim_free(ac, mass, H, V, 0.0)
    assert abs(math.degrees(t.x[2]) - alpha) < 0.006
    assert abs(math.degrees(t.u[1]) - de) < 0.006
    assert abs(t.u[3] / 1e3 - thrust) < (0.0075 if thrust < 20 else 0.06)
    assert abs(t.x[1]) < 1e-9 and abs(t.x[8]) < 1e-9 and np.abs(t.u[[0, 2]]).max() < 1e-9
    A, _ = linearise_free(ac, mass, t)
    (sp, ph), _ = modes(A[np.ix_(LON, LON)])
    (dr, *_), real = modes(A[np.ix_(LAT, LAT)])
    assert abs(sp[0] / short[0] - 1) < 0.006 and abs(sp[1] - short[1]) < 0.006
    assert abs(dr[0] / dutch[0] - 1) < 0.008 and abs(dr[1] - dutch[1]) < 0.003
    assert abs(-1.0 / real[0] - roll) < 0.012
    assert abs(real[1] - spiral) < 1e-4
    # the tables hold the compressibility term CL_u = CL M^2/(1-M^2), the aircraft files do not: the phugoid's
    # stiffness is proportional to 2 CL + CL_u, its damping in rad/s is unchanged
    mach2 = (V / 312.23) ** 2
    shift = math.sqrt(1.0 + 0.5 * mach2 / (1.0 - mach2))
    assert abs(ph[0] * shift / phugoid[0] - 1) < 0.012 and abs(ph[1] / shift - phugoid[1]) < 0.004


@pytest.mark.parametrize("name", ["kc135r", "learjet24"])
@pytest.mark.parametrize("psi_dot", TURNS)
@pytest.mark.parametrize("V", [180.0, 200.0])
def test_a_turn_trim_is_a_steady_level_coordinated_turn(name: str, psi_dot: float, V: float) -> None:
    ac = load_aircraft(name)
    mass = {"kc135r": 120e3, "learjet24": 5300.0}[name]
    t = trim_free(ac, mass, H, V, psi_dot)
    d = free_derivative(t.x, t.u, density(H), parameter_vector(ac, mass))
    assert np.abs(d[0:6]).max() < 1e-8  # no acceleration of flow or rates
    assert (
        abs(d[6] - psi_dot) < 1e-10 and np.abs(d[7:9]).max() < 1e-10
    )  # turning at the rate asked for, attitude steady
    assert abs(d[11]) < 1e-7  # level
    assert abs(np.hypot(d[9], d[10]) - V) < 1e-9
    # bank of a coordinated turn: tan(phi) = V psi_dot / g (exact up to the pitch attitude and side force)
    assert abs(t.x[8] - math.atan(V * psi_dot / 9.80665)) < math.radians(0.4)


@pytest.mark.parametrize("V", [180.0, 200.0])
def test_left_and_right_turns_are_mirror_images(V: float) -> None:
    ac = load_aircraft("kc135r")
    left, right = (trim_free(ac, 120e3, H, V, s * TURNS[2]) for s in (-1, 1))
    mirror = np.array([1, -1, 1, -1, 1, -1, -1, 1, -1, 1, 1, 1, 1, 1, 1])
    assert np.allclose(left.x, mirror * right.x, atol=1e-8)
    assert np.allclose(left.u, [-right.u[0], right.u[1], -right.u[2], right.u[3]], rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("psi_dot", TURNS)
def test_receiver_trim_rests_in_the_tankers_frame(psi_dot: float) -> None:
    tan, rec = load_aircraft("kc135r"), load_aircraft("learjet24")
    tt = trim_free(tan, 120e3, H, 190.0, psi_dot)
    t = trim_relative(rec, 5300.0, tt, np.array([-35.5, 0.0, 8.5]))
    d = relative_derivative(t.x, t.u, density(H), parameter_vector(rec, 5300.0), tanker_stage(tt.x))
    assert np.abs(d).max() < 1e-6
    assert (t.x[9:12] == [-35.5, 0.0, 8.5]).all()
    # rigid-body kinematics: the receiver's speed is the tanker's plus w_T x xi
    v = tanker_stage(tt.x)[:9].reshape(3, 3) @ tanker_stage(tt.x)[15:18] + np.cross(tt.x[3:6], t.x[9:12])
    assert abs(t.x[0] - np.linalg.norm(v)) < 1e-6


@pytest.mark.parametrize("V", [0.0, 1.0, 8.0])
def test_a_speed_no_wing_flies_at_is_refused_by_name(V: float) -> None:
    """Also where the linear build-up has a root behind the stall (8 m/s: alpha 248 deg, negative thrust) or gives NaN
    (0).
    """
    with pytest.raises(TrimError, match=rf"learjet24 at {V:g} m/s"), np.errstate(all="ignore"):
        trim_free(load_aircraft("learjet24"), 5000.0, H, V, 0.0)


def richardson(fun, z: np.ndarray, scale: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Jacobian by central differences extrapolated twice (truncation of order h^6)."""
    cols = []
    for i in range(len(z)):
        e = np.zeros(len(z))
        e[i] = scale[i]
        d = [(fun(z + e / k) - fun(z - e / k)) * k / (2 * scale[i]) for k in (1, 2, 4)]
        first = [(4 * d[1] - d[0]) / 3, (4 * d[2] - d[1]) / 3]
        cols.append((16 * first[1] - first[0]) / 15)
    return np.array(cols).T


X_SCALE = np.array([1.0, *[0.01] * 8, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
U_SCALE = np.array([0.01, 0.01, 0.01, 500.0])


def assert_same_matrix(got: np.ndarray, want: np.ndarray) -> None:
    """Entry by entry, relative to the larger of the entry and a thousandth of its row's size."""
    row = np.abs(want).max(axis=1, keepdims=True)
    assert (np.abs(got - want) <= 1e-6 * (np.abs(want) + 1e-2 * row) + 1e-9).all(), np.abs(got - want).max()


@pytest.mark.parametrize("psi_dot", TURNS)
@pytest.mark.parametrize("name", ["kc135r", "learjet24"])
def test_free_linearisation_equals_a_finer_derivative(name: str, psi_dot: float) -> None:
    ac = load_aircraft(name)
    mass = {"kc135r": 120e3, "learjet24": 5300.0}[name]
    t = trim_free(ac, mass, H, 190.0, psi_dot)
    P, rho = parameter_vector(ac, mass), density(H)
    A, B = linearise_free(ac, mass, t)
    assert_same_matrix(A, richardson(lambda x: free_derivative(x, t.u, rho, P), t.x, X_SCALE))
    assert_same_matrix(B, richardson(lambda u: free_derivative(t.x, u, rho, P), t.u, U_SCALE))


@pytest.mark.parametrize("psi_dot", TURNS)
def test_relative_linearisation_equals_a_finer_derivative(psi_dot: float) -> None:
    tan, rec = load_aircraft("kc135r"), load_aircraft("learjet24")
    tt = trim_free(tan, 120e3, H, 190.0, psi_dot)
    t = trim_relative(rec, 5300.0, tt, np.array([-35.5, 0.0, 8.5]))
    P, rho, tk = parameter_vector(rec, 5300.0), density(H), tanker_stage(tt.x)
    A, B, Cv = linearise_relative(rec, 5300.0, tt, t)
    assert_same_matrix(A, richardson(lambda x: relative_derivative(x, t.u, rho, P, tk), t.x, X_SCALE))
    assert_same_matrix(B, richardson(lambda u: relative_derivative(t.x, u, rho, P, tk), t.u, U_SCALE))
    # C_v is the row of the rates that says how fast xi moves
    assert_same_matrix(Cv, A[9:12])
