"""One step of the rendezvous guidance: approach with offset steering, start of the turn, bank and speed in it, roll-out.

The caller may step at any interval; G_WAIT says how long the next change of phase is away, so that a caller who can act
between its own ticks may. Frame R, SI units, bank positive left (see missions/rendezvous/turn_geometry.py).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.frame import E_Y
from flightsw.missions.rendezvous.turn_geometry import (
    FIRST,
    O_DELTA,
    O_PHI,
    O_PSI,
    O_V,
    O_WY,
    O_Y,
    SECOND,
    T_BANK,
    T_DPSI,
    T_LIMITED,
    T_TIME,
    T_TTG,
    T_XM,
    T_YM,
    closed_loop_bank,
    join_lead,
    offset_for_bank,
    rollout_lead,
    turn_point,
    two_arcs,
)

APPROACH, TURN, ROLLOUT, DONE = 0, 1, 2, 3
CHART, CROSS_TRACK, CLOSED_LOOP, TWO_ARC = 0, 1, 2, 3

# parameter vector gp
GP_LAW = 0
GP_K = 1  # closed-loop gain [-]
GP_BANK_MAX, GP_BANK_MIN = 2, 3  # [rad]
GP_V = 4  # nominal airspeed [m/s]
GP_SEP = 5  # separation at roll-out [m]
GP_G = 6  # [m/s^2]
GP_ROLL = 7  # roll rate the plan counts on [rad/s]; 0: unlimited, no compensation
GP_LEAD = 8  # the turn starts this long before the time to go is zero [s]; negative: late
GP_CHART = 9  # slant range of the chart [m]
GP_STEER = 10  # 1: steer to the offset before the turn
GP_OFFSET = 11  # wanted offset [m]
GP_STEER_GAIN, GP_STEER_MAX, GP_STEER_BANK = 12, 13, 14  # [rad/m], [rad], [rad]
GP_HEADING_GAIN = 15  # [1/s]
GP_TRIM = 16  # largest change of airspeed [m/s]; 0: none
GP_TRIM_TAU = 17  # least time over which a miss is flown off [s]
GP_GUARD = 18  # 1: radius below the least one means full bank
GP_NEAR = 19  # heading left below which two arcs give way to the cross-track law [rad]
GP_SMOOTH = 20  # weight of unequal arcs [1/rad]
GP_WEAVE, GP_WEAVE_HALF = 21, 22  # heading weave before the turn [rad], half period [s]
GP_OFFSET_BANK = 23  # [rad] bank whose half turn in the own wind sets the offset (Rivard 55); 0: GP_OFFSET
GP_JOIN, GP_JOIN_FROM = (
    24,
    25,
)  # tan of half the angle of a leg back to the track; cross-track miss it is flown from [m]
GP_N = 26

# state and output gs
G_PHASE, G_BANK, G_V, G_TTG, G_XM, G_YM, G_LIMITED, G_TURN_TIME, G_WAIT, G_TIME, G_R1, G_R2, G_SINCE = range(13)
G_N = 13

NEVER = 1e9  # [s]
_EXACT = 1e-6  # [s], [rad]: a phase change this close is due
_LEVEL, _ROLLED = math.radians(2.0), 10.0  # wings level [rad]; roll-out taken as over after this [s]


@jit
def guidance_reset(gs: np.ndarray, gp: np.ndarray) -> None:
    """gs [13] <- approach, wings level, nominal speed."""
    for i in range(G_N):
        gs[i] = 0.0
    gs[G_PHASE] = APPROACH
    gs[G_V] = gp[GP_V]
    gs[G_TTG] = NEVER
    gs[G_WAIT] = NEVER


@jit
def heading_bank(error: float, v: float, gain: float, limit: float, g: float) -> float:
    """Bank [rad] that turns heading error [rad] away at rate gain [1/s] times it, within +-limit."""
    phi = math.atan(v * gain * error / g)
    return min(max(phi, -limit), limit)


@jit
def approach_bank(o: np.ndarray, r: np.ndarray, gs: np.ndarray, gp: np.ndarray) -> float:
    """Bank [rad] towards the wanted offset from the estimated track; the weave is added to the heading."""
    limit = gp[GP_STEER_MAX]
    offset = gp[GP_OFFSET]
    if gp[GP_OFFSET_BANK] > 0.0:
        offset = offset_for_bank(gp[GP_OFFSET_BANK], gp[GP_V], o[O_DELTA], o[O_WY], gp[GP_G])
    psi_c = gp[GP_STEER_GAIN] * (r[E_Y] - offset - o[O_Y])
    psi_c = min(max(psi_c, -limit), limit)
    if gp[GP_WEAVE] > 0.0:
        psi_c += gp[GP_WEAVE] if int(gs[G_TIME] / gp[GP_WEAVE_HALF]) % 2 == 0 else -gp[GP_WEAVE]
    return heading_bank(psi_c - o[O_DELTA] - o[O_PSI], o[O_V], gp[GP_HEADING_GAIN], gp[GP_STEER_BANK], gp[GP_G])


@jit
def _turn_bank(o: np.ndarray, r: np.ndarray, t: np.ndarray, gs: np.ndarray, gp: np.ndarray, radii: np.ndarray) -> float:
    """Bank [rad] in the turn by the selected law."""
    law = int(gp[GP_LAW])
    v, g, top = o[O_V], gp[GP_G], gp[GP_BANK_MAX]
    if law == CHART:
        return top
    if law == TWO_ARC:
        if t[T_LIMITED] > 0.0 or t[T_DPSI] < gp[GP_NEAR]:
            return t[T_BANK]
        two_arcs(o, r, top, gp[GP_SEP], gp[GP_SMOOTH], gp[GP_ROLL], g, radii)
        gs[G_R1], gs[G_R2] = radii[FIRST], radii[SECOND]
        return math.atan(v * v / (g * radii[FIRST]))
    return closed_loop_bank(t, gp[GP_K] if law == CLOSED_LOOP else 0.0, v, top, gp[GP_GUARD] > 0.0, g)


@jit
def guidance_step(
    gs: np.ndarray,
    o: np.ndarray,
    r: np.ndarray,
    range_m: float,
    dt: float,
    gp: np.ndarray,
    t: np.ndarray,
    radii: np.ndarray,
) -> None:
    """Advance the guidance gs [13] by dt [s]: own state o [8], estimate r [4], last slant range [m]; t [9], radii [2] scratch.

    The chart (open loop) turns when range_m first falls to GP_CHART; every other law when the time to go reaches GP_LEAD.
    """
    gs[G_TIME] += dt
    gs[G_WAIT] = NEVER
    phase = int(gs[G_PHASE])
    turn_point(o, r, gp[GP_BANK_MAX], gp[GP_BANK_MIN], gp[GP_SEP], gp[GP_ROLL], phase == APPROACH, gp[GP_G], t)
    if phase <= TURN:
        gs[G_XM], gs[G_YM], gs[G_LIMITED], gs[G_TURN_TIME] = t[T_XM], t[T_YM], t[T_LIMITED], t[T_TIME]
    if phase == APPROACH:
        gs[G_TTG] = t[T_TTG]
        chart = int(gp[GP_LAW]) == CHART
        left = t[T_TTG] - gp[GP_LEAD]
        if gp[GP_JOIN] > 0.0:
            left -= join_lead(o, r, t, gp[GP_JOIN], gp[GP_JOIN_FROM])
        if (range_m <= gp[GP_CHART]) if chart else (left <= _EXACT):
            phase = TURN
            gs[G_TTG] = 0.0
        else:
            if not chart:
                gs[G_WAIT] = left
            steer = gp[GP_STEER] > 0.0
            gs[G_BANK] = approach_bank(o, r, gs, gp) if steer else 0.0
            gs[G_V] = gp[GP_V]
    if phase == TURN:
        lead = rollout_lead(o[O_PHI], o[O_V], gp[GP_ROLL], gp[GP_G])
        left = t[T_DPSI] - lead
        if left <= _EXACT:
            phase = ROLLOUT if gp[GP_ROLL] > 0.0 else DONE
            gs[G_SINCE] = gs[G_TIME]
            gs[G_BANK] = 0.0
        else:
            gs[G_BANK] = _turn_bank(o, r, t, gs, gp, radii)
            if gp[GP_TRIM] > 0.0:
                tau = max(t[T_TIME], gp[GP_TRIM_TAU])
                dv = min(max(-t[T_XM] / tau, -gp[GP_TRIM]), gp[GP_TRIM])
                gs[G_V] = gp[GP_V] + dv
            phi = o[O_PHI] if gp[GP_ROLL] > 0.0 else gs[G_BANK]
            rate = gp[GP_G] * math.tan(phi) / o[O_V]
            if rate > 0.0:
                gs[G_WAIT] = left / rate
    elif phase == ROLLOUT:
        gs[G_BANK] = 0.0
        if abs(o[O_PHI]) < _LEVEL or gs[G_TIME] - gs[G_SINCE] > _ROLLED:
            phase = DONE
    elif phase == DONE:
        gs[G_BANK] = heading_bank(t[T_DPSI], o[O_V], gp[GP_HEADING_GAIN], gp[GP_STEER_BANK], gp[GP_G])
    gs[G_PHASE] = phase
