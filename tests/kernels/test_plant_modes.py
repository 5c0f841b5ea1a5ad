"""Trim and linearised modes of both aircraft against aircraft-data.md sections 1.4 and 2.4 (two solvers agree there)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from sim_plant.aircraft.sixdof.eom import derivative
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.trim import observation, trim
from sim_plant.kernels import layout as n
from sim_plant.kernels.rot import euler_from_quat, quat_dcm, quat_from_euler

# mass, V, alpha deg, de deg, thrust kN, short period (rad/s, zeta), phugoid, Dutch roll, roll s, spiral rad/s
ROWS = [
    ("learjet24", 5896.7, 190, 1.11, 1.83, 5.95, (3.73, 0.46), (0.0774, 0.062), (2.11, 0.071), 1.24, -0.0025),
    ("learjet24", 5896.7, 195, 0.97, 1.90, 6.15, (3.83, 0.46), (0.0762, 0.064), (2.17, 0.072), 1.22, -0.0025),
    ("learjet24", 5896.7, 200, 0.85, 1.97, 6.37, (3.93, 0.46), (0.0751, 0.066), (2.22, 0.072), 1.19, -0.0024),
    ("learjet24", 4989.5, 190, 0.70, 2.05, 5.65, (3.83, 0.48), (0.0766, 0.071), (2.39, 0.074), 0.76, -0.0026),
    ("learjet24", 4989.5, 195, 0.58, 2.11, 5.87, (3.93, 0.48), (0.0753, 0.074), (2.45, 0.075), 0.74, -0.0025),
    ("learjet24", 4989.5, 200, 0.48, 2.17, 6.11, (4.03, 0.48), (0.0743, 0.076), (2.51, 0.075), 0.72, -0.0025),
    ("learjet24", 4082.3, 195, 0.19, 2.32, 5.64, (4.05, 0.52), (0.0742, 0.089), (2.91, 0.055), 0.26, -0.0026),
    ("kc135r", 85000.0, 195, 1.58, 1.50, 55.2, (1.79, 0.47), (0.0749, 0.034), (1.46, 0.098), 0.69, 0.0019),
    ("kc135r", 100000.0, 190, 2.64, 0.58, 59.7, (1.59, 0.44), (0.0770, 0.029), (1.31, 0.090), 0.83, 0.0019),
    ("kc135r", 100000.0, 195, 2.36, 0.82, 60.7, (1.63, 0.44), (0.0758, 0.030), (1.35, 0.090), 0.81, 0.0018),
    ("kc135r", 100000.0, 200, 2.10, 1.04, 61.9, (1.67, 0.44), (0.0747, 0.030), (1.38, 0.089), 0.79, 0.0018),
    ("kc135r", 120000.0, 190, 3.73, -0.38, 69.0, (1.43, 0.41), (0.0778, 0.026), (1.21, 0.081), 0.99, 0.0019),
    ("kc135r", 120000.0, 195, 3.40, -0.09, 69.5, (1.47, 0.41), (0.0766, 0.027), (1.23, 0.081), 0.97, 0.0018),
    ("kc135r", 120000.0, 200, 3.09, 0.18, 70.2, (1.51, 0.41), (0.0755, 0.027), (1.26, 0.081), 0.94, 0.0018),
]


def trimmed(name: str, mass: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Trimmed state in still air at 7010 m, and the parameter vector."""
    ac = load_aircraft(name)
    par = parameter_vector(ac)
    s = trim(np.array([0.0, 0.0, -7010.0]), np.array([speed, 0.0, 0.0]), np.zeros(n.NW), mass - ac.mass.empty_kg, par)
    return s, par


