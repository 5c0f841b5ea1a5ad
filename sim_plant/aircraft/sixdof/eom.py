"""Rigid-body equations of motion in body axes over a flat earth, their Runge-Kutta step, and what an observer sees.

Only the wind enters, never its derivative: the air-relative velocity is v_n - W (lee.md section 3.3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.aircraft.sixdof.propulsion import bracket, thrust_available
from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm, quat_normalise, quat_rate
from sim_plant.kernels.servo import servo_step

Arr = NDArray[np.float64]


@jit
def inertia(mass: float, par: Arr) -> tuple[float, float, float, float]:
    """Ixx, Iyy, Izz, Ixz [kg m^2] at mass [kg], linear between the file's points, end values held."""
    k = int(par[n.P_NI])
    i, f = bracket(par, n.P_TABLES, k, mass)
    j = n.P_TABLES + k + i
    if k < 2:
        return par[j], par[j + k], par[j + 2 * k], par[j + 3 * k]
    return (
        par[j] + f * (par[j + 1] - par[j]),
        par[j + k] + f * (par[j + k + 1] - par[j + k]),
        par[j + 2 * k] + f * (par[j + 2 * k + 1] - par[j + 2 * k]),
        par[j + 3 * k] + f * (par[j + 3 * k + 1] - par[j + 3 * k]),
    )


@jit
def derivative(
    x: Arr, da: float, de: float, dr: float, throttle: float, w: Arr, fuel: float, par: Arr, out: Arr
) -> None:
    """Time derivative of the rigid-body state and thrust, written to `out` [N_RIGID].

    Surfaces [rad], throttle [-], `w` effective wind, fuel [kg]. Newton in NED: v' = C_nb F/m + g; Euler in body axes
    with Ixz: I w' = M - w x I w; thrust lags its command (throttle, not below idle, of the thrust available) with time
    constant tau; without fuel it runs down to nothing. Source: Etkin, Dynamics of Atmospheric Flight, eqs. 5.6.
    """
    mass = par[n.P_EMPTY] + fuel
    fx, fy, fz, mx, my, mz, v_air, _, _, _, _, _, rho, a = loads(x, da, de, dr, w, mass, par)
    p, q, r = x[n.S_W], x[n.S_W + 1], x[n.S_W + 2]
    d0, d1, d2, d3 = quat_rate(x[0], x[1], x[2], x[3], p, q, r)
    out[0], out[1], out[2], out[3] = d0, d1, d2, d3
    ixx, iyy, izz, ixz = inertia(mass, par)
    hx, hy, hz = ixx * p - ixz * r, iyy * q, izz * r - ixz * p
    tx, ty, tz = mx - (q * hz - r * hy), my - (r * hx - p * hz), mz - (p * hy - q * hx)
    det = 1.0 / (ixx * izz - ixz * ixz)
    out[4], out[5], out[6] = (izz * tx + ixz * tz) * det, ty / iyy, (ixz * tx + ixx * tz) * det
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(x[0], x[1], x[2], x[3])
    im = 1.0 / mass
    out[7] = (c00 * fx + c01 * fy + c02 * fz) * im
    out[8] = (c10 * fx + c11 * fy + c12 * fz) * im
    out[9] = (c20 * fx + c21 * fy + c22 * fz) * im + n.G0
    out[10], out[11], out[12] = x[n.S_V], x[n.S_V + 1], x[n.S_V + 2]
    t_cmd = 0.0
    if fuel > 0.0:
        t_cmd = max(throttle, par[n.P_IDLE]) * thrust_available(-x[n.S_P + 2], v_air / a, rho, par)
    out[13] = (t_cmd - x[n.S_T]) / par[n.P_TAU]


@jit
def step(s: Arr, c: Arr, w: Arr, par: Arr, dt: float, scratch: Arr) -> None:
    """Advance one aircraft by dt [s] in place: servos, then classical Runge-Kutta, then fuel.

    `c` command vector, `w` wind held over the step, `scratch` [4, NS] work space. The servos run first in four exact
    sub-steps, so each Runge-Kutta stage meets the surface angles of its own time.
    """
    a0, e0, r0 = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    h = 0.25 * dt
    servo_step(s, c, par, h)
    servo_step(s, c, par, h)
    a1, e1, r1 = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    servo_step(s, c, par, h)
    servo_step(s, c, par, h)
    a2, e2, r2 = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    thr = min(1.0, max(0.0, c[n.C_THROTTLE]))
    fuel = s[n.S_FUEL]
    x, k, acc = scratch[0], scratch[1], scratch[2]
    derivative(s, a0, e0, r0, thr, w, fuel, par, k)
    for i in range(n.N_RIGID):
        acc[i] = k[i]
        x[i] = s[i] + 0.5 * dt * k[i]
    derivative(x, a1, e1, r1, thr, w, fuel, par, k)
    for i in range(n.N_RIGID):
        acc[i] += 2.0 * k[i]
        x[i] = s[i] + 0.5 * dt * k[i]
    derivative(x, a1, e1, r1, thr, w, fuel, par, k)
    for i in range(n.N_RIGID):
        acc[i] += 2.0 * k[i]
        x[i] = s[i] + dt * k[i]
    derivative(x, a2, e2, r2, thr, w, fuel, par, k)
    for i in range(n.N_RIGID):
        s[i] += dt / 6.0 * (acc[i] + k[i])
    quat_normalise(s, 0)
    fuel += (c[n.C_TRANSFER] - par[n.P_TSFC] * s[n.S_T]) * dt
    s[n.S_FUEL] = min(par[n.P_FUEL_CAP], max(0.0, fuel))
