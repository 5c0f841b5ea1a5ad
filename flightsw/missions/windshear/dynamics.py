"""Jet transport in the vertical plane with wind and its rates as states, in air-path axes, for estimators.

State x [13, 15 or 26]: x [m], h [m], Va [m/s], gamma, alpha [rad], q [rad/s], T [kN], w_x, w_h [m/s], their first and second
rates; with 15 states also the scales of lift and drag, with 26 what the instruments and the aircraft are in error by (NX .. NE).
w_x > 0 tail wind, w_h > 0 updraught. Controls u [2]: commanded thrust [kN], elevator [rad] (positive pitches down). Jing et al.
(2007) (1)-(6), (23), (26)-(28) corrected as in jing.md section 5."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit

(X, H, VA, GA, AL, Q, T, WX, WH, WXD, WHD, WXDD, WHDD, KL, KD, NX) = range(16)
# offsets of the accelerations along x and up [m/s^2], of incidence [rad], climb rate [m/s] and barometer [m]; factors of the
# thrust commanded and of the pitching moment; radio altimeter's factor less one; airspeed [m/s] and incidence [rad] as their
# instruments, which lag, have followed; offset of the pitch rate [rad/s]
(B_AX, B_AH, B_AL, B_HD, B_H, K_T, K_M, K_R, L_VA, L_AL, B_Q, NE) = range(NX, NX + 12)
TC, DE, NU = 0, 1, 2
(Y_H, Y_VG, Y_VA, Y_AL, Y_TH, Y_Q, Y_HD, Y_XDD, Y_HDD, NY) = range(10)
Y_RA, NZ = NY, NY + 1  # height by radio, which only a filter with 26 states takes
(W_RATE, W_MID, W_N) = range(3)  # workspace of a midpoint step: slope, state half-way
# parameter vector: inertia and geometry, lift, drag, moment, engine, scales of lift and drag where they are not states, decay of
# the wind's first and second rates [1/s], lag of airspeed and vane [s] (0: none)
(P_M, P_S, P_C, P_I, P_RHO, P_G, P_L0, P_LA, P_LE, P_A1, P_A2, P_D0, P_DK, P_DS, P_M0, P_MA, P_MQ, P_ME, P_TAU, P_T0, P_TV,
 P_TI, P_KL, P_KD, P_FALL, P_FALL_RAD, P_FADE1, P_FADE2, P_LAGV,
 P_LAGA, NP) = range(31)  # fmt: skip


@jit
def lift_curve(alpha: float, p: np.ndarray) -> float:
    """C_L without elevator at alpha [rad]: linear to P_A1, rounded off to zero slope at P_A2, falling smoothly beyond."""
    a1, a2, s = p[P_A1], p[P_A2], p[P_LA]
    if alpha <= a1:
        return p[P_L0] + s * alpha
    w = a2 - a1
    if alpha <= a2 + w:
        y = (alpha - a1) / w
        return p[P_L0] + s * (a1 + w * (y - 0.5 * y * y))
    return p[P_L0] + s * a1 - p[P_FALL] * (1.0 - math.exp(-(alpha - a2 - w) / p[P_FALL_RAD]))


@jit
def lift_slope(alpha: float, p: np.ndarray) -> float:
    """d C_L / d alpha [1/rad] of lift_curve."""
    a1, a2, s = p[P_A1], p[P_A2], p[P_LA]
    if alpha <= a1:
        return s
    w = a2 - a1
    if alpha <= a2 + w:
        return s * (1.0 - (alpha - a1) / w)
    return -p[P_FALL] / p[P_FALL_RAD] * math.exp(-(alpha - a2 - w) / p[P_FALL_RAD])


@jit
def lift_drag(V: float, alpha: float, de: float, kl: float, kd: float, p: np.ndarray) -> tuple[float, float]:
    """Lift and drag [N] at airspeed V [m/s], scaled by kl, kd; seed (9), (10). The elevator's lift has its induced drag."""
    qs = 0.5 * p[P_RHO] * V * V * p[P_S]
    cl = lift_curve(alpha, p) + p[P_LE] * de
    cd = p[P_D0] + p[P_DK] * cl * cl
    if alpha > p[P_A1]:
        d = alpha - p[P_A1]
        cd += p[P_DS] * d * d
    return kl * qs * cl, kd * qs * cd


