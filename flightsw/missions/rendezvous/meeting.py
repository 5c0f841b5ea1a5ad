"""One step of the whole meeting around the turn law: from which side, in whose axes, whether it can succeed, the leg after it.

The turn law flies a left turn in axes that point to where the receiver comes from. Here the axes follow the course the receiver
really flies once it has left its plan, are mirrored when the tanker stands on the other side of the track, and a heading away
from the receiver counts as the turn that gains offset. Before the turn its end is predicted and, where it lies outside the box
of a rendezvous, announced; a turn the bank limit carries past the track is started early and followed by a leg back.
Frame R in, bank in R out (left positive); SI.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.frame import E_VX, E_VY, E_X, E_Y
from flightsw.missions.rendezvous.turn_geometry import (
    O_DELTA,
    O_PHI,
    O_PSI,
    O_V,
    O_WX,
    O_WY,
    O_X,
    O_Y,
    T_LEAST,
    T_LIMITED,
    T_TIME,
    T_XM,
    T_YM,
    turn_point,
)
from flightsw.missions.rendezvous.turn_law import (
    APPROACH,
    DONE,
    G_BANK,
    G_PHASE,
    G_TIME,
    G_TTG,
    G_V,
    G_WAIT,
    G_XM,
    G_YM,
    GP_BANK_MAX,
    GP_BANK_MIN,
    GP_G,
    GP_HEADING_GAIN,
    GP_JOIN,
    GP_JOIN_FROM,
    GP_ROLL,
    GP_SEP,
    GP_STEER_BANK,
    GP_STEER_MAX,
    GP_TRIM,
    GP_V,
    NEVER,
    TURN,
    approach_bank,
    guidance_step,
    heading_bank,
)

_ROUND = 0.2  # [rad] beyond the steering's largest heading the tanker first turns towards the receiver
_TURNS_S = 60.0  # [s] of a leg that its turns and its last stretch take
_CAUTION = 0.4  # share of the sigma that counts against announcing a turn that is late already
_LATE = 2.0  # sizes of the box a turn at the bank limit is late by, from which on it is flown slower to be sooner over
LEG = 4  # phase after roll-out, besides those of the turn law

# parameters mp
(
    MP_SIDES,  # 1: the turn may be flown from either side
    MP_BOX_X,  # [m] half sizes of the box a rendezvous ends in
    MP_BOX_Y,
    MP_EDGE,  # share of the box beyond which a miss is announced
    MP_AHEAD,  # [s] before the turn from which on its end is judged
    MP_LEG,  # [s] longest leg; 0: none
    MP_LEG_ANGLE,  # [rad] to the track
    MP_LEG_GAIN,  # [rad/m] heading per distance from the track
    MP_LEG_TAU,  # [s] over which a miss along track is flown off
    MP_LEG_FROM,  # share of the box from which on a leg is flown
    MP_LEG_TO,  # share of the box that ends it
    MP_SPEED,  # [m/s] beyond the trim at which the receiver's speed is announced
    MP_SURE,  # sigma of the estimate by which a predicted miss lies outside to be announced
    MP_HOLD,  # [s] before the turn from which on the heading is held, so that it begins with wings level
    MP_N,
) = range(15)
# state ms: side (0 not chosen, 1 as printed, -1 mirrored), whole turns added to the heading [rad], rotation of the axes [rad],
# start of the leg [s], announcements, predicted misses at the roll-out [m], 1 while turning towards the receiver first
# 1 while a leg leads away from the track
M_SIDE, M_TURNS, M_CHI, M_SINCE, M_SAID, M_XP, M_YP, M_AWAY, M_OUT, M_N = range(10)
# announcements, added up
SAY_LEG = 1  # the turn ends beside the track, a leg follows
SAY_FAR = 2  # neither turn nor leg reaches the box
SAY_SPEED = 4  # the receiver flies faster or slower than the tanker can
SAY_MISSED = 8  # over, and outside the box


@jit
def meeting_reset(ms: np.ndarray) -> None:
    """ms [9] <- nothing chosen, nothing said."""
    for i in range(M_N):
        ms[i] = 0.0


@jit
def own_course(
    o: np.ndarray, r: np.ndarray, side: float, chi: float, speed: float, o2: np.ndarray, r2: np.ndarray
) -> None:
    """o2 [8], r2 [4] <- own state and receiver in axes turned by chi [rad] and, with side -1, mirrored in their x axis.

    speed [m/s] is the tanker's on the track: the drift correction there is asin(w_y/speed) of the turned wind.
    """
    c, s = math.cos(chi), math.sin(chi)
    o2[O_X], o2[O_Y] = c * o[O_X] + s * o[O_Y], side * (c * o[O_Y] - s * o[O_X])
    o2[O_WX], o2[O_WY] = c * o[O_WX] + s * o[O_WY], side * (c * o[O_WY] - s * o[O_WX])
    o2[O_PSI], o2[O_PHI], o2[O_V] = side * (o[O_PSI] - chi), side * o[O_PHI], o[O_V]
    o2[O_DELTA] = math.asin(min(max(o2[O_WY] / speed, -0.99), 0.99))
    r2[E_X], r2[E_Y] = c * r[E_X] + s * r[E_Y], side * (c * r[E_Y] - s * r[E_X])
    r2[E_VX], r2[E_VY] = c * r[E_VX] + s * r[E_VY], side * (c * r[E_VY] - s * r[E_VX])


@jit
def choose_side(ms: np.ndarray, o: np.ndarray, r: np.ndarray, gp: np.ndarray, mp: np.ndarray) -> None:
    """ms: side of the track, by where the tanker stands; which way round a heading away from the receiver is turned.

    Turning round moves the tanker by twice the radius: outward when it is nearer to the track than one radius, else inward.
    """
    ms[M_SIDE] = -1.0 if mp[MP_SIDES] > 0.0 and o[O_Y] > r[E_Y] else 1.0
    psi = ms[M_SIDE] * o[O_PSI]
    if abs(psi) <= gp[GP_STEER_MAX] + _ROUND:
        return
    ms[M_AWAY] = 1.0
    outward = abs(o[O_Y] - r[E_Y]) < gp[GP_V] * gp[GP_V] / (gp[GP_G] * math.tan(gp[GP_STEER_BANK]))
    if outward and psi > 0.0:
        ms[M_TURNS] = -ms[M_SIDE] * 2.0 * math.pi
    elif not outward and psi < 0.0:
        ms[M_TURNS] = ms[M_SIDE] * 2.0 * math.pi


@jit
def outside(x: float, y: float, sx: float, sy: float, mp: np.ndarray) -> bool:
    """Whether a predicted miss (x, y) [m] lies beyond the announced share of the box by MP_SURE sigma sx, sy [m]."""
    k = mp[MP_SURE]
    return abs(x) - k * sx > mp[MP_EDGE] * mp[MP_BOX_X] or abs(y) - k * sy > mp[MP_EDGE] * mp[MP_BOX_Y]


@jit
def beyond(x: float, y: float, share: float, mp: np.ndarray) -> bool:
    """Whether a miss (x, y) [m] lies outside this share of the box."""
    return abs(x) > share * mp[MP_BOX_X] or abs(y) > share * mp[MP_BOX_Y]


@jit
def less(x: float, reach: float) -> float:
    """What is left of x [m] when up to `reach` [m] of it can be flown off."""
    return math.copysign(max(abs(x) - reach, 0.0), x)


@jit
def judge_turn(
    ms: np.ndarray, left: float, o: np.ndarray, r: np.ndarray, sx: float, sy: float, gp: np.ndarray, mp: np.ndarray,
    t: np.ndarray, o2: np.ndarray, r2: np.ndarray,
) -> int:  # fmt: skip
    """Announcements about a turn to begin in `left` [s] on the present heading; ms keeps the misses it is predicted to end with.

    o [8], r [4] in the axes of the turn, sx, sy [m] sigma of the receiver's place; t [9], o2 [8], r2 [4] scratch. The speed trim
    is counted on over the turn and the leg.
    """
    for i in range(8):
        o2[i] = o[i]
    o2[O_X] += (o[O_V] * math.cos(o[O_PSI]) + o[O_WX]) * left
    o2[O_Y] += (o[O_V] * math.sin(o[O_PSI]) + o[O_WY]) * left
    r2[E_X], r2[E_Y], r2[E_VX], r2[E_VY] = r[E_X] + r[E_VX] * left, r[E_Y] + r[E_VY] * left, r[E_VX], r[E_VY]
    turn_point(o2, r2, gp[GP_BANK_MAX], gp[GP_BANK_MIN], gp[GP_SEP], gp[GP_ROLL], True, gp[GP_G], t)
    y = t[T_YM] if t[T_LIMITED] > 0.0 else 0.0
    back = abs(y) * gp[GP_JOIN] if abs(y) > mp[MP_LEG_FROM] * mp[MP_BOX_Y] else 0.0  # what the leg gives up along track
    x = t[T_XM] - back
    ms[M_XP], ms[M_YP] = less(t[T_XM], gp[GP_TRIM] * t[T_TIME]), y
    if t[T_LIMITED] == 0.0 and ms[M_XP] < 0.0:
        # late: two arcs, the first at the bank limit, come out about where the whole turn at it would along track
        turn_point(o2, r2, gp[GP_BANK_MAX], gp[GP_BANK_MAX], gp[GP_SEP], gp[GP_ROLL], True, gp[GP_G], t)
        ms[M_XP] = x = min(t[T_XM], 0.0)
        sx *= _CAUTION  # nothing is left to wait for
    said = 0
    if outside(ms[M_XP], y, sx, sy, mp):
        said = SAY_LEG
        if mp[MP_LEG] == 0.0 or outside(less(x, gp[GP_TRIM] * (t[T_TIME] + mp[MP_LEG])), 0.0, sx, sy, mp):
            said = SAY_LEG + SAY_FAR
    apart = math.hypot(r[E_VX] - o[O_WX], r[E_VY] - o[O_WY]) - gp[GP_V]
    if abs(apart) > gp[GP_TRIM] + mp[MP_SPEED]:
        said += SAY_SPEED
    return said


@jit
def tight_speed(o: np.ndarray, r: np.ndarray, t: np.ndarray, gp: np.ndarray) -> float:
    """Airspeed [m/s] in a turn t [9] at the bank limit that is to end ahead by what the leg after it costs.

    At a fixed bank the radius goes with v^2 and the time with v, so that more speed makes the tanker later while most of the
    turn is ahead: dx_m/dv = v_Rx T/v + 2 r (sin delta + sin psi)/v, of x_m (60h). The step that takes the error away,
    within the trim.
    """
    slope = (r[E_VX] * t[T_TIME] + 2.0 * t[T_LEAST] * (math.sin(o[O_DELTA]) + math.sin(o[O_PSI]))) / o[O_V]
    x = t[T_XM] - abs(t[T_YM]) * gp[GP_JOIN]
    if abs(slope) < 10.0:
        return gp[GP_V]
    return gp[GP_V] + min(max(-x / slope, -gp[GP_TRIM]), gp[GP_TRIM])


@jit
def fly_leg(ms: np.ndarray, gs: np.ndarray, o: np.ndarray, r: np.ndarray, gp: np.ndarray, mp: np.ndarray) -> None:
    """Bank and airspeed of the leg: heading to the track by the distance from it, speed by the miss along it.

    Further ahead than the way back costs, it first leads away from the track: each metre of it costs tan(angle/2) along track
    twice, out and back, where the speed trim alone would take minutes.
    """
    x, y = r[E_X] - gp[GP_SEP] - o[O_X], r[E_Y] - o[O_Y]
    tan_half = math.tan(0.5 * mp[MP_LEG_ANGLE])
    ahead = x - abs(y) * tan_half
    way = (abs(y) + ahead / tan_half) / (o[O_V] * math.sin(mp[MP_LEG_ANGLE]))  # out and back
    if ahead > mp[MP_LEG_FROM] * mp[MP_BOX_X] and way + _TURNS_S < ms[M_SINCE] + mp[MP_LEG] - gs[G_TIME]:
        ms[M_OUT] = 1.0
    elif ahead <= 0.0:
        ms[M_OUT] = 0.0
    a = min(max(mp[MP_LEG_GAIN] * y, -mp[MP_LEG_ANGLE]), mp[MP_LEG_ANGLE])
    if ms[M_OUT] > 0.0:
        a = -math.copysign(mp[MP_LEG_ANGLE], y)
    error = math.pi + o[O_DELTA] - a - o[O_PSI]
    gs[G_BANK] = heading_bank(error, o[O_V], gp[GP_HEADING_GAIN], gp[GP_STEER_BANK], gp[GP_G])
    pace = math.hypot(r[E_VX] - o[O_WX], r[E_VY] - o[O_WY])  # the receiver's airspeed
    want = pace - ahead / mp[MP_LEG_TAU]
    gs[G_V] = min(max(want, gp[GP_V] - gp[GP_TRIM]), gp[GP_V] + gp[GP_TRIM])
    gs[G_XM], gs[G_YM], gs[G_WAIT] = x, y, NEVER


@jit
def meeting_step(
    ms: np.ndarray, gs: np.ndarray, o: np.ndarray, r: np.ndarray, sx: float, sy: float, follow: bool, range_m: float,
    dt: float, gp: np.ndarray, mp: np.ndarray, t: np.ndarray, radii: np.ndarray, o2: np.ndarray, r2: np.ndarray,
    o3: np.ndarray, r3: np.ndarray,
) -> int:  # fmt: skip
    """Advance the meeting ms [9] and the turn gs [13] by dt [s]; returns what is announced now (SAY_*, 0: nothing).

    o [8] own state, r [4] receiver in R, sx, sy [m] sigma of its place; follow: the receiver has left its plan, its course sets
    the axes. gs[G_BANK] is in R.
    t [9], radii [2], o2, o3 [8], r2, r3 [4]: scratch.
    """
    if ms[M_SIDE] == 0.0:
        choose_side(ms, o, r, gp, mp)
    ms[M_CHI] = math.atan2(-r[E_VY], -r[E_VX]) if follow else 0.0
    side = ms[M_SIDE]
    own_course(o, r, side, ms[M_CHI] - ms[M_TURNS], gp[GP_V], o2, r2)
    gs[G_BANK] *= side
    said = 0
    if gs[G_PHASE] == LEG:
        gs[G_TIME] += dt
        fly_leg(ms, gs, o2, r2, gp, mp)
        level = abs(math.pi + o2[O_DELTA] - o2[O_PSI]) < 0.1
        there = level and not beyond(gs[G_XM], gs[G_YM], mp[MP_LEG_TO], mp)
        if there or gs[G_TIME] - ms[M_SINCE] >= mp[MP_LEG]:
            gs[G_PHASE] = DONE
    elif ms[M_AWAY] > 0.0:
        if abs(o2[O_PSI]) <= gp[GP_STEER_MAX] + _ROUND:
            ms[M_AWAY] = 0.0
            if mp[MP_SIDES] > 0.0 and o2[O_Y] > r2[E_Y]:
                ms[M_SIDE] = -side
        gs[G_TIME] += dt
        gs[G_BANK] = approach_bank(o2, r2, gs, gp)
        gs[G_V], gs[G_TTG], gs[G_WAIT] = gp[GP_V], NEVER, NEVER
    else:
        before = gs[G_PHASE]
        guidance_step(gs, o2, r2, range_m, dt, gp, t, radii)
        if before == APPROACH and (gs[G_PHASE] != APPROACH or gs[G_WAIT] < mp[MP_AHEAD]):
            left = max(gs[G_WAIT], 0.0) if gs[G_PHASE] == APPROACH else 0.0
            said = judge_turn(ms, left, o2, r2, sx, sy, gp, mp, t, o3, r3)
        if gs[G_PHASE] == APPROACH and gs[G_WAIT] < mp[MP_HOLD]:
            gs[G_BANK] = 0.0
        if gs[G_PHASE] == TURN and gp[GP_JOIN] > 0.0:
            past = t[T_LIMITED] > 0.0 and abs(t[T_YM]) > gp[GP_JOIN_FROM]
            if past or (t[T_XM] < -_LATE * mp[MP_BOX_X] and gs[G_BANK] > 0.99 * gp[GP_BANK_MAX]):
                gs[G_V] = tight_speed(o2, r2, t, gp)
        if before != DONE and gs[G_PHASE] == DONE:
            x, y = r2[E_X] - gp[GP_SEP] - o2[O_X], r2[E_Y] - o2[O_Y]
            gs[G_XM], gs[G_YM] = x, y
            if mp[MP_LEG] > 0.0 and beyond(x, y, mp[MP_LEG_FROM], mp):
                gs[G_PHASE] = LEG
                ms[M_SINCE] = gs[G_TIME]
                fly_leg(ms, gs, o2, r2, gp, mp)
    if gs[G_PHASE] == DONE and beyond(gs[G_XM], gs[G_YM], mp[MP_EDGE], mp):
        said += SAY_MISSED
    gs[G_BANK] *= side
    new = said & ~int(ms[M_SAID])
    ms[M_SAID] += new
    return new
