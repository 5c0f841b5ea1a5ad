"""What becomes of a bearing or a position of the receiver that comes at a rate of its own, and of the ranges between them.

All are fused when they come. Each has a sum of its normalised innovations that forgets: where it is larger than such noise makes
it, the receiver does not fly as planned. The estimate is then taken back by some seconds, spread over turns and speeds as
range_rules.py does it, and everything heard since is fused again: the displacement that gave the turn away also says how far it
has gone. Ranges alone take their estimate back by ranges and forget them, because one range does not tell a turn from
a speed. Page (1954) on sums that tell a change; not in docs/sources/rivard.md.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.rendezvous.bank import DEAD, bank_axis, bank_bearing, bank_predict, bank_range
from flightsw.missions.rendezvous.full_order import D_SIZE, E8_U, VC, VF, VY
from flightsw.missions.rendezvous.range_filter import NU, NU_VAR, W_ALARM
from flightsw.missions.rendezvous.range_rules import (
    OPENED,
    REFUSED,
    RESTARTED,
    RP_OPEN_VY,
    RP_PACE,
    RP_TURN,
    RP_YOUNG,
    RS_OPENED,
    STUCK,
    USED,
    fan_out,
    judged_range,
    keep_as,
    open_up,
    restore,
    window_reset,
    young_alarm,
)

# parameters fp: limit of a sum in sigma (0: nothing is judged), time it forgets in [s], time the estimate is taken back by [s],
# white variance of a bearing [rad^2] and of a position [m^2], noise of the velocity once opened [m^2/s^3] and for how long [s]
FP_LIMIT, FP_FADE, FP_BACK, FP_RB, FP_RL, FP_STIR, FP_SETTLE, FP_N = range(8)
# state fs: heard in all; of bearing, x and y their sum, its variance, time of the last [s]; the velocity is noisy until [s], was
# stirred last [s]
FS_COUNT = 0
FS_SUM, FS_VAR, FS_LAST = (1, 2, 3), (4, 5, 6), (7, 8, 9)
FS_UNTIL, FS_STIRRED, FS_N = 10, 11, 12
BEARING, ALONG, ACROSS = 0, 1, 2  # sums
# what was heard: time [s], kind, value (range [m], line of sight [rad], x [m]) and y [m], own position [m]
F_T, F_KIND, F_Z, F_Y, F_OX, F_OY, F_N = range(7)
IS_REFUSED, IS_RANGE, IS_BEARING, IS_POSITION = range(4)
_FIRST = 0  # of what was heard, while it is kept
_ALONG = 0.1  # share of the noise along the course


@jit
def fixes_reset(fs: np.ndarray) -> None:
    """fs [12] <- nothing heard."""
    for i in range(FS_N):
        fs[i] = 0.0


@jit
def stir(
    fs: np.ndarray, fp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, e: np.ndarray
) -> None:  # fmt: skip
    """Up to t [s] add what the velocity may have changed by to m [M,8+], P [M,8+,8+], for some time after it was opened.

    A turn that was noticed is still going on: noise across the course, and _ALONG of it along.
    """
    q = fp[FP_STIR] * (t - fs[FS_STIRRED])
    fs[FS_STIRRED] = t
    if t > fs[FS_UNTIL]:
        return
    for i in range(P.shape[0]):
        if lw[i] > DEAD:
            vx, vy = e[E8_U] + m[i, VC] + m[i, VF], m[i, VY]
            v2 = vx * vx + vy * vy
            P[i, VC, VC] += q * (vy * vy + _ALONG * vx * vx) / v2
            P[i, VY, VY] += q * (vx * vx + _ALONG * vy * vy) / v2
            P[i, VC, VY] -= q * (1.0 - _ALONG) * vx * vy / v2
            P[i, VY, VC] = P[i, VC, VY]


@jit
def sum_push(fs: np.ndarray, c: int, e: float, t: float, fade: float) -> float:
    """Enter the normalised innovation e [-] of time t [s] into sum c of fs [12]; returns the sum over its own sigma, squared.

    g <- a g + e, v <- a^2 v + 1 with a = exp(-dt/fade): v is the variance of g while the innovations are white.
    """
    a = math.exp((fs[FS_LAST[c]] - t) / fade)
    fs[FS_SUM[c]] = a * fs[FS_SUM[c]] + e
    fs[FS_VAR[c]] = a * a * fs[FS_VAR[c]] + 1.0
    fs[FS_LAST[c]] = t
    return fs[FS_SUM[c]] * fs[FS_SUM[c]] / fs[FS_VAR[c]]


@jit
def fuse_heard(
    f: np.ndarray, fs: np.ndarray, fp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, hermite: bool, e: np.ndarray,
    wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> float:  # fmt: skip
    """Fuse what was heard, f [6], at the estimate's own time; returns the largest square of its sums (a range has none)."""
    top = 0.0
    if f[F_KIND] == IS_RANGE:
        bank_range(m, P, lw, f[F_Z], f[F_OX], f[F_OY], hermite, 0.0, e, wk, k, nu)
    elif f[F_KIND] == IS_BEARING:
        bank_bearing(m, P, lw, f[F_Z], f[F_OX], f[F_OY], fp[FP_RB], 0.0, wk, k, nu)
        top = sum_push(fs, BEARING, nu[NU] / math.sqrt(nu[NU_VAR]), f[F_T], fp[FP_FADE])
    elif f[F_KIND] == IS_POSITION:
        bank_axis(m, P, lw, True, f[F_Z], fp[FP_RL], wk, k, nu)
        top = sum_push(fs, ALONG, nu[NU] / math.sqrt(nu[NU_VAR]), f[F_T], fp[FP_FADE])
        bank_axis(m, P, lw, False, f[F_Y], fp[FP_RL], wk, k, nu)
        top = max(top, sum_push(fs, ACROSS, nu[NU] / math.sqrt(nu[NU_VAR]), f[F_T], fp[FP_FADE]))
    return top


