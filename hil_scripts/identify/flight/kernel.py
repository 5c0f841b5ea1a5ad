"""The onboard aircraft model led along a recorded flight: one pass from initial state and commands to what the sensors would
read."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import density
from flightsw.kernels.jit import jit, jit_own
from flightsw.sixdof import params as pv
from flightsw.sixdof.layout import NX, X_ALPHA, X_BETA, X_P, X_PHI, X_PSI, X_Q, X_R, X_THETA, X_V, X_WN, X_X, X_Z
from flightsw.sixdof.motion import air_jacobian, air_velocity, free_rates

# outputs at a tick: body rates [rad/s], specific force [m/s^2], ground velocity NED [m/s], psi, theta, phi [rad], height [m],
# then V [m/s], alpha, beta [rad] of each probe
Y_RATE, Y_FORCE, Y_VEL, Y_EULER, Y_HEIGHT, Y_PROBE = 0, 3, 6, 9, 12, 13
# thrust available about a point: [N] there, per m/s, per m, airspeed [m/s] and height [m] of it; engine lag [s], least throttle
# [-]
T_MOST, T_V, T_H, T_V0, T_H0, T_TAU, T_IDLE, NT = 0, 1, 2, 3, 4, 5, 6, 7


@jit
def _available(V: float, h: float, engine: np.ndarray) -> float:
    return engine[T_MOST] + engine[T_V] * (V - engine[T_V0]) + engine[T_H] * (h - engine[T_H0])


@jit_own
def lead(
    x: np.ndarray, thrust: float, aero: np.ndarray, surf: np.ndarray, throttle: np.ndarray, mass: np.ndarray, engine: np.ndarray,
    shear: np.ndarray, air: np.ndarray, probes: np.ndarray, P: np.ndarray, dt: float, out: np.ndarray,
) -> None:  # fmt: skip
    """out [n, Y_PROBE + 3 probes] <- outputs at n ticks dt [s] apart; x [15] (motion.py) and thrust [N] are those of the
    first tick and are used up.

    aero [26] in the order of the aircraft file; surf [n,3,3] deflections at begin, middle and end of each tick's step, aileron,
    elevator, rudder [rad]; throttle [n] in force during it; mass [n,5]: mass [kg], Ixx, Iyy, Izz, Ixz [kg m^2]; engine [NT];
    shear [2]: wind north, east per metre of height [1/s]; air [n,3]: change of the wind over each tick's step, NED [m/s]; probes
    [k,3] [m]; P [34] of the aircraft, work space but for S, b, c. Classical Runge-Kutta, thrust by its exact lag.
    """
    W = np.empty((5, NX))
    R, fm, u, G = np.empty(9), np.empty(9), np.empty(4), np.empty((3, 3))
    half = math.exp(-0.5 * dt / engine[T_TAU])
    for i in range(26):
        P[pv.AERO + i] = aero[i]
    for k in range(out.shape[0]):
        P[pv.M], P[pv.IX], P[pv.IY], P[pv.IZ], P[pv.IXZ] = mass[k, 0], mass[k, 1], mass[k, 2], mass[k, 3], mass[k, 4]
        asked = max(throttle[k], engine[T_IDLE]) * _available(x[X_V], -x[X_Z], engine)
        rho = density(-x[X_Z])
        u[0], u[1], u[2], u[3] = surf[k, 0, 0], surf[k, 0, 1], surf[k, 0, 2], thrust
        free_rates(x, u, rho, P, R, fm, W[0])
        for i in range(3):
            out[k, Y_RATE + i] = x[X_P + i]
            out[k, Y_FORCE + i] = fm[i]
            out[k, Y_VEL + i] = W[0, X_X + i]
        out[k, Y_EULER], out[k, Y_EULER + 1], out[k, Y_EULER + 2] = x[X_PSI], x[X_THETA], x[X_PHI]
        out[k, Y_HEIGHT] = -x[X_Z]
        a, b, c = air_velocity(x[X_V], x[X_BETA], x[X_ALPHA])
        for i in range(probes.shape[0]):
            px, py, pz = probes[i, 0], probes[i, 1], probes[i, 2]
            uu = a + x[X_Q] * pz - x[X_R] * py
            vv = b + x[X_R] * px - x[X_P] * pz
            ww = c + x[X_P] * py - x[X_Q] * px
            V = math.sqrt(uu * uu + vv * vv + ww * ww)
            out[k, Y_PROBE + 3 * i] = V
            out[k, Y_PROBE + 3 * i + 1] = math.atan2(ww, uu)
            out[k, Y_PROBE + 3 * i + 2] = math.asin(vv / V)
        mid = asked + (thrust - asked) * half
        thrust = asked + (mid - asked) * half
        u[0], u[1], u[2], u[3] = surf[k, 1, 0], surf[k, 1, 1], surf[k, 1, 2], mid
        for s in range(1, 3):
            for i in range(NX):
                W[4, i] = x[i] + 0.5 * dt * W[s - 1, i] if i < X_WN else x[i]
            free_rates(W[4], u, rho, P, R, fm, W[s])
        u[0], u[1], u[2], u[3] = surf[k, 2, 0], surf[k, 2, 1], surf[k, 2, 2], thrust
        for i in range(NX):
            W[4, i] = x[i] + dt * W[2, i] if i < X_WN else x[i]
        free_rates(W[4], u, rho, P, R, fm, W[3])
        for i in range(X_WN):
            x[i] += dt / 6.0 * (W[0, i] + 2.0 * (W[1, i] + W[2, i]) + W[3, i])
        climbed = -x[X_Z] - out[k, Y_HEIGHT]
        g0, g1, g2 = air[k, 0] + shear[0] * climbed, air[k, 1] + shear[1] * climbed, air[k, 2]
        if g0 != 0.0 or g1 != 0.0 or g2 != 0.0:  # into another wind: the air-relative velocity changes by as much
            air_jacobian(x[X_V], x[X_BETA], x[X_ALPHA], R, G)
            x[X_WN] += g0
            x[X_WN + 1] += g1
            x[X_WN + 2] += g2
            for i in range(3):
                x[X_V + i] += G[i, 0] * g0 + G[i, 1] * g1 + G[i, 2] * g2
