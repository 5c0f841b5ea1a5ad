"""Nonlinear inverse dynamics of the jet transport in two time scales: flight path and speed, then incidence, pitch rate, thrust.

Jing et al. (2007) section III gives the principle, the equations are jing.md 3.4. Vectors: state x [>=15] of dynamics.py,
demand d [ND], gains g [NG], model parameters p [NP] of dynamics.py.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.windshear import dynamics as k

# demand: mode, climb rate [m/s], airspeed [m/s], pitch [rad], largest incidence [rad]
D_MODE, D_CLIMB, D_SPEED, D_PITCH, D_AMAX, ND = range(6)
APPROACH, CLIMB, PITCH, OPEN = 0, 1, 2, 3
(G_PATH, G_SPEED, G_ALPHA, G_RATE, G_THRUST, G_TURN_MAX, G_Q_MAX, G_DE_MAX, G_AMIN, NG) = range(10)
# result: thrust command [kN], elevator [rad], incidence command [rad], thrust demanded [kN]
O_TC, O_DE, O_ALPHA, O_TD, NC = range(5)
# and what they are made of, from the outer to the inner scale: path error [rad], turn rate of the path asked for, given [rad/s];
# incidence asked for [rad]; pitch rate by the incidence error, by the turn, given [rad/s]; elevator by the pitch rate's error, by
# what the aircraft does without [rad]; thrust by the airspeed error, by path, wind and drag, by the engine's lag [kN]
(O_PATH, O_TURN, O_TURN_C, O_ALPHA_D, O_Q_FB, O_Q_FF, O_Q_C, O_DE_FB, O_DE_FF, O_T_FB, O_T_FF, O_T_LAG) = range(
    NC, NC + 12
)
NO = NC + 12
STEPS = 8
LEAST = 0.3  # share of the thrust commanded that is reckoned with at least
FREE = 0.5  # [rad] beyond any stall: bounds of the incidence asked for


@jit
def clip(v: float, lo: float, hi: float) -> float:
    """v limited to [lo, hi]."""
    return min(max(v, lo), hi)


@jit
def incidence_for(turn: float, x: np.ndarray, de: float, lo: float, hi: float, p: np.ndarray) -> float:
    """Incidence [rad] in [lo, hi] at which the path turns at `turn` [rad/s] with the present (not the commanded) thrust.

    Newton on the lift equation, clipped at every step, so that it cannot run away past the stall.
    """
    V, kl = x[k.VA], x[k.KL]
    sg, cg = math.sin(x[k.GA]), math.cos(x[k.GA])
    need = p[k.P_M] * (V * turn + p[k.P_G] * cg + x[k.WHD] * cg - x[k.WXD] * sg)
    qs = 0.5 * p[k.P_RHO] * V * V * p[k.P_S]
    thrust = 1e3 * x[k.T]
    a = clip(x[k.AL], lo, hi)
    for _ in range(STEPS):
        have = thrust * math.sin(a) + kl * qs * (k.lift_curve(a, p) + p[k.P_LE] * de)
        slope = thrust * math.cos(a) + kl * qs * k.lift_slope(a, p)
        if slope <= 0.0:
            return hi if need > have else lo
        step = (need - have) / slope
        b = clip(a + step, lo, hi)
        if abs(b - a) < 1e-10:
            return b
        a = b
    return a


@jit
def invert(x: np.ndarray, d: np.ndarray, de: float, p: np.ndarray, g: np.ndarray, out: np.ndarray) -> None:
    """out [NO] <- commands for the demand d at the state x with elevator `de` in force; mode OPEN: full thrust, elevator held."""
    V, gamma = x[k.VA], x[k.GA]
    top = k.thrust_limit(V, p)
    out[O_TC], out[O_DE], out[O_ALPHA], out[O_TD] = top, de, x[k.AL], top
    for i in range(NC, NO):
        out[i] = 0.0
    mode = d[D_MODE]
    if mode == OPEN:
        return
    sg, cg = math.sin(gamma), math.cos(gamma)
    if mode == PITCH:
        alpha_c = clip(d[D_PITCH] - gamma, g[G_AMIN], d[D_AMAX])
        out[O_ALPHA_D] = d[D_PITCH] - gamma
    else:
        wanted = math.asin(clip((d[D_CLIMB] - x[k.WH]) / V, -0.5, 0.5))
        turn_d = clip(g[G_PATH] * (wanted - gamma), -g[G_TURN_MAX], g[G_TURN_MAX])
        alpha_c = incidence_for(turn_d, x, de, g[G_AMIN], d[D_AMAX], p)
        out[O_PATH], out[O_TURN], out[O_TURN_C] = gamma - wanted, g[G_PATH] * (wanted - gamma), turn_d
        out[O_ALPHA_D] = incidence_for(turn_d, x, de, -FREE, FREE, p)
    if mode == APPROACH:
        # slow scale: the fast states are where they are told to be, so drag is that of the incidence commanded
        _, drag = k.lift_drag(V, alpha_c, de, x[k.KL], x[k.KD], p)
        pull = g[G_SPEED] * (d[D_SPEED] - V) + p[k.P_G] * sg + x[k.WXD] * cg + x[k.WHD] * sg
        out[O_TD] = 1e-3 * (p[k.P_M] * pull + drag) / math.cos(alpha_c)
        out[O_T_FB] = 1e-3 * p[k.P_M] * g[G_SPEED] * (d[D_SPEED] - V) / math.cos(alpha_c)
        out[O_T_FF] = out[O_TD] - out[O_T_FB]
        out[O_T_LAG] = (p[k.P_TAU] * g[G_THRUST] - 1.0) * (out[O_TD] - x[k.T])
        given = clip(x[k.K_T], LEAST, 1.0) if x.shape[0] > k.K_T else 1.0  # of what is commanded
        out[O_TC] = clip((x[k.T] + p[k.P_TAU] * g[G_THRUST] * (out[O_TD] - x[k.T])) / given, p[k.P_TI] * top, top)
    _, turn = k.path_rates(x, x[k.KL], x[k.KD], de, p)
    q_c = clip(g[G_ALPHA] * (alpha_c - x[k.AL]) + turn, -g[G_Q_MAX], g[G_Q_MAX])
    bare = k.pitch_acceleration(V, x[k.AL], x[k.Q], 0.0, p)
    effect = 0.5 * p[k.P_RHO] * V * V * p[k.P_S] * p[k.P_C] * p[k.P_ME] / p[k.P_I]
    out[O_DE] = clip((g[G_RATE] * (q_c - x[k.Q]) - bare) / effect, -g[G_DE_MAX], g[G_DE_MAX])
    out[O_ALPHA] = alpha_c
    out[O_Q_FB], out[O_Q_FF], out[O_Q_C] = g[G_ALPHA] * (alpha_c - x[k.AL]), turn, q_c
    out[O_DE_FB], out[O_DE_FF] = g[G_RATE] * (q_c - x[k.Q]) / effect, -bare / effect
