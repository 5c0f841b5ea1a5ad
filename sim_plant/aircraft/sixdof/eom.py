"""Rigid-body equations of motion of an aircraft, and their Runge-Kutta step.

Only the wind enters, never its derivative: the air-relative velocity is v_n - W (lee.md section 3.3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.aircraft.sixdof.propulsion import bracket, thrust_available
from sim_plant.kernels import layout as n
from sim_plant.kernels.earth import air_height, rigid_rates
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_normalise
from sim_plant.kernels.servo import servo_move, transition

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

    Surfaces [rad], throttle [-], `w` effective wind, fuel [kg]. Newton and Euler: rigid_rates of kernels/earth.py.
    Thrust lags its command (throttle, not below idle, of the thrust available) with time constant tau; without fuel
    it runs down to nothing. Failed engines: P_POWER of the whole, and the moment S_YAW by the same lag. The spool's limit
    holds its rise: airframe.md 5.
    """
    mass = par[n.P_EMPTY] + fuel
    ixx, iyy, izz, ixz = inertia(mass, par)
    rates(x, da, de, dr, throttle, w, mass, fuel > 0.0, ixx, iyy, izz, ixz, par, out)


@jit
def rates(
    x: Arr,
    da: float,
    de: float,
    dr: float,
    throttle: float,
    w: Arr,
    mass: float,
    fuelled: bool,
    ixx: float,
    iyy: float,
    izz: float,
    ixz: float,
    par: Arr,
    out: Arr,
) -> None:
    """`derivative` with the inertia of a mass [kg] worked out; fuelled: whether there is fuel left."""
    fx, fy, fz, mx, my, mz, v_air, _, _, _, _, _, rho, a = loads(x, da, de, dr, w, mass, par)
    rigid_rates(x, fx, fy, fz, mx, my, mz, mass, ixx, iyy, izz, ixz, par, out)
    most = 0.0
    if fuelled:
        most = thrust_available(air_height(-x[n.S_P + 2], par), v_air / a, rho, par)
    spool(x, throttle, most, par, out)


@jit
def spool(x: Arr, throttle: float, most: float, par: Arr, out: Arr) -> None:
    """The part of `rates` that is thrust and its moment; most: thrust available [N], 0 without fuel."""
    t_cmd = max(throttle, par[n.P_IDLE]) * most
    out[n.S_T] = (par[n.P_POWER] * t_cmd - x[n.S_T]) / par[n.P_TAU]
    out[n.S_YAW] = (par[n.P_ARM] * t_cmd - x[n.S_YAW]) / par[n.P_TAU]
    if par[n.P_SPOOL_1] > 0.0:
        top = par[n.P_POWER] * most
        rise = par[n.P_SPOOL_0] * top + (par[n.P_SPOOL_1] - par[n.P_SPOOL_0]) * x[n.S_T]
        out[n.S_T] = min(out[n.S_T], max(rise, 0.0))


@jit
def fly(
    s: Arr,
    aileron: float,
    elevator: float,
    rudder: float,
    throttle: float,
    jam0: float,
    jam1: float,
    jam2: float,
    transfer_kgps: float,
    c: Arr,
    w: Arr,
    par: Arr,
    dt: float,
    scratch: Arr,
) -> None:
    """step with the command [rad, -], jam flags and transfer as numbers: they are put into `c`."""
    c[0], c[1], c[2], c[n.C_THROTTLE] = aileron, elevator, rudder, throttle
    c[n.C_JAM], c[n.C_JAM + 1], c[n.C_JAM + 2], c[n.C_TRANSFER] = jam0, jam1, jam2, transfer_kgps
    step(s, c, w, par, dt, scratch)


@jit
def step(s: Arr, c: Arr, w: Arr, par: Arr, dt: float, scratch: Arr) -> None:
    """Advance one aircraft by dt [s] in place: servos, then classical Runge-Kutta, then fuel.

    `c` command vector, `w` wind held over the step, `scratch` [4, NS] work space. The servos run first in four exact
    sub-steps, so each Runge-Kutta stage meets the surface angles of its own time.
    """
    fuel = s[n.S_FUEL]
    mass = par[n.P_EMPTY] + fuel
    ixx, iyy, izz, ixz = inertia(mass, par)
    thr = min(1.0, max(0.0, c[n.C_THROTTLE]))
    rates(
        s, s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2], thr, w, mass, fuel > 0.0, ixx, iyy, izz, ixz, par, scratch[1]
    )  # fmt: skip
    go_on(s, c, w, par, dt, scratch)


@jit
def go_on(s: Arr, c: Arr, w: Arr, par: Arr, dt: float, scratch: Arr) -> None:
    """`step` with the rates where it begins in scratch[1]."""
    h = 0.25 * dt
    f11, f12, f21, f22 = transition(par, h)
    servo_move(s, c, par, h, f11, f12, f21, f22)
    servo_move(s, c, par, h, f11, f12, f21, f22)
    a1, e1, r1 = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    servo_move(s, c, par, h, f11, f12, f21, f22)
    servo_move(s, c, par, h, f11, f12, f21, f22)
    a2, e2, r2 = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    thr = min(1.0, max(0.0, c[n.C_THROTTLE]))
    fuel = s[n.S_FUEL]
    mass, fuelled = par[n.P_EMPTY] + fuel, fuel > 0.0
    ixx, iyy, izz, ixz = inertia(mass, par)
    x, k, acc = scratch[0], scratch[1], scratch[2]
    for i in range(n.N_RIGID):
        acc[i] = k[i]
        x[i] = s[i] + 0.5 * dt * k[i]
    rates(x, a1, e1, r1, thr, w, mass, fuelled, ixx, iyy, izz, ixz, par, k)
    for i in range(n.N_RIGID):
        acc[i] += 2.0 * k[i]
        x[i] = s[i] + 0.5 * dt * k[i]
    rates(x, a1, e1, r1, thr, w, mass, fuelled, ixx, iyy, izz, ixz, par, k)
    for i in range(n.N_RIGID):
        acc[i] += 2.0 * k[i]
        x[i] = s[i] + dt * k[i]
    rates(x, a2, e2, r2, thr, w, mass, fuelled, ixx, iyy, izz, ixz, par, k)
    for i in range(n.N_RIGID):
        s[i] += dt / 6.0 * (acc[i] + k[i])
    quat_normalise(s, 0)
    fuel += (c[n.C_TRANSFER] - par[n.P_TSFC] * s[n.S_T]) * dt
    s[n.S_FUEL] = min(par[n.P_FUEL_CAP], max(0.0, fuel))