@jit
def pitch_acceleration(V: float, alpha: float, q: float, de: float, p: np.ndarray) -> float:
    """M / I_yy [rad/s^2]; seed (6), (12)."""
    cm = p[P_M0] + p[P_MA] * alpha + p[P_MQ] * p[P_C] * q / (2.0 * V) + p[P_ME] * de
    return 0.5 * p[P_RHO] * V * V * p[P_S] * p[P_C] * cm / p[P_I]


@jit
def thrust_limit(V: float, p: np.ndarray) -> float:
    """Largest thrust [kN] at airspeed V [m/s]; seed (11)."""
    return p[P_T0] * (1.0 - p[P_TV] * V)


@jit
def path_rates(x: np.ndarray, kl: float, kd: float, de: float, p: np.ndarray) -> tuple[float, float]:
    """(Va' [m/s^2], gamma' [rad/s]) of the state x [>=11]; seed (3), (4) with 1/Va."""
    lift, drag = lift_drag(x[VA], x[AL], de, kl, kd, p)
    thrust = 1e3 * x[T]
    m, g = p[P_M], p[P_G]
    sg, cg = math.sin(x[GA]), math.cos(x[GA])
    speed = (thrust * math.cos(x[AL]) - drag) / m - g * sg - x[WXD] * cg - x[WHD] * sg
    turn = ((thrust * math.sin(x[AL]) + lift) / m - g * cg - x[WHD] * cg + x[WXD] * sg) / x[VA]
    return speed, turn


@jit
def rates(x: np.ndarray, u: np.ndarray, p: np.ndarray, out: np.ndarray) -> None:
    """out [n] <- dx/dt of x [n], n = 13 (scales from p), 15 (scales are states) or 26 (errors too), under controls u [2], without
    noise."""
    n = x.shape[0]
    kl, kd = p[P_KL], p[P_KD]
    if n > KD:
        kl, kd = x[KL], x[KD]
    speed, turn = path_rates(x, kl, kd, u[DE], p)
    out[X] = x[VA] * math.cos(x[GA]) + x[WX]
    out[H] = x[VA] * math.sin(x[GA]) + x[WH]
    out[VA] = speed
    out[GA] = turn
    out[AL] = x[Q] - turn
    out[Q] = pitch_acceleration(x[VA], x[AL], x[Q], u[DE], p)
    out[T] = (u[TC] - x[T]) / p[P_TAU]
    out[WX], out[WH] = x[WXD], x[WHD]
    out[WXD], out[WHD] = x[WXDD], x[WHDD]
    for i in range(WXDD, n):
        out[i] = 0.0
    if n > NX:
        out[Q] *= x[K_M]
        out[T] = (x[K_T] * u[TC] - x[T]) / p[P_TAU]
        if p[P_LAGV] > 0.0:
            out[L_VA] = (x[VA] - x[L_VA]) / p[P_LAGV]
        if p[P_LAGA] > 0.0:
            out[L_AL] = (x[AL] - x[L_AL]) / p[P_LAGA]
    if p[P_FADE1] > 0.0 or p[P_FADE2] > 0.0:
        for i in range(2):
            out[WXD + i] -= p[P_FADE1] * x[WXD + i]
            out[WXDD + i] -= p[P_FADE2] * x[WXDD + i]


@jit
def propagate(XX: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, W: np.ndarray) -> None:
    """Advance every row of XX [k,n] by dt [s] with u held, in place: one explicit midpoint step; W [2,n] is workspace."""
    n = XX.shape[1]
    for r in range(XX.shape[0]):
        x = XX[r]
        rates(x, u, p, W[W_RATE])
        for i in range(n):
            W[W_MID, i] = x[i] + 0.5 * dt * W[W_RATE, i]
        rates(W[W_MID], u, p, W[W_RATE])
        for i in range(n):
            x[i] += dt * W[W_RATE, i]


