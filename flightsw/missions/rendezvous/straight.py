"""A late turn and a leg that is behind: straight to the place ahead of the receiver, as fast as the trim allows.

Two arcs can bring the tanker there as long as it is not late: the tighter the first, the sooner. Where even the first at the
bank limit leaves it behind, a wide second arc wastes what is left, since along it the tanker falls back by
cot(psi/2) for every metre across. A straight course is shorter, and it meets the place at any distance behind: faster
than the receiver, every direction relative to it can be flown. Not in docs/sources/rivard.md: its receivers keep their plan.
Frame R in the axes of the turn, SI, bank left positive.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.rendezvous.frame import E_VX, E_VY, E_X, E_Y
from flightsw.missions.rendezvous.meeting_vectors import LAST, M_WAY, STRAIGHT, WIDE
from flightsw.missions.rendezvous.turn_geometry import (
    O_DELTA,
    O_PHI,
    O_PSI,
    O_V,
    O_WX,
    O_WY,
    O_X,
    O_Y,
    T_BANK,
    T_DPSI,
    T_LIMITED,
    ramp_straight,
)
from flightsw.missions.rendezvous.turn_law import (
    G_BANK,
    G_V,
    GP_BANK_MAX,
    GP_G,
    GP_HEADING_GAIN,
    GP_NEAR,
    GP_ROLL,
    GP_SEP,
    GP_STEER_BANK,
    GP_TRIM,
    GP_V,
    heading_bank,
)

DX, DY = 0, 1  # of a displacement
COURSE, LASTS = 0, 1  # of a straight part: heading, time
_HALVINGS = 24  # of a bracket of at most 4 rad: a microradian
_BACK = 0.5  # [rad] of heading the course may lie behind the present one
_AGAIN = 0.49  # [rad] behind it from which on the tanker is no longer late
_MUCH = 10.0  # [s] of a straight part for which the last arc is broken off
_SLOW = 1.0  # [m/s] across the track below which it is never reached


@jit
def behind(o: np.ndarray, r: np.ndarray, phi_max: float, separation: float, roll_rate: float, g: float) -> float:
    """Miss along track [m] two arcs leave that end on the track, the first at phi_max [rad]; negative: late. 0: they overshoot.

    o [8], r [4]. The arcs of `two_arcs`, which share the heading left: the first at the least radius, the second as wide as the
    track asks.
    """
    psi, v, delta = o[O_PSI], o[O_V], o[O_DELTA]
    ux, uy = r[E_VX] - o[O_WX], r[E_VY] - o[O_WY]
    mid, d = 0.5 * (psi + math.pi + delta), 0.5 * (math.pi + delta - psi)
    s0, s1, s2 = math.sin(psi), math.sin(mid), -math.sin(delta)
    c0, c1, c2 = math.cos(psi), math.cos(mid), -math.cos(delta)
    t_out = ramp_straight(o[O_PHI], roll_rate)
    bx = r[E_X] - separation - o[O_X] - t_out * (v * c2 - ux)
    by = r[E_Y] - o[O_Y] - t_out * (v * s2 - uy)
    low = v * v / (g * math.tan(phi_max))
    left, across = by - (c0 - c1 - uy * d / v) * low, c1 - c2 - uy * d / v
    if across <= 0.0 or left < across * low:
        return 0.0
    return bx - (s1 - s0 - ux * d / v) * low - (s2 - s1 - ux * d / v) * left / across


@jit
def arc(psi: float, to: float, radius: float, v: float, ux: float, uy: float, xy: np.ndarray) -> None:
    """xy [2] <- displacement [m] of a left arc from heading psi to `to` [rad] relative to who flies (ux, uy) [m/s]."""
    t = radius * (to - psi) / v
    xy[DX] = radius * (math.sin(to) - math.sin(psi)) - ux * t
    xy[DY] = radius * (math.cos(psi) - math.cos(to)) - uy * t


@jit_own
def straight_course(
    o: np.ndarray, r: np.ndarray, speed: float, phi_first: float, phi_last: float, near: float, separation: float,
    roll_rate: float, g: float, out: np.ndarray,
) -> None:  # fmt: skip
    """out [2] <- heading [rad] and time [s] of the straight part of arc, straight, arc to the place ahead.

    o [8], r [4]. First arc at the present airspeed and bank phi_first [rad], straight and last arc at `speed` [m/s] and phi_last.
    Relative to the receiver's air velocity u the straight part is along v e(h) - u; h is where that points to what both arcs
    leave: a zero of the cross product, by halving; no nearer to the track's own heading than near [rad], where it would take for
    ever. Behind a receiver that is faster the heading that falls back least on the way to its track, cos = -speed/|u|.
    """
    psi, delta = o[O_PSI], o[O_DELTA]
    ux, uy = r[E_VX] - o[O_WX], r[E_VY] - o[O_WY]
    pace, end = math.hypot(ux, uy), math.pi + delta
    least = math.acos(speed / pace) if pace > speed else 0.0
    r1, r2 = o[O_V] * o[O_V] / (g * math.tan(phi_first)), speed * speed / (g * math.tan(phi_last))
    t_out = ramp_straight(phi_last, roll_rate)
    bx = r[E_X] - separation - o[O_X] - t_out * (speed * math.cos(end) - ux)
    by = r[E_Y] - o[O_Y] - t_out * (speed * math.sin(end) - uy)
    low, high, xy = psi - _BACK, end - max(near, least), np.empty(2)
    for i in range(_HALVINGS + 1):
        h = high if i == _HALVINGS else 0.5 * (low + high)
        arc(h, end, r2, speed, ux, uy, xy)
        x, y = bx - xy[DX], by - xy[DY]
        if h > psi:
            arc(psi, h, r1, o[O_V], ux, uy, xy)
            x, y = x - xy[DX], y - xy[DY]
        wx, wy = speed * math.cos(h) - ux, speed * math.sin(h) - uy
        if i == _HALVINGS:
            out[COURSE], out[LASTS] = h, y / max(wy, _SLOW)
        elif x * wy < y * wx:
            low = h
        else:
            high = h


@jit
def late_turn(
    ms: np.ndarray,
    gs: np.ndarray,
    o: np.ndarray,
    r: np.ndarray,
    t: np.ndarray,
    gp: np.ndarray,
    again: bool,
    out: np.ndarray,
) -> bool:
    """Bank and airspeed gs of a turn t [9] that is late; False: it is not, and nothing is changed. ms keeps the way it goes.

    o [8], r [4] in the axes of the turn; out [2] scratch. Begun where two arcs come out behind; given up where an estimate
    that has changed asks for a heading already passed. From the straight part onto the track by the bank that ends on it; with
    again, back to the straight part where an estimate that has changed leaves much of it after all.
    """
    if ms[M_WAY] == WIDE:
        if t[T_LIMITED] > 0.0 or t[T_DPSI] < gp[GP_NEAR]:
            return False
        if behind(o, r, gp[GP_BANK_MAX], gp[GP_SEP], gp[GP_ROLL], gp[GP_G]) >= 0.0:
            return False
    if ms[M_WAY] != LAST or (again and t[T_DPSI] > gp[GP_NEAR]):
        fast = gp[GP_V] + gp[GP_TRIM]
        straight_course(
            o,
            r,
            fast,
            gp[GP_BANK_MAX],
            gp[GP_STEER_BANK],
            gp[GP_NEAR],
            gp[GP_SEP],
            gp[GP_ROLL],
            gp[GP_G],
            out,
        )
        if out[COURSE] < o[O_PSI] - _AGAIN:
            ms[M_WAY] = WIDE
            return False
        # both rolls, out of the first arc and into the last, are part of the straight
        rolls = ramp_straight(o[O_PHI], gp[GP_ROLL]) + ramp_straight(gp[GP_STEER_BANK], gp[GP_ROLL])
        longer = rolls if ms[M_WAY] != LAST else rolls + _MUCH
        ms[M_WAY] = STRAIGHT if out[LASTS] > longer else LAST
        if ms[M_WAY] == STRAIGHT:
            gs[G_BANK] = heading_bank(out[COURSE] - o[O_PSI], o[O_V], gp[GP_HEADING_GAIN], gp[GP_BANK_MAX], gp[GP_G])
            gs[G_V] = fast
            return True
    gs[G_BANK] = t[T_BANK]
    return True


@jit
def leg_angle(x: float, y: float, ux: float, uy: float, delta: float, speed: float) -> float:
    """Angle [rad] to the track of the straight course that meets the place (x, y) [m] ahead and across, at `speed` [m/s].

    (ux, uy) [m/s] the receiver's air velocity, delta [rad] the drift correction: v sin(h - lambda) = u n, with lambda the line
    of sight to the place and n its normal. pi/2 where it is not faster than the receiver or the place not behind.
    """
    los = math.atan2(y, x)
    across = uy * math.cos(los) - ux * math.sin(los)
    if speed <= math.hypot(ux, uy):
        return 0.5 * math.pi
    h = los + math.asin(across / speed)
    return min(abs(math.pi + delta - (h if h > 0.0 else h + 2.0 * math.pi)), 0.5 * math.pi)
