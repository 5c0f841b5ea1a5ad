"""Geometry of the rendezvous turn: turn point, nominal offset, roll-out lead, two-arc plan. Rivard (1982), 50 to 62.

Frame R (x to the initial point, y 90 deg counter-clockwise, psi counter-clockwise and never wrapped, bank positive left), SI.
The final heading is pi + delta, delta the tanker's drift correction asin(w_y/v_T).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.frame import E_VX, E_VY, E_X, E_Y

# own state o [8]
O_X, O_Y, O_PSI, O_PHI, O_V, O_WX, O_WY, O_DELTA = 0, 1, 2, 3, 4, 5, 6, 7
# estimate r [4]: E_* (frame.py)
# turn t [9]: ..., radius and least radius [m]
T_BANK, T_TIME, T_XM, T_YM, T_TTG, T_LIMITED, T_DPSI, T_RADIUS, T_LEAST = range(9)
T_N = 9
FIRST, SECOND = 0, 1  # of two arcs


@jit
def offset_for_bank(phi: float, v: float, delta: float, w_y: float, g: float) -> float:
    """Lateral offset [m] from which a half turn at bank phi [rad] ends on the receiver's track (Rivard 55)."""
    return v / (g * math.tan(phi)) * (2.0 * v * math.cos(delta) + (math.pi + 2.0 * delta) * w_y)


@jit
def rollout_lead(phi: float, v: float, roll_rate: float, g: float) -> float:
    """Heading swept [rad] while the bank phi [rad] goes to zero at roll_rate [rad/s]; 0 for an unlimited rate (0)."""
    if roll_rate <= 0.0 or phi == 0.0:
        return 0.0
    return math.copysign(-g / (v * roll_rate) * math.log(math.cos(phi)), phi)


@jit
def ramp_straight(phi: float, roll_rate: float) -> float:
    """Time [s] of straight flight that, with full rate for the rest, equals a ramp of bank between 0 and phi [rad].

    The ramp lasts phi/p and sweeps g/(v p) (-ln cos phi), at full rate done in -ln cos phi/(p tan phi). Small phi: half the ramp.
    """
    if roll_rate <= 0.0 or phi == 0.0:
        return 0.0
    return (abs(phi) + math.log(math.cos(phi)) / abs(math.tan(phi))) / roll_rate


@jit
def turn_point(
    o: np.ndarray, r: np.ndarray, phi_max: float, phi_min: float, separation: float, roll_rate: float, entry: bool,
    g: float, t: np.ndarray,
) -> None:  # fmt: skip
    """t [9] <- constant bank that ends on the receiver's track, time of the turn, predicted miss and time to go (60a to i).

    o [8] own state, r [4] estimate; miss (x_m, y_m) [m] at roll-out of a turn begun now: x_m = x - separation - x_T, y_m = y
    - y_T. Bank is bounded by [phi_min, phi_max] [rad]; a receiver on the wrong side (y <= y_T) takes phi_max.
    With a roll rate [rad/s] > 0 each ramp counts as straight flight for ramp_straight, at entry (entry) and exit.
    """
    psi, v, wx, wy, delta = o[O_PSI], o[O_V], o[O_WX], o[O_WY], o[O_DELTA]
    cd, sd = (math.cos(delta), math.sin(delta)) if delta != 0.0 else (1.0, 0.0)
    cp, sp = math.cos(psi), math.sin(psi)
    dpsi = math.pi + delta - psi
    num = v * (v * (cd + cp) + dpsi * wy)
    dx_s, dy_s, t_s = 0.0, 0.0, 0.0
    tan_max = math.tan(phi_max)
    tan_phi, phi, limited = tan_max, phi_max, True
    for _ in range(3 if roll_rate > 0.0 else 1):
        den = g * (r[E_Y] - o[O_Y] - dy_s)
        if den > 0.0 and num < den * tan_max:
            tan_phi, limited = (num / den if num > 0.0 else 0.0), False
            phi = math.atan(tan_phi)
            if phi < phi_min:
                phi, tan_phi = phi_min, math.tan(phi_min)
        else:
            tan_phi, phi, limited = tan_max, phi_max, True
        if roll_rate > 0.0:
            half = ramp_straight(phi, roll_rate)
            t_in = half if entry else 0.0
            dx_s = t_in * (v * cp + wx) + half * (wx - v * cd)
            dy_s = t_in * (v * sp + wy) + half * (wy - v * sd)
            t_s = t_in + half
    c = v / (g * tan_phi)
    t[T_RADIUS] = c * v
    t[T_LEAST] = v * v / (g * tan_max)
    t[T_BANK] = phi
    t[T_TIME] = dpsi * c + t_s
    t[T_XM] = r[E_X] + r[E_VX] * t[T_TIME] - separation - (o[O_X] + dx_s + c * (v * (-sd - sp) + dpsi * wx))
    t[T_YM] = r[E_Y] + r[E_VY] * t[T_TIME] - (o[O_Y] + dy_s + c * (v * (cd + cp) + dpsi * wy))
    closing = v * cp + wx - r[E_VX]
    t[T_TTG] = t[T_XM] / (closing if closing > 1.0 else 1.0)
    t[T_LIMITED] = 1.0 if limited else 0.0
    t[T_DPSI] = dpsi