@jit
def note(
    fs: np.ndarray, fp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, kept: np.ndarray, keptP: np.ndarray,
    heard: np.ndarray, t: float, kind: int, z: float, y: float, own_x: float, own_y: float, e: np.ndarray,
) -> int:  # fmt: skip
    """Note what was heard at t [s] in place of the oldest of heard [K,6], with the estimate as it was before (kept, keptP as of
    range_rules.keep); returns its number."""
    i = int(fs[FS_COUNT]) % heard.shape[0]
    fs[FS_COUNT] += 1.0
    stir(fs, fp, m, P, lw, t, e)
    keep_as(m, P, lw, t, i, kept, keptP)
    heard[i, F_T], heard[i, F_KIND], heard[i, F_Z], heard[i, F_Y] = t, kind, z, y
    heard[i, F_OX], heard[i, F_OY] = own_x, own_y
    return i


@jit_own
def reopen(
    fs: np.ndarray, fp: np.ndarray, rp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, w: np.ndarray,
    kept: np.ndarray, keptP: np.ndarray, heard: np.ndarray, hermite: bool, e: np.ndarray, wk: np.ndarray, k: np.ndarray,
    nu: np.ndarray,
) -> None:  # fmt: skip
    """Take the estimate back by FP_BACK, spread it, and fuse again what was heard since, the newest included.

    A turn or a change of speed has begun at any time of twice as long ago: it is flown as one at once, half way. While what was
    heard at the start is still kept, from there, over speeds alone: one too fast or too slow shows at once.
    """
    K, M, n = heard.shape[0], m.shape[0], int(fs[FS_COUNT])
    first = max(n - K, 0)
    j, t = n - 1, heard[(n - 1) % K, F_T]
    while j > first and t - heard[j % K, F_T] < fp[FP_BACK]:
        j -= 1
    young = first == 0 and heard[_FIRST, F_T] <= fp[FP_BACK]
    if young:
        j = 0
    past = restore(m, P, lw, j % K, kept, keptP)
    if young:
        fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], 0, 0.0, 0.0, e)
        open_up(P, lw, rp, rp[RP_OPEN_VY])
    else:
        fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], M - M // 4, 0.0, fp[FP_BACK] * fp[FP_BACK] / 3.0, e)
        open_up(P, lw, rp, 0.0)
    fs[FS_STIRRED], fs[FS_UNTIL] = past, t + fp[FP_SETTLE]
    D = np.zeros(D_SIZE)
    for i in range(j, n):
        f = heard[i % K]
        if f[F_T] > past:
            bank_predict(m, P, lw, f[F_T] - past, e, D)
            past = f[F_T]
        stir(fs, fp, m, P, lw, past, e)
        keep_as(m, P, lw, past, i % K, kept, keptP)
        fuse_heard(f, fs, fp, m, P, lw, hermite, e, wk, k, nu)
    for c in range(3):
        fs[FS_SUM[c]] = fs[FS_VAR[c]] = 0.0
    window_reset(w)