def linearise(s: np.ndarray, par: np.ndarray) -> np.ndarray:
    """Jacobian [8, 8] of u, v, w, p, q, r, phi, theta at constant thrust, by central differences."""

    def f(z: np.ndarray) -> np.ndarray:
        u, w, phi, theta = z[0:3], z[3:6], z[6], z[7]
        x = s.copy()
        x[0:4] = quat_from_euler(0.0, theta, phi)
        c = np.array(quat_dcm(*x[0:4])).reshape(3, 3)
        x[n.S_V : n.S_V + 3], x[n.S_W : n.S_W + 3] = c @ u, w
        out = np.zeros(n.N_RIGID)
        derivative(x, *s[n.S_SURF : n.S_SURF + 3], 0.0, np.zeros(n.NW), s[n.S_FUEL], par, out)
        udot = c.T @ out[n.S_V : n.S_V + 3] - np.cross(w, u)
        p, q, r = w
        phidot = p + math.tan(theta) * (q * math.sin(phi) + r * math.cos(phi))
        return np.array([*udot, *out[n.S_W : n.S_W + 3], phidot, q * math.cos(phi) - r * math.sin(phi)])

    c = np.array(quat_dcm(*s[0:4])).reshape(3, 3)
    _, theta, phi = euler_from_quat(*s[0:4])
    z0 = np.array([*(c.T @ s[n.S_V : n.S_V + 3]), *s[n.S_W : n.S_W + 3], phi, theta])
    step = np.array([1e-3] * 3 + [1e-5] * 5)
    return np.stack([(f(z0 + d) - f(z0 - d)) / (2 * d.sum()) for d in np.diag(step)], axis=1)


def modes(a: np.ndarray) -> tuple[list[tuple[float, float]], list[float]]:
    """Oscillatory (frequency, damping) and real roots of a system matrix, fast first."""
    e = np.linalg.eigvals(a)
    osc = sorted(((abs(x), -x.real / abs(x)) for x in e if x.imag > 1e-6), reverse=True)
    return osc, sorted(x.real for x in e if abs(x.imag) <= 1e-6)


@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r[0]}-{r[1]:.0f}-{r[2]}")
def test_trim_and_modes_match_the_reference_tables(row: tuple) -> None:
    name, mass, speed, alpha, de, thrust, short, phugoid, dutch, roll, spiral = row
    s, par = trimmed(name, mass, speed)
    o = observation(s, np.zeros(n.NW), par)
    assert abs(math.degrees(o[n.O_ALPHA]) - alpha) < 0.006
    assert abs(math.degrees(s[n.S_SURF + 1]) - de) < 0.006
    assert abs(s[n.S_T] / 1e3 - thrust) < (0.0075 if thrust < 20.0 else 0.06)  # the last digit printed
    a = linearise(s, par)
    lon, lat = [0, 2, 4, 7], [1, 3, 5, 6]
    (sp, ph), _ = modes(a[np.ix_(lon, lon)])
    (dr, *_), real = modes(a[np.ix_(lat, lat)])
    assert abs(sp[0] / short[0] - 1) < 0.005 and abs(sp[1] - short[1]) < 0.006
    # the tables include the compressibility term CL_u = CL M^2 / (1 - M^2), the aircraft files do not: frequency^2 is
    # proportional to 2 CL + CL_u, damping * frequency is unchanged
    mach2 = (speed / 312.23) ** 2
    shift = math.sqrt(1.0 + 0.5 * mach2 / (1.0 - mach2))
    assert abs(ph[0] * shift / phugoid[0] - 1) < 0.01 and abs(ph[1] / shift - phugoid[1]) < 0.004
    assert abs(dr[0] / dutch[0] - 1) < 0.006 and abs(dr[1] - dutch[1]) < 0.002
    assert abs(-1.0 / real[0] - roll) < 0.01
    assert abs(real[1] - spiral) < 1e-4


def test_symmetric_flight_couples_nothing_sideways() -> None:
    a = linearise(*trimmed("kc135r", 120000.0, 195))
    lon, lat = [0, 2, 4, 7], [1, 3, 5, 6]
    assert np.max(np.abs(a[np.ix_(lon, lat)])) < 1e-6
    assert np.max(np.abs(a[np.ix_(lat, lon)])) < 1e-6
