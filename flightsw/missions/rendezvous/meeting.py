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
from flightsw.missions.rendezvous.judging import beyond, judge_turn, missed
from flightsw.missions.rendezvous.leg import fly_leg, leg_limit, leg_share
from flightsw.missions.rendezvous.meeting_vectors import (
    LEG,
    M_AWAY,
    M_CHI,
    M_N,
    M_SAID,
    M_SIDE,
    M_SINCE,
    M_TURNS,
    MP_AGAIN,
    MP_AHEAD,
    MP_BOX_X,
    MP_DOUBT,
    MP_HOLD,
    MP_LEG,
    MP_LEG_FROM,
    MP_LEG_TO,
    MP_SIDES,
    MP_STRAIGHT,
    SAY_MISSED,
)
from flightsw.missions.rendezvous.straight import late_turn
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
    GP_G,
    GP_JOIN,
    GP_JOIN_FROM,
    GP_SEP,
    GP_STEER_BANK,
    GP_STEER_MAX,
    GP_TRIM,
    GP_V,
    NEVER,
    TURN,
    approach_bank,
    guidance_step,
)

_ROUND = 0.2  # [rad] beyond the steering's largest heading the tanker first turns towards the receiver
_LATE = 2.0  # sizes of the box a turn at the bank limit is late by, from which on it is flown slower to be sooner over


@jit
def meeting_reset(ms: np.ndarray) -> None:
    """ms [10] <- nothing chosen, nothing said."""
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
def meeting_step(
    ms: np.ndarray, gs: np.ndarray, o: np.ndarray, r: np.ndarray, P4: np.ndarray, follow: bool, sided: bool,
    range_m: float, dt: float, gp: np.ndarray, mp: np.ndarray, t: np.ndarray, radii: np.ndarray, o2: np.ndarray, r2: np.ndarray,
    o3: np.ndarray, r3: np.ndarray,
) -> int:  # fmt: skip
    """Advance the meeting ms [10] and the turn gs [13] by dt [s]; returns what is announced now (SAY_*, 0: nothing).

    o [8] own state, r [4] receiver in R, P4 [4,4] its covariance; follow: the receiver has left its plan, its course sets the
    axes; sided: bearings or its own position tell on which side of the tanker it is. gs[G_BANK] is in R.
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
        limit = leg_limit(ms, gs, o2, r2, sided, gp, mp)
        fly_leg(ms, gs, o2, r2, limit, gp, mp)
        level = abs(math.pi + o2[O_DELTA] - o2[O_PSI]) < 0.1
        there = level and not beyond(gs[G_XM], gs[G_YM], leg_share(limit, mp) * mp[MP_LEG_TO], mp)
        if there or gs[G_TIME] - ms[M_SINCE] >= limit:
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
            said = judge_turn(ms, left, o2, r2, P4, sided, gp, mp, t, o3, r3)
        if gs[G_PHASE] == APPROACH and gs[G_WAIT] < mp[MP_HOLD]:
            gs[G_BANK] = 0.0
        late = mp[MP_STRAIGHT] > 0.0 and follow and gs[G_PHASE] == TURN
        late = late and late_turn(ms, gs, o2, r2, t, gp, mp[MP_AGAIN] > 0.0, radii)
        if gs[G_PHASE] == TURN and gp[GP_JOIN] > 0.0 and not late:
            past = t[T_LIMITED] > 0.0 and abs(t[T_YM]) > gp[GP_JOIN_FROM]
            if past or (t[T_XM] < -_LATE * mp[MP_BOX_X] and gs[G_BANK] > 0.99 * gp[GP_BANK_MAX]):
                gs[G_V] = tight_speed(o2, r2, t, gp)
        if before != DONE and gs[G_PHASE] == DONE:
            x, y = r2[E_X] - gp[GP_SEP] - o2[O_X], r2[E_Y] - o2[O_Y]
            gs[G_XM], gs[G_YM] = x, y
            ms[M_SINCE] = gs[G_TIME]
            limit = leg_limit(ms, gs, o2, r2, sided, gp, mp)
            if mp[MP_LEG] > 0.0 and beyond(x, y, leg_share(limit, mp) * mp[MP_LEG_FROM], mp):
                gs[G_PHASE] = LEG
                fly_leg(ms, gs, o2, r2, limit, gp, mp)
    mirror = mp[MP_DOUBT] > 0.0 and follow and not sided
    if gs[G_PHASE] == DONE and missed(gs[G_XM], gs[G_YM], gp[GP_SEP], mirror, mp):
        said += SAY_MISSED
    gs[G_BANK] *= side
    new = said & ~int(ms[M_SAID])
    ms[M_SAID] += new
    return new
