"""A twin-jet transport in the vertical plane, in inertial velocities: forces are resolved along and across the air velocity.

State f [7]: x [m], height [m], velocity along x and up [m/s], pitch [rad], pitch rate [rad/s], thrust [N]. Controls u [2]: thrust
command [N], elevator [rad] (positive pitches down). Wind: downburst field at the aircraft plus a series of gusts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit
from sim_plant.wind.microburst_kernel import wind

Arr = NDArray[np.float64]
F_X, F_H, F_VX, F_VH, F_PITCH, F_RATE, F_THRUST, NF = 0, 1, 2, 3, 4, 5, 6, 7
# readings: height, ground speed, airspeed, incidence, pitch, pitch rate, climb rate, accelerations along x and up
(R_H, R_GROUND, R_AIR, R_ALPHA, R_PITCH, R_RATE, R_CLIMB, R_AX, R_AH, NR) = range(10)
(A_MASS, A_GRAV, A_RHO, A_AREA, A_CHORD, A_INERTIA, A_CL0, A_CLA, A_CLE, A_STALL, A_PEAK, A_CD0, A_CDK, A_CDS, A_CM0, A_CMA,
 A_CMQ, A_CME, A_LAG, A_TMAX, A_LAPSE, A_IDLE, A_FALL, A_FALL_RAD, NA) = range(25)  # fmt: skip


@jit
def lift_coefficient(alpha: float, a: Arr) -> float:
    """C_L of the wing-body at incidence alpha [rad]: straight to A_STALL, a parabola to its top at A_PEAK, then falling by A_FALL
    over about A_FALL_RAD."""
    d = alpha - a[A_STALL]
    straight = a[A_CL0] + a[A_CLA] * alpha
    if d <= 0.0:
        return straight
    k = a[A_CLA] / (2.0 * (a[A_PEAK] - a[A_STALL]))
    e = 2.0 * (a[A_PEAK] - a[A_STALL])
    if d <= e:
        return straight - k * d * d
    edge = a[A_CL0] + a[A_CLA] * (a[A_STALL] + e) - k * e * e
    return edge - a[A_FALL] * (1.0 - math.exp(-(d - e) / a[A_FALL_RAD]))


@jit
def forces(air: float, alpha: float, rate: float, elevator: float, a: Arr) -> tuple[float, float, float]:
    """Lift [N], drag [N], pitching moment [N m] at airspeed `air` [m/s]."""
    push = 0.5 * a[A_RHO] * air * air * a[A_AREA]
    cl = lift_coefficient(alpha, a) + a[A_CLE] * elevator
    beyond = max(alpha - a[A_STALL], 0.0)
    cd = a[A_CD0] + a[A_CDK] * cl * cl + a[A_CDS] * beyond * beyond
    cm = a[A_CM0] + a[A_CMA] * alpha + a[A_CMQ] * a[A_CHORD] * rate / (2.0 * air) + a[A_CME] * elevator
    return push * cl, push * cd, push * a[A_CHORD] * cm


@jit
def full_thrust(air: float, a: Arr) -> float:
    """Thrust available [N] at airspeed `air` [m/s]."""
    return a[A_TMAX] * (1.0 - a[A_LAPSE] * air)


@jit
def rates(f: Arr, u: Arr, gx: float, gh: float, a: Arr, m: Arr, w: Arr, out: Arr) -> None:
    """out [7] <- df/dt with gusts gx along x and gh up [m/s] on top of the downburst m; w [6] <- its wind and slopes."""
    wind(f[F_X], f[F_H], m, w)
    ax, ah = f[F_VX] - w[0] - gx, f[F_VH] - w[1] - gh
    air = math.sqrt(ax * ax + ah * ah)
    alpha = f[F_PITCH] - math.atan2(ah, ax)
    lift, drag, moment = forces(air, alpha, f[F_RATE], u[1], a)
    ex, eh = ax / air, ah / air
    thrust = f[F_THRUST]
    out[F_X], out[F_H] = f[F_VX], f[F_VH]
    out[F_VX] = (thrust * math.cos(f[F_PITCH]) - drag * ex - lift * eh) / a[A_MASS]
    out[F_VH] = (thrust * math.sin(f[F_PITCH]) - drag * eh + lift * ex) / a[A_MASS] - a[A_GRAV]
    out[F_PITCH] = f[F_RATE]
    out[F_RATE] = moment / a[A_INERTIA]
    top = full_thrust(air, a)
    out[F_THRUST] = (min(max(u[0], a[A_IDLE] * top), top) - thrust) / a[A_LAG]


@jit
def advance(f: Arr, u: Arr, g0: Arr, g1: Arr, dt: float, a: Arr, m: Arr, W: Arr) -> None:
    """f [7] over dt [s] with u [2] held, gusts straight from g0 [2] to g1 [2] (along x, up): one Runge-Kutta step; W [6,7]."""
    w = W[5]
    mx, mh = 0.5 * (g0[0] + g1[0]), 0.5 * (g0[1] + g1[1])
    rates(f, u, g0[0], g0[1], a, m, w, W[0])
    for i in range(NF):
        W[4, i] = f[i] + 0.5 * dt * W[0, i]
    rates(W[4], u, mx, mh, a, m, w, W[1])
    for i in range(NF):
        W[4, i] = f[i] + 0.5 * dt * W[1, i]
    rates(W[4], u, mx, mh, a, m, w, W[2])
    for i in range(NF):
        W[4, i] = f[i] + dt * W[2, i]
    rates(W[4], u, g1[0], g1[1], a, m, w, W[3])
    for i in range(NF):
        f[i] += dt * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i]) / 6.0


@jit
def observe(f: Arr, u: Arr, g: Arr, slope: Arr, a: Arr, m: Arr, W: Arr, reading: Arr, truth: Arr) -> None:
    """reading [9] (R_*) and truth [11] at the state f with controls u in force; gusts g [2] [m/s] change at `slope` [2] [m/s^2].

    truth: x, h, airspeed, air-path angle, incidence, pitch rate, thrust [N], wind along x and up, their rates along the flight
    path [m/s^2].
    """
    w = W[5]
    rates(f, u, g[0], g[1], a, m, w, W[0])
    wx, wh = w[0] + g[0], w[1] + g[1]
    ax, ah = f[F_VX] - wx, f[F_VH] - wh
    path = math.atan2(ah, ax)
    air = math.sqrt(ax * ax + ah * ah)
    reading[R_H], reading[R_GROUND], reading[R_AIR] = f[F_H], f[F_VX], air
    reading[R_ALPHA], reading[R_PITCH], reading[R_RATE] = f[F_PITCH] - path, f[F_PITCH], f[F_RATE]
    reading[R_CLIMB], reading[R_AX], reading[R_AH] = f[F_VH], W[0, F_VX], W[0, F_VH]
    truth[0], truth[1], truth[2], truth[3], truth[4] = f[F_X], f[F_H], air, path, f[F_PITCH] - path
    truth[5], truth[6], truth[7], truth[8] = f[F_RATE], f[F_THRUST], wx, wh
    truth[9] = w[2] * f[F_VX] + w[3] * f[F_VH] + slope[0]
    truth[10] = w[4] * f[F_VX] + w[5] * f[F_VH] + slope[1]