@jit
def join_lead(o: np.ndarray, r: np.ndarray, t: np.ndarray, tan_half: float, least: float) -> float:
    """Time [s] a turn t [9] that the bank limit carries past the track starts earlier, so that the leg back ends in place.

    A leg at angle theta over the cross-track miss y costs |y| tan(theta/2) along the track against an aircraft that flies
    straight at the same speed: |y|/sin(theta) flown for |y|/tan(theta) gained. Misses below `least` [m] need no leg.
    """
    miss = abs(t[T_YM])
    if t[T_LIMITED] == 0.0 or miss <= least:
        return 0.0
    closing = o[O_V] * math.cos(o[O_PSI]) + o[O_WX] - r[E_VX]
    return miss * tan_half / (closing if closing > 1.0 else 1.0)


@jit
def closed_loop_bank(t: np.ndarray, k: float, v: float, phi_max: float, guard: bool, g: float) -> float:
    """Bank [rad] of the closed loop r_c = r_r + k x_m/dpsi (Rivard 62); k = 0 is the cross-track law.

    guard: r_c below the least radius, negative ones included, gives phi_max. Without it a negative r_c gives a bank to the
    right, as printed in the source. With dpsi = 0 the turn's own bank is kept.
    """
    if t[T_LIMITED] > 0.0:
        return phi_max
    if k == 0.0 or t[T_DPSI] < 1e-9:
        return t[T_BANK]
    rc = t[T_RADIUS] + k * t[T_XM] / t[T_DPSI]
    if rc < t[T_LEAST] and (guard or rc >= 0.0):
        return phi_max
    return math.atan(v * v / (g * rc)) if rc != 0.0 else phi_max


@jit
def two_arcs(
    o: np.ndarray, r: np.ndarray, phi_max: float, separation: float, smooth: float, roll_rate: float, g: float,
    radii: np.ndarray,
) -> None:  # fmt: skip
    """radii [2] [m] <- two arcs, the first up to half the heading left, that end ahead of the receiver on its track.

    Path, time and drift scale with the radius, so both misses are linear in (r1, r2): least squares with the weight
    (smooth (d1 + d2))^2 on (r1 - r2)^2 and r >= r_min (one is held at the bound, the other solved again). The roll to wings
    level is straight flight for ramp_straight.
    """
    psi, v, delta = o[O_PSI], o[O_V], o[O_DELTA]
    ux, uy = r[E_VX] - o[O_WX], r[E_VY] - o[O_WY]
    psi_f = math.pi + delta
    mid = 0.5 * (psi + psi_f)
    d = 0.5 * (psi_f - psi)
    s0, s1, s2 = math.sin(psi), math.sin(mid), -math.sin(delta)
    c0, c1, c2 = math.cos(psi), math.cos(mid), -math.cos(delta)
    t_out = ramp_straight(o[O_PHI], roll_rate)
    bx = r[E_X] - separation - o[O_X] - t_out * (v * c2 - ux)
    by = r[E_Y] - o[O_Y] - t_out * (v * s2 - uy)
    a11, a12 = s1 - s0 - ux * d / v, s2 - s1 - ux * d / v
    a21, a22 = c0 - c1 - uy * d / v, c1 - c2 - uy * d / v
    q = smooth * 2.0 * d
    q *= q
    n11, n12, n22 = a11 * a11 + a21 * a21 + q, a11 * a12 + a21 * a22 - q, a12 * a12 + a22 * a22 + q
    f1, f2 = a11 * bx + a21 * by, a12 * bx + a22 * by
    low = v * v / (g * math.tan(phi_max))
    det = n11 * n22 - n12 * n12
    if det <= 0.0:
        radii[FIRST] = radii[SECOND] = low
        return
    r1, r2 = (n22 * f1 - n12 * f2) / det, (n11 * f2 - n12 * f1) / det
    if r1 < low:
        r1 = low
        r2 = (f2 - n12 * r1) / n22
        if r2 < low:
            r2 = low
    elif r2 < low:
        r2 = low
        r1 = (f1 - n12 * r2) / n11
        if r1 < low:
            r1 = low
    radii[FIRST], radii[SECOND] = r1, r2
