"""What is announced of a meeting: whether its turn will end in the box, whether it has. Frame R in the axes of the turn, SI."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.rendezvous.frame import E_SIZE, E_VX, E_VY, E_X, E_Y
from flightsw.missions.rendezvous.meeting_vectors import (
    M_CHI,
    M_XP,
    M_YP,
    MP_BOX_X,
    MP_BOX_Y,
    MP_DOUBT,
    MP_EDGE,
    MP_LEG,
    MP_LEG_FROM,
    MP_SPEED,
    MP_SPEED_SURE,
    MP_SURE,
    MP_WIND,
    SAY_FAR,
    SAY_LEG,
    SAY_SPEED,
)
from flightsw.missions.rendezvous.turn_geometry import (
    O_PSI,
    O_V,
    O_WX,
    O_WY,
    O_X,
    O_Y,
    T_LIMITED,
    T_TIME,
    T_XM,
    T_YM,
    turn_point,
)
from flightsw.missions.rendezvous.turn_law import (
    GP_BANK_MAX,
    GP_BANK_MIN,
    GP_G,
    GP_JOIN,
    GP_ROLL,
    GP_SEP,
    GP_TRIM,
    GP_V,
)

ALONG, ACROSS = 0, 1  # the course of the receiver
_CAUTION = 0.4  # share of the sigma that counts against announcing a turn that is late already


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
def missed(x: float, y: float, separation: float, mirror: bool, mp: np.ndarray) -> bool:
    """Whether a meeting that ends (x, y) [m] off is called missed.

    mirror: by ranges alone a receiver ahead of the tanker on its own course may as well be behind it. Where that image lies in
    the box no miss is called.
    """
    if not beyond(x, y, mp[MP_EDGE], mp):
        return False
    ahead = x + separation < 0.0
    return not (mirror and ahead and not beyond(-x - 2.0 * separation, y, mp[MP_EDGE], mp))


@jit
def spread(P4: np.ndarray, chi: float, after: float, s: np.ndarray) -> None:
    """s [2] <- sigma [m] along and across the course of axes turned by chi [rad], `after` [s] from now at the present velocity.

    P4 [4,4]: covariance of (x, v_x, y, v_y).
    """
    for axis in (ALONG, ACROSS):
        c, d = (math.cos(chi), math.sin(chi)) if axis == ALONG else (-math.sin(chi), math.cos(chi))
        v = 0.0
        for i in range(E_SIZE):
            a = (c if i < E_Y else d) * (1.0 if i in (E_X, E_Y) else after)
            for j in range(E_SIZE):
                v += a * P4[i, j] * (c if j < E_Y else d) * (1.0 if j in (E_X, E_Y) else after)
        s[axis] = math.sqrt(max(v, 0.0))


@jit
def speed_sigma(P4: np.ndarray, chi: float) -> float:
    """Sigma [m/s] of the speed along the course of axes turned by chi [rad]; P4 [4,4] covariance of (x, v_x, y, v_y)."""
    c, s = math.cos(chi), math.sin(chi)
    v = c * c * P4[E_VX, E_VX] + 2.0 * c * s * P4[E_VX, E_VY] + s * s * P4[E_VY, E_VY]
    return math.sqrt(max(v, 0.0))


@jit
def less(x: float, reach: float) -> float:
    """What is left of x [m] when up to `reach` [m] of it can be flown off."""
    return math.copysign(max(abs(x) - reach, 0.0), x)


@jit_own
def judge_turn(
    ms: np.ndarray, left: float, o: np.ndarray, r: np.ndarray, P4: np.ndarray, sided: bool, gp: np.ndarray, mp: np.ndarray,
    t: np.ndarray, o2: np.ndarray, r2: np.ndarray,
) -> int:  # fmt: skip
    """Announcements about a turn to begin in `left` [s] on the present heading; ms keeps the misses it is predicted to end with.

    o [8], r [4] in the axes of the turn, P4 [4,4] covariance of the receiver in R; t [9], o2 [8], r2 [4] scratch. The speed trim
    is counted on over the turn and the leg. A course of its own (M_CHI) is as unsure as the velocity: MP_DOUBT counts it. Sided,
    the receiver's airspeed is known well enough for its sigma to be the margin, speed over ground and own wind (MP_WIND) added
    as squares; by ranges alone, whose sigma is as large as what is to be told, that would tell fewer.
    """
    for i in range(8):
        o2[i] = o[i]
    o2[O_X] += (o[O_V] * math.cos(o[O_PSI]) + o[O_WX]) * left
    o2[O_Y] += (o[O_V] * math.sin(o[O_PSI]) + o[O_WY]) * left
    r2[E_X], r2[E_Y], r2[E_VX], r2[E_VY] = r[E_X] + r[E_VX] * left, r[E_Y] + r[E_VY] * left, r[E_VX], r[E_VY]
    turn_point(o2, r2, gp[GP_BANK_MAX], gp[GP_BANK_MIN], gp[GP_SEP], gp[GP_ROLL], True, gp[GP_G], t)
    sx, sy = math.sqrt(P4[E_X, E_X]), math.sqrt(P4[E_Y, E_Y])
    if mp[MP_DOUBT] > 0.0 and ms[M_CHI] != 0.0:
        s = np.empty(2)
        spread(P4, ms[M_CHI], left + t[T_TIME], s)
        sx, sy = s[ALONG], s[ACROSS]
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
    margin = mp[MP_SPEED]
    if sided and mp[MP_SPEED_SURE] > 0.0:
        margin = mp[MP_SPEED_SURE] * math.hypot(speed_sigma(P4, ms[M_CHI]), mp[MP_WIND])
    if abs(apart) > gp[GP_TRIM] + margin:
        said += SAY_SPEED
    return said
