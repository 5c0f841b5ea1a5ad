"""The leg after a turn that did not end in place: back to the receiver's track, to the place ahead of it. Frame R, SI."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.frame import E_VX, E_VY, E_X, E_Y
from flightsw.missions.rendezvous.meeting_vectors import (
    M_OUT,
    M_SINCE,
    MP_BOX_X,
    MP_LEG,
    MP_LEG_ANGLE,
    MP_LEG_FROM,
    MP_LEG_GAIN,
    MP_LEG_SHARE,
    MP_LEG_SIDED,
    MP_LEG_TAU,
    MP_STRAIGHT,
)
from flightsw.missions.rendezvous.straight import leg_angle
from flightsw.missions.rendezvous.turn_geometry import O_DELTA, O_PSI, O_V, O_WX, O_WY, O_X, O_Y
from flightsw.missions.rendezvous.turn_law import (
    G_BANK,
    G_TIME,
    G_V,
    G_WAIT,
    G_XM,
    G_YM,
    GP_G,
    GP_HEADING_GAIN,
    GP_SEP,
    GP_STEER_BANK,
    GP_TRIM,
    GP_V,
    NEVER,
    heading_bank,
)

_TURNS_S = 60.0  # [s] of a leg that its turns and its last stretch take


@jit
def leg_limit(
    ms: np.ndarray, gs: np.ndarray, o: np.ndarray, r: np.ndarray, sided: bool, gp: np.ndarray, mp: np.ndarray
) -> float:
    """Longest leg [s] o [8], r [4] allow: MP_LEG, or MP_LEG_SIDED where the place is met within it at full trim.

    Only if sided: by ranges alone, in trail, the distance across the track is lost. One that does not gain is not worth it.
    """
    if not sided or mp[MP_LEG_SIDED] <= mp[MP_LEG]:
        return mp[MP_LEG]
    x, pace = r[E_X] - gp[GP_SEP] - o[O_X], math.hypot(r[E_VX] - o[O_WX], r[E_VY] - o[O_WY])
    gain = gp[GP_V] + gp[GP_TRIM] - pace if x < 0.0 else pace - gp[GP_V] + gp[GP_TRIM]
    left = ms[M_SINCE] + mp[MP_LEG_SIDED] - gs[G_TIME]
    return mp[MP_LEG_SIDED] if abs(x) < gain * left else mp[MP_LEG]


@jit
def leg_share(limit: float, mp: np.ndarray) -> float:
    """Share of the miss from which on, and down to which, a leg of at most `limit` [s] is flown: less of one that gains."""
    return mp[MP_LEG_SHARE] if limit > mp[MP_LEG] else 1.0


@jit
def fly_leg(
    ms: np.ndarray, gs: np.ndarray, o: np.ndarray, r: np.ndarray, limit: float, gp: np.ndarray, mp: np.ndarray
) -> None:
    """Bank and airspeed of a leg of at most `limit` [s]: heading to the track by the distance from it, speed by the miss along.

    Further ahead than the way back costs, it first leads away from the track: each metre of it costs tan(angle/2) along track
    twice, out and back, where the speed trim alone would take minutes. With MP_STRAIGHT a leg that is behind goes to the track
    at no more than the angle that meets the place at full trim.
    """
    x, y = r[E_X] - gp[GP_SEP] - o[O_X], r[E_Y] - o[O_Y]
    tan_half = math.tan(0.5 * mp[MP_LEG_ANGLE])
    ahead = x - abs(y) * tan_half
    way = (abs(y) + ahead / tan_half) / (o[O_V] * math.sin(mp[MP_LEG_ANGLE]))  # out and back
    if ahead > mp[MP_LEG_FROM] * mp[MP_BOX_X] and way + _TURNS_S < ms[M_SINCE] + limit - gs[G_TIME]:
        ms[M_OUT] = 1.0
    elif ahead <= 0.0:
        ms[M_OUT] = 0.0
    ux, uy = r[E_VX] - o[O_WX], r[E_VY] - o[O_WY]
    fast = gp[GP_V] + gp[GP_TRIM]
    most = mp[MP_LEG_ANGLE]
    if mp[MP_STRAIGHT] > 0.0:
        # the track is reached within the leg all the same
        left = max(ms[M_SINCE] + limit - _TURNS_S - gs[G_TIME], _TURNS_S)
        soon = math.asin(min(abs(y) / (fast * left), 1.0))
        most = min(most, max(leg_angle(x, y, ux, uy, o[O_DELTA], fast), soon))
    a = min(max(mp[MP_LEG_GAIN] * y, -most), most)
    held = most < mp[MP_LEG_ANGLE] and abs(a) == most
    if ms[M_OUT] > 0.0:
        a = -math.copysign(mp[MP_LEG_ANGLE], y)
    error = math.pi + o[O_DELTA] - a - o[O_PSI]
    gs[G_BANK] = heading_bank(error, o[O_V], gp[GP_HEADING_GAIN], gp[GP_STEER_BANK], gp[GP_G])
    want = math.hypot(ux, uy) - ahead / mp[MP_LEG_TAU]  # from the receiver's airspeed
    gs[G_V] = fast if held else min(max(want, gp[GP_V] - gp[GP_TRIM]), fast)
    gs[G_XM], gs[G_YM], gs[G_WAIT] = x, y, NEVER
