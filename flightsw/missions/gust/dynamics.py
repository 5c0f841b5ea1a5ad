"""Longitudinal motion of a small aircraft in wind, per unit mass and as deviations from level trim, for estimators.

State x [9]: x1 (auxiliary of the Dryden filter), alpha_W [rad], V_W [m/s], q [rad/s], alpha_K [rad], V_K [m/s], Theta [rad],
H [m], alpha_b [rad] (vane bias). K: flight path, W: wind; alpha_W > 0 is air moving down, V_W > 0 a tail wind. Controls u [3]:
elevator [rad] (positive pitches down), throttle setting [-], flap [rad] (positive lifts). Channels of a measurement [7]:
q, alpha, V_A, Theta, H, ground speed, a_z (upward specific force less g, at the centre of gravity).
Hoffmann and Luckner, "Broadband prediction of wind-induced disturbances", corrected as in hoffmann.md section 5.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit

X1, AW, VW, Q, AK, VK, TH, H, AB, NX = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
ELEVATOR, THROTTLE, FLAP, NU = 0, 1, 2, 3
Y_Q, Y_ALPHA, Y_VA, Y_TH, Y_H, Y_GROUND, Y_AZ, NY = 0, 1, 2, 3, 4, 5, 6, 7
# what `air` gives [4]: airspeed [m/s], incidence, flight-path angle, path through the air less path [rad]
(AIR_V, AIR_ALPHA, AIR_GAMMA, AIR_TURN, AIR_N) = range(5)
# parts of the state [9] and of a measurement [7]: wind filter, wind that is felt, aircraft; the readings of the source
WIND, FELT, AIRCRAFT, PRINTED = slice(X1, Q), slice(AW, Q), slice(Q, AB), slice(Y_Q, Y_GROUND)
# workspace of a Runge-Kutta step: its four slopes, the state at which the next one is taken, what `air` gives there
(W_1, W_2, W_3, W_4, W_AT, W_AIR, W_N) = range(7)
# parameter vector: speed, gravity, Dryden corner frequencies; lift, drag, thrust per mass; pitching moment per inertia
(P_V0, P_G, P_WW, P_WU, P_L0, P_LA, P_LQ, P_LE, P_LF, P_D0, P_DA, P_DQ, P_DE, P_DF, P_T0, P_TF, P_MQ, P_MA, P_ME, P_MF, NP) = range(21)  # fmt: skip  # noqa: E501


@jit
def air(x: np.ndarray, p: np.ndarray, out: np.ndarray) -> None:
    """out [4] <- airspeed V_A [m/s], incidence alpha [rad], flight-path angle gamma, gamma_A - gamma [rad] of the state x [9].

    Wind triangle in the vertical plane; p [NP].
    """
    V = p[P_V0] + x[VK]
    gamma = x[TH] - x[AK]
    up = V * math.sin(gamma) + p[P_V0] * x[AW]
    forward = V * math.cos(gamma) - x[VW]
    g_air = math.atan2(up, forward)
    out[AIR_V] = math.sqrt(up * up + forward * forward)
    out[AIR_ALPHA] = x[TH] - g_air
    out[AIR_GAMMA] = gamma
    out[AIR_TURN] = g_air - gamma


@jit
def lift_drag(VA: float, alpha: float, q: float, u: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """Lift and drag per mass [m/s^2] at airspeed VA [m/s], incidence alpha [rad], pitch rate q [rad/s], controls u [3]."""
    ratio = VA / p[P_V0]
    pressure = ratio * ratio
    lift = pressure * (p[P_L0] + p[P_LA] * alpha + p[P_LQ] * q / ratio + p[P_LE] * u[ELEVATOR] + p[P_LF] * u[FLAP])
    drag = pressure * (p[P_D0] + p[P_DA] * alpha + p[P_DQ] * q / ratio + p[P_DE] * u[ELEVATOR] + p[P_DF] * u[FLAP])
    return lift, drag


@jit
def follow(
    x: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, lift: float, drag: float, out: np.ndarray
) -> None:  # fmt: skip
    """out [9] <- dx/dt of the state x [9] under lift and drag per mass [m/s^2], controls u [3] and a [4] of `air`."""
    VA, alpha, gamma, dg = a[AIR_V], a[AIR_ALPHA], a[AIR_GAMMA], a[AIR_TURN]
    thrust = p[P_T0] + p[P_TF] * u[THROTTLE]
    V = p[P_V0] + x[VK]
    cg, sg = math.cos(gamma), math.sin(gamma)
    cd, sd = math.cos(dg), math.sin(dg)
    turn = (thrust * math.sin(x[AK]) + lift * cd - drag * sd - p[P_G] * cg) / V
    ratio = VA / p[P_V0]
    ww = p[P_WW]
    out[X1] = -ww * ww * x[AW]
    out[AW] = x[X1] - 2.0 * ww * x[AW]
    out[VW] = -p[P_WU] * x[VW]
    out[Q] = ratio * ratio * (
        p[P_MQ] * x[Q] / ratio + p[P_MA] * alpha + p[P_ME] * u[ELEVATOR] + p[P_MF] * u[FLAP]
    )  # fmt: skip
    out[AK] = x[Q] - turn
    out[VK] = thrust * math.cos(x[AK]) - drag * cd - lift * sd - p[P_G] * sg
    out[TH] = x[Q]
    out[H] = V * sg
    out[AB] = 0.0


@jit
def rates(x: np.ndarray, u: np.ndarray, p: np.ndarray, a: np.ndarray, out: np.ndarray) -> None:
    """out [9] <- dx/dt of the state x [9] under controls u [3]; a [4] is workspace. Its linearisation: the aircraft file."""
    air(x, p, a)
    lift, drag = lift_drag(a[AIR_V], a[AIR_ALPHA], x[Q], u, p)
    follow(x, u, p, a, lift, drag, out)


@jit
def propagate(X: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, W: np.ndarray) -> None:
    """Advance every row of X [k,9] by dt [s] with controls u [3] held, in place: one Runge-Kutta step; W [6,9] workspace."""
    for r in range(X.shape[0]):
        x = X[r]
        rates(x, u, p, W[W_AIR], W[W_1])
        for i in range(NX):
            W[W_AT, i] = x[i] + 0.5 * dt * W[W_1, i]
        rates(W[W_AT], u, p, W[W_AIR], W[W_2])
        for i in range(NX):
            W[W_AT, i] = x[i] + 0.5 * dt * W[W_2, i]
        rates(W[W_AT], u, p, W[W_AIR], W[W_3])
        for i in range(NX):
            W[W_AT, i] = x[i] + dt * W[W_3, i]
        rates(W[W_AT], u, p, W[W_AIR], W[W_4])
        for i in range(NX):
            x[i] += dt / 6.0 * (W[W_1, i] + 2.0 * W[W_2, i] + 2.0 * W[W_3, i] + W[W_4, i])


@jit
def measure(
    X: np.ndarray, codes: np.ndarray, m: int, u: np.ndarray, p: np.ndarray, a: np.ndarray, Y: np.ndarray
) -> None:
    """Y [k,>=m] <- the m channels `codes` (Y_Q ..) of every row of X [k,9] with controls u [3]; a [4] workspace.

    V_A, H and ground speed are deviations from trim.
    """
    for r in range(X.shape[0]):
        x = X[r]
        air(x, p, a)
        for j in range(m):
            c = codes[j]
            v = 0.0
            if c == Y_Q:
                v = x[Q]
            elif c == Y_ALPHA:
                v = a[AIR_ALPHA] + x[AB]
            elif c == Y_VA:
                v = a[AIR_V] - p[P_V0]
            elif c == Y_TH:
                v = x[TH]
            elif c == Y_H:
                v = x[H]
            elif c == Y_GROUND:
                v = (p[P_V0] + x[VK]) * math.cos(a[AIR_GAMMA]) - p[P_V0]
            else:
                lift, drag = lift_drag(a[AIR_V], a[AIR_ALPHA], x[Q], u, p)
                v = lift * math.cos(a[AIR_ALPHA]) + drag * math.sin(a[AIR_ALPHA]) - p[P_G]
            Y[r, j] = v


@jit
def propagate_linear(X: np.ndarray, F: np.ndarray, G: np.ndarray, u: np.ndarray, w: np.ndarray) -> None:
    """Every row of X [k,n] <- F x + G u, in place; F [n,n], G [n,3], u [3], w [n] workspace."""
    n = F.shape[0]
    for r in range(X.shape[0]):
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += F[i, j] * X[r, j]
            for j in range(NU):
                s += G[i, j] * u[j]
            w[i] = s
        for i in range(n):
            X[r, i] = w[i]


@jit
def measure_linear(
    X: np.ndarray, C: np.ndarray, D: np.ndarray, u: np.ndarray, codes: np.ndarray, m: int, Y: np.ndarray
) -> None:
    """Y [k,>=m] <- channels `codes` of C x + D u; C [7,n], D [7,3]."""
    for r in range(X.shape[0]):
        for j in range(m):
            c = codes[j]
            s = 0.0
            for i in range(C.shape[1]):
                s += C[c, i] * X[r, i]
            for i in range(NU):
                s += D[c, i] * u[i]
            Y[r, j] = s


@jit
def constant_gain_step(
    x: np.ndarray, y0: np.ndarray, y1: np.ndarray, u: np.ndarray, A: np.ndarray, B: np.ndarray, C: np.ndarray, K: np.ndarray,
    dt: float, W: np.ndarray,
) -> None:  # fmt: skip
    """Kalman-Bucy filter over dt [s], in place: dx/dt = A x + B u + K (y - C x), u held; one Runge-Kutta step.

    y runs straight from y0 [k] to y1 [k] (equal: a held reading). x [n], u [3], A [n,n], B [n,3], C [k,n], K [n,k]; W [5,n]
    workspace. Seed (1), gain sign corrected.
    """
    n, k = A.shape[0], C.shape[0]
    for stage in range(4):
        for i in range(n):
            if stage == 0:
                W[W_AT, i] = x[i]
            elif stage == 3:
                W[W_AT, i] = x[i] + dt * W[W_3, i]
            else:
                W[W_AT, i] = x[i] + 0.5 * dt * W[stage - 1, i]
        for i in range(n):
            W[stage, i] = 0.0
        late = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
        for a in range(k):
            e = y0[a] + late * (y1[a] - y0[a])
            for j in range(n):
                e -= C[a, j] * W[W_AT, j]
            for i in range(n):
                W[stage, i] += K[i, a] * e
        for i in range(n):
            s = W[stage, i]
            for j in range(n):
                s += A[i, j] * W[W_AT, j]
            for j in range(NU):
                s += B[i, j] * u[j]
            W[stage, i] = s
    for i in range(n):
        x[i] += dt / 6.0 * (W[W_1, i] + 2.0 * W[W_2, i] + 2.0 * W[W_3, i] + W[W_4, i])
