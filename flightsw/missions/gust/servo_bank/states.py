"""Longitudinal motion with lift and airspeed sensor that are not as believed: rates, readings and their exact slopes.

State z [11]: the nine of gust/dynamics.py, then k [-], by which everything that changes lift is larger than in the aircraft file
(incidence, pitch rate, elevator, flap; not the lift that carries the weight at trim), and b_V [m/s], by which the airspeed reads
too much. Both stay where they are but for their random walks. hoffmann.md 3.6, 3.7.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.gust import dynamics as g

LIFT, BIAS_V, NZ = g.NX, g.NX + 1, g.NX + 2
# rows of slopes [6,11]: of airspeed, incidence, path angle, path through the air less path, lift, drag
(S_VA, S_ALPHA, S_GAMMA, S_TURN, S_LIFT, S_DRAG, S_N) = range(7)


@jit
def forces(z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray) -> tuple[float, float]:
    """Lift and drag per mass [m/s^2] at the state z [11] with controls u [3]; a [4] <- what `air` gives there."""
    g.air(z, p, a)
    lift, drag = g.lift_drag(a[g.AIR_V], a[g.AIR_ALPHA], z[g.Q], u, p)
    ratio = a[g.AIR_V] / p[g.P_V0]
    return lift + z[LIFT] * (lift - ratio * ratio * p[g.P_L0]), drag


@jit
def rates(z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, out: np.ndarray) -> None:
    """out [11] <- dz/dt of the state z [11] under controls u [3]; a [4] is workspace."""
    lift, drag = forces(z, u, p, a)
    g.follow(z, u, p, a, lift, drag, out)
    out[LIFT] = 0.0
    out[BIAS_V] = 0.0


@jit
def propagate(z: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, W: np.ndarray) -> None:
    """Advance z [11] by dt [s] with controls u [3] held, in place: one Runge-Kutta step; W [6,11] workspace."""
    for stage in range(4):
        h = 0.0 if stage == 0 else dt if stage == 3 else 0.5 * dt
        for i in range(NZ):
            W[g.W_AT, i] = z[i] + (h * W[stage - 1, i] if stage > 0 else 0.0)
        rates(W[g.W_AT], u, p, W[g.W_AIR], W[stage])
    for i in range(NZ):
        z[i] += dt / 6.0 * (W[g.W_1, i] + 2.0 * W[g.W_2, i] + 2.0 * W[g.W_3, i] + W[g.W_4, i])


@jit
def instruments(z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, out: np.ndarray) -> None:
    """out [7] <- all channels of gust/dynamics.py at z [11] with controls u [3]; a [4] is workspace."""
    lift, drag = forces(z, u, p, a)
    out[g.Y_Q], out[g.Y_TH], out[g.Y_H] = z[g.Q], z[g.TH], z[g.H]
    out[g.Y_ALPHA] = a[g.AIR_ALPHA] + z[g.AB]
    out[g.Y_VA] = a[g.AIR_V] - p[g.P_V0] + z[BIAS_V]
    out[g.Y_GROUND] = (p[g.P_V0] + z[g.VK]) * math.cos(a[g.AIR_GAMMA]) - p[g.P_V0]
    out[g.Y_AZ] = lift * math.cos(a[g.AIR_ALPHA]) + drag * math.sin(a[g.AIR_ALPHA]) - p[g.P_G]


@jit
def air_slopes(
    z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, S: np.ndarray
) -> tuple[float, float]:  # fmt: skip
    """S [6,11] <- derivatives by z of airspeed, incidence, path angle, turn of the air, lift, drag; returns lift and drag.

    z [11], u [3]; a [4] <- what `air` gives.
    """
    lift, drag = forces(z, u, p, a)
    V0, VA, alpha, gamma = p[g.P_V0], a[g.AIR_V], a[g.AIR_ALPHA], a[g.AIR_GAMMA]
    V = V0 + z[g.VK]
    cg, sg = math.cos(gamma), math.sin(gamma)
    up, forward = V * sg + V0 * z[g.AW], V * cg - z[g.VW]
    for r in range(S_N):
        for i in range(NZ):
            S[r, i] = 0.0
    # of what comes up and forward through the air, column by column
    for i, d_up, d_forward in (
        (g.AW, V0, 0.0), (g.VW, 0.0, -1.0), (g.AK, -V * cg, V * sg), (g.TH, V * cg, -V * sg), (g.VK, sg, cg),
    ):  # fmt: skip
        S[S_VA, i] = (up * d_up + forward * d_forward) / VA
        S[S_ALPHA, i] = -(forward * d_up - up * d_forward) / (VA * VA)
    S[S_ALPHA, g.TH] += 1.0
    S[S_GAMMA, g.TH], S[S_GAMMA, g.AK] = 1.0, -1.0
    ratio, q, more = VA / V0, z[g.Q], 1.0 + z[LIFT]
    surfaces = p[g.P_LA] * alpha + p[g.P_LE] * u[g.ELEVATOR] + p[g.P_LF] * u[g.FLAP]
    drags = p[g.P_D0] + p[g.P_DA] * alpha + p[g.P_DE] * u[g.ELEVATOR] + p[g.P_DF] * u[g.FLAP]
    for i in range(NZ):
        # incidence is pitch less the path through the air
        S[S_TURN, i] = (1.0 if i == g.TH else 0.0) - S[S_ALPHA, i] - S[S_GAMMA, i]
        by_ratio, by_alpha = S[S_VA, i] / V0, S[S_ALPHA, i]
        S[S_LIFT, i] = (2.0 * ratio * (p[g.P_L0] + more * surfaces) + more * p[g.P_LQ] * q) * by_ratio
        S[S_LIFT, i] += ratio * ratio * more * p[g.P_LA] * by_alpha
        S[S_DRAG, i] = (2.0 * ratio * drags + p[g.P_DQ] * q) * by_ratio + ratio * ratio * p[g.P_DA] * by_alpha
    S[S_LIFT, g.Q] += more * p[g.P_LQ] * ratio
    S[S_DRAG, g.Q] += p[g.P_DQ] * ratio
    S[S_LIFT, LIFT] += ratio * ratio * surfaces + ratio * p[g.P_LQ] * q
    return lift, drag


@jit
def rate_slopes(z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, S: np.ndarray, A: np.ndarray) -> None:
    """A [11,11] <- derivatives of `rates` by z [11] under controls u [3]; a [4], S [6,11] workspace."""
    lift, drag = air_slopes(z, u, p, a, S)
    alpha, gamma, dg = a[g.AIR_ALPHA], a[g.AIR_GAMMA], a[g.AIR_TURN]
    thrust = p[g.P_T0] + p[g.P_TF] * u[g.THROTTLE]
    V0, V = p[g.P_V0], p[g.P_V0] + z[g.VK]
    cg, sg, cd, sd = math.cos(gamma), math.sin(gamma), math.cos(dg), math.sin(dg)
    turn = (thrust * math.sin(z[g.AK]) + lift * cd - drag * sd - p[g.P_G] * cg) / V
    ratio, ww = a[g.AIR_V] / V0, p[g.P_WW]
    moments = p[g.P_MA] * alpha + p[g.P_ME] * u[g.ELEVATOR] + p[g.P_MF] * u[g.FLAP]
    for i in range(NZ):
        for j in range(NZ):
            A[i, j] = 0.0
    A[g.X1, g.AW] = -ww * ww
    A[g.AW, g.X1], A[g.AW, g.AW] = 1.0, -2.0 * ww
    A[g.VW, g.VW] = -p[g.P_WU]
    A[g.TH, g.Q] = 1.0
    for j in range(NZ):
        d_lift, d_drag, d_gamma, d_dg = S[S_LIFT, j], S[S_DRAG, j], S[S_GAMMA, j], S[S_TURN, j]
        A[g.Q, j] = (2.0 * ratio * moments + p[g.P_MQ] * z[g.Q]) * S[S_VA, j] / V0
        A[g.Q, j] += ratio * ratio * p[g.P_MA] * S[S_ALPHA, j]
        A[g.AK, j] = -(d_lift * cd - lift * sd * d_dg - d_drag * sd - drag * cd * d_dg + p[g.P_G] * sg * d_gamma) / V
        A[g.VK, j] = -d_drag * cd + drag * sd * d_dg - d_lift * sd - lift * cd * d_dg - p[g.P_G] * cg * d_gamma
        A[g.H, j] = V * cg * d_gamma
    A[g.Q, g.Q] += ratio * p[g.P_MQ]
    A[g.AK, g.Q] += 1.0
    A[g.AK, g.AK] -= thrust * math.cos(z[g.AK]) / V
    A[g.AK, g.VK] += turn / V
    A[g.VK, g.AK] -= thrust * math.sin(z[g.AK])
    A[g.H, g.VK] += sg


@jit
def instrument_slopes(
    z: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, S: np.ndarray, C: np.ndarray
) -> None:  # fmt: skip
    """C [7,11] <- derivatives of `instruments` by z [11] with controls u [3]; a [4], S [6,11] workspace."""
    lift, drag = air_slopes(z, u, p, a, S)
    V, gamma = p[g.P_V0] + z[g.VK], a[g.AIR_GAMMA]
    ca, sa = math.cos(a[g.AIR_ALPHA]), math.sin(a[g.AIR_ALPHA])
    for i in range(NZ):
        C[g.Y_Q, i] = C[g.Y_TH, i] = C[g.Y_H, i] = 0.0
        C[g.Y_ALPHA, i] = S[S_ALPHA, i]
        C[g.Y_VA, i] = S[S_VA, i]
        C[g.Y_GROUND, i] = -V * math.sin(gamma) * S[S_GAMMA, i]
        C[g.Y_AZ, i] = S[S_LIFT, i] * ca + S[S_DRAG, i] * sa + (drag * ca - lift * sa) * S[S_ALPHA, i]
    C[g.Y_Q, g.Q] = C[g.Y_TH, g.TH] = C[g.Y_H, g.H] = 1.0
    C[g.Y_ALPHA, g.AB] += 1.0
    C[g.Y_VA, BIAS_V] += 1.0
    C[g.Y_GROUND, g.VK] += math.cos(gamma)