@jit
def heard_fix(
    fs: np.ndarray, fp: np.ndarray, rs: np.ndarray, rp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, w: np.ndarray,
    kept: np.ndarray, keptP: np.ndarray, heard: np.ndarray, t: float, kind: int, z: float, y: float, own_x: float, own_y: float,
    hermite: bool, e: np.ndarray, wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> int:  # fmt: skip
    """Take in a bearing (z [rad]) or a position (z, y [m]) of time t [s] at own position [m]: USED or OPENED.

    rs, rp, w as of judged_range; fs [12], fp [7], heard [K,6], kept [K,M,14+2], keptP [K,M,14,14]: see above.
    """
    i = note(fs, fp, m, P, lw, kept, keptP, heard, t, kind, z, y, own_x, own_y, e)
    top = fuse_heard(heard[i], fs, fp, m, P, lw, hermite, e, wk, k, nu)
    if fp[FP_LIMIT] == 0.0 or top <= fp[FP_LIMIT] * fp[FP_LIMIT]:
        return USED
    reopen(fs, fp, rp, m, P, lw, w, kept, keptP, heard, hermite, e, wk, k, nu)
    rs[RS_OPENED] += 1.0
    return OPENED


@jit
def heard_range(
    fs: np.ndarray, fp: np.ndarray, rs: np.ndarray, rp: np.ndarray, rp_plain: np.ndarray, m: np.ndarray, P: np.ndarray,
    lw: np.ndarray, w: np.ndarray, kept: np.ndarray, keptP: np.ndarray, heard: np.ndarray, t: float, z: float, x_t: float,
    y_t: float, y_hat: float, sigma_y: float, span: float, shift: float, hermite: bool, e: np.ndarray, wk: np.ndarray,
    k: np.ndarray, nu: np.ndarray,
) -> int:  # fmt: skip
    """As judged_range, of an estimate that bearings or positions help: opened, it is taken back in time as theirs is, and ranges
    refused that agree are fused with what was heard between them.

    rp_plain: rp without RP_OPEN and RP_BACK.
    """
    i = note(fs, fp, m, P, lw, kept, keptP, heard, t, IS_RANGE, z, 0.0, x_t, y_t, e)
    verdict = judged_range(
        rs, rp_plain, m, P, lw, w, kept, keptP, t, z, x_t, y_t, y_hat, sigma_y, span, shift, hermite, e, wk, k, nu
    )  # fmt: skip
    warned = verdict == USED and (w[W_ALARM] > 0.0 or (rp[RP_YOUNG] > 0.0 and young_alarm(w, rp[RP_YOUNG])))
    if verdict in (REFUSED, STUCK):
        heard[i, F_KIND] = IS_REFUSED
    elif verdict == RESTARTED:
        fixes_reset(fs)
    elif warned or verdict == OPENED:
        rs[RS_OPENED] += 1.0 if warned else 0.0
        for j in range(heard.shape[0]):
            if heard[j, F_KIND] == IS_REFUSED and not warned:
                heard[j, F_KIND] = IS_RANGE
        first, variance = nu[NU], nu[NU_VAR]
        reopen(fs, fp, rp, m, P, lw, w, kept, keptP, heard, hermite, e, wk, k, nu)
        nu[NU], nu[NU_VAR] = first, variance
        verdict = OPENED
    return verdict