@jit
def measure(XX: np.ndarray, codes: np.ndarray, m: int, u: np.ndarray, p: np.ndarray, Y: np.ndarray) -> None:
    """Y [k,>=m] <- the m channels `codes` (Y_H ..) of every row of XX [k,n] with controls u in force.

    The wind rates cancel in the inertial accelerations; lift and drag enter instead. With 26 states each reading has its error.
    """
    n = XX.shape[1]
    for r in range(XX.shape[0]):
        x = XX[r]
        sg, cg = math.sin(x[GA]), math.cos(x[GA])
        ax, ah, known = 0.0, 0.0, False
        for j in range(m):
            c = codes[j]
            v = 0.0
            if c == Y_H:
                v = x[H]
            elif c == Y_VG:
                v = x[VA] * cg + x[WX]
            elif c == Y_VA:
                v = x[VA]
            elif c == Y_AL:
                v = x[AL]
            elif c == Y_TH:
                v = x[GA] + x[AL]
            elif c == Y_Q:
                v = x[Q]
            elif c == Y_HD:
                v = x[VA] * sg + x[WH]
            elif c == Y_RA:
                v = x[H]
            else:
                if not known:
                    kl, kd = p[P_KL], p[P_KD]
                    if n > KD:
                        kl, kd = x[KL], x[KD]
                    lift, drag = lift_drag(x[VA], x[AL], u[DE], kl, kd, p)
                    theta = x[GA] + x[AL]
                    ax = (1e3 * x[T] * math.cos(theta) - drag * cg - lift * sg) / p[P_M]
                    ah = (1e3 * x[T] * math.sin(theta) - drag * sg + lift * cg) / p[P_M] - p[P_G]
                    known = True
                v = ax if c == Y_XDD else ah
            if n > NX:
                v = misread(v, c, x, p)
            Y[r, j] = v


@jit
def misread(v: float, c: int, x: np.ndarray, p: np.ndarray) -> float:
    """The reading of channel c that the state x [26] makes of what it measures, v."""
    if c == Y_VA:
        return x[L_VA] if p[P_LAGV] > 0.0 else v
    if c == Y_RA:
        return v * (1.0 + x[K_R])
    if c == Y_Q:
        return v + x[B_Q]
    if c == Y_XDD:
        return v + x[B_AX]
    if c == Y_HDD:
        return v + x[B_AH]
    if c == Y_AL:
        return (x[L_AL] if p[P_LAGA] > 0.0 else v) + x[B_AL]
    if c == Y_HD:
        return v + x[B_HD]
    return v + x[B_H] if c == Y_H else v


@jit
def f_factor(x: np.ndarray, g: float) -> float:
    """Hazard index F [-] of a state x [>=11], > 0 where the wind takes energy; seed (8) with w_x' for w_z'."""
    return (x[WXD] * math.cos(x[GA]) + x[WHD] * math.sin(x[GA])) / g - x[WH] / x[VA]


@jit
def turbulence_columns(x: np.ndarray, step_x: float, step_h: float, col: int, SQ: np.ndarray) -> None:
    """Columns col, col+1 of the noise factor SQ [n,>=col+2] <- what wind steps along x and up [m/s] do to a state x [n].

    The aircraft keeps its inertial velocity and pitch when the wind steps; airspeed, path and incidence take it up: the discrete
    counterpart of the wind rates in (3) and (4).
    """
    sg, cg, V = math.sin(x[GA]), math.cos(x[GA]), x[VA]
    for i in range(x.shape[0]):
        SQ[i, col] = 0.0
        SQ[i, col + 1] = 0.0
    SQ[WX, col] = step_x
    SQ[VA, col] = -step_x * cg
    SQ[GA, col] = step_x * sg / V
    SQ[AL, col] = -step_x * sg / V
    SQ[WH, col + 1] = step_h
    SQ[VA, col + 1] = -step_h * sg
    SQ[GA, col + 1] = -step_h * cg / V
    SQ[AL, col + 1] = step_h * cg / V


@jit
def turbulence_drift(x: np.ndarray, q_x: float, q_h: float) -> float:
    """What white wind steps of intensities q_x, q_h [m/s/sqrt(s)] add to the mean airspeed [m/s^2] of a state x [>=4].

    Second-order (Ito) term of Va = |v - w|: steps across the path lengthen the air velocity whichever their sign. Without it a
    filter in turbulence is biased in w_x by tenths of a m/s.
    """
    sg, cg = math.sin(x[GA]), math.cos(x[GA])
    return 0.5 * (q_h * q_h * cg * cg + q_x * q_x * sg * sg) / x[VA]
