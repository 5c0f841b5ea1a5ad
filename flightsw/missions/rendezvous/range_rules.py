"""What becomes of a range: fused, refused, a new start, or the estimate opened because the receiver has left its plan.

One wild range is refused by the gate. Ranges refused in a row that agree with one another are believed against the estimate:
while it is young it starts again from the newest of them (the first range was bad), later it is opened. A warning of the
window opens it too: the receiver has done what nobody planned, and the prior no longer holds. A set that repeats its last
range to the decimetre is stuck; nothing it says is used. Section 2 of docs/sources/rivard.md has no such rules: the source
takes every range.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.rendezvous.bank import DEAD, OVERLAP, bank_match, bank_predict, bank_range, bank_start
from flightsw.missions.rendezvous.full_order import D_SIZE, E8_U, N8, VC, VF, VY, X, Y
from flightsw.missions.rendezvous.range_filter import (
    NU,
    NU_VAR,
    W_ALARM,
    W_COUNT,
    W_DRIFT,
    W_HEAD,
    W_NEXT,
    W_SQUARE,
    window_push,
)

# parameters rp
(
    RP_GATE,  # NIS beyond which a range is refused; 0: none is
    RP_ROW,  # refused in a row, agreeing, that are believed; 0: never
    RP_EARLY,  # ranges after the first within which that means a new start
    RP_AGREE,  # [m] innovations of two refused ranges differ by less
    RP_STUCK,  # [m] a range this close to the last one is a repeat; 0: not judged
    RP_OPEN,  # 1: a warning opens the estimate
    RP_OPEN_VX,  # [m/s] and [m]: sigma added then
    RP_OPEN_VY,
    RP_OPEN_X,
    RP_OPEN_Y,
    RP_YOUNG,  # normal quantile at which a window not yet full warns; 0: only a full one does
    RP_TURN,  # [rad] largest turn of a receiver off its plan, over which the components are spread then; 0: they are not
    RP_PACE,  # [m/s] largest change of speed, over which a quarter of them is spread instead; 0: none is
    RP_Q,
    RP_BACK,  # ranges the estimate is taken back by then; 0: it is not
    RP_N,
) = range(16)
# state rs: ranges after the first, refused in a row, innovation of the last refused [m], last range [m], times opened,
# estimates kept since
RS_COUNT, RS_ROW, RS_NU, RS_LAST, RS_OPENED, RS_KEPT, RS_N = range(7)
USED, REFUSED, STUCK, RESTARTED, OPENED = range(5)


@jit
def rules_reset(rs: np.ndarray, first: float) -> None:
    """rs [6] <- as after the first range [m]."""
    for i in range(RS_N):
        rs[i] = 0.0
    rs[RS_LAST] = first


@jit
def window_reset(w: np.ndarray) -> None:
    """Empty the window w [7+n] of innovations; its limits stay."""
    w[W_NEXT] = w[W_COUNT] = w[W_ALARM] = 0.0
    for j in range(W_HEAD, w.shape[0]):
        w[j] = 0.0


@jit
def young_alarm(w: np.ndarray, quantile: float) -> bool:
    """Whether the innovations of a window w [7+n] that is not yet full are already too large.

    Mean square against chi-square of as many degrees as there are innovations k, by Wilson and Hilferty's cube
    (1 - 2/9k + z sqrt(2/9k))^3 of the normal quantile z; the drift has one degree at any length.
    """
    k = w[W_COUNT]
    if k < 1.0 or k >= w.shape[0] - W_HEAD:
        return False
    a = 2.0 / (9.0 * k)
    limit = (7.0 / 9.0 + quantile * math.sqrt(2.0) / 3.0) ** 3
    cube = 1.0 - a + quantile * math.sqrt(a)
    return w[W_SQUARE] > cube * cube * cube or w[W_DRIFT] > limit


@jit
def open_up(P: np.ndarray, lw: np.ndarray, rp: np.ndarray, vy: float) -> None:
    """Add the variances of a receiver off its plan to every living component P [M,8,8]."""
    for i in range(P.shape[0]):
        if lw[i] > DEAD:
            P[i, VC, VC] += rp[RP_OPEN_VX] * rp[RP_OPEN_VX]
            P[i, VY, VY] += vy * vy
            P[i, X, X] += rp[RP_OPEN_X] * rp[RP_OPEN_X]
            P[i, Y, Y] += rp[RP_OPEN_Y] * rp[RP_OPEN_Y]


@jit
def fan_out(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, most: float, pace: float, T: int, half: float, late: float, e: np.ndarray
) -> None:
    """m [M,8], P [M,8,8], lw [M] <- a receiver that has turned by anything up to +-most [rad] at some time of the last `since` [s].

    Each component has an angle a of its own, from the moments of the mixture: the velocity v over ground turned, R(a) v, for a
    time of mean since/2 and variance since^2/12, and the part of the angle it stands for, 0.9 of the spacing, along
    d R(a) v/da. A range then says which, where one Gaussian over both components of the velocity holds speeds that no turn
    gives and is soon sure of a wrong one.
    """
    M = m.shape[0]
    mean, C = np.zeros(N8), np.zeros((N8, N8))
    bank_match(m, P, lw, mean, C)
    vx, vy = e[E8_U] + mean[VC] + mean[VF], mean[VY]
    v, F = math.hypot(vx, vy), M - T
    turn, gain, shift = np.zeros(N8), np.zeros(N8), np.zeros(N8)
    part = OVERLAP * 2.0 * most / (T - 1) if T > 1 else 0.0
    gain[VC], gain[VY] = vx / v, vy / v
    for i in range(M):
        a = -most + 2.0 * most / (T - 1) * i if i < T else 0.0
        b = -pace + 2.0 * pace / (F - 1) * (i - T) if i >= T else 0.0
        faster = OVERLAP * 2.0 * pace / (F - 1) if i >= T else 0.0
        s, c1 = math.sin(a), math.cos(a) - 1.0
        shift[X] = c1 * vx - s * vy + b * gain[VC]
        shift[Y] = s * vx + c1 * vy + b * gain[VY]
        turn[VC], turn[VY] = -(vy + shift[Y]), vx + shift[X]
        for j in range(2):
            turn[X if j == 0 else Y] = half * turn[VC if j == 0 else VY]
            gain[X if j == 0 else Y] = half * gain[VC if j == 0 else VY]
        for j in range(N8):
            m[i, j] = mean[j] + half * shift[j]
            for k in range(N8):
                P[i, j, k] = C[j, k] + part * part * turn[j] * turn[k] + faster * faster * gain[j] * gain[k]
                P[i, j, k] += late * shift[j] * shift[k]
        m[i, VC] += shift[X]
        m[i, VY] += shift[Y]
        lw[i] = 0.0


@jit
def leave_plan(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, rp: np.ndarray, rs: np.ndarray, kept: np.ndarray,
    keptP: np.ndarray, e: np.ndarray,
) -> None:  # fmt: skip
    """Open the estimate m [M,8], P [M,8,8], lw [M] of time t [s] for a receiver off its plan.

    With RP_BACK it is first taken back to the oldest one kept: the ranges since then have been explained by a receiver on its
    plan and have dragged the estimate along the ring. With RP_TURN it is spread over turns since then.
    """
    K, n = kept.shape[0], int(rs[RS_KEPT])
    rs[RS_KEPT] = 0.0
    if n >= 1 and rp[RP_TURN] > 0.0:
        i = (n - min(n, K)) % K
        for j in range(m.shape[0]):
            lw[j] = kept[i, j, N8]
            for c in range(N8):
                m[j, c] = kept[i, j, c]
                for d in range(N8):
                    P[j, c, d] = keptP[i, j, c, d]
        since = t - kept[i, 0, N8 + 1]
        bank_predict(m, P, lw, since, e, np.zeros(D_SIZE))
        M = m.shape[0]
        if n > K:
            fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], M - int(rp[RP_Q]), 0.5 * since, since * since / 12.0, e)
            open_up(P, lw, rp, 0.0)
        else:
            fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], 0, since, 0.0, e)
            open_up(P, lw, rp, rp[RP_OPEN_VY])
        return
    open_up(P, lw, rp, rp[RP_OPEN_VY])


@jit
def keep(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, rs: np.ndarray, kept: np.ndarray, keptP: np.ndarray
) -> None:
    """Keep the estimate m [M,8], P [M,8,8], lw [M] of time t [s] in kept [K,M,10], keptP [K,M,8,8], in the place of the oldest."""
    i = int(rs[RS_KEPT]) % kept.shape[0]
    for j in range(m.shape[0]):
        kept[i, j, N8], kept[i, j, N8 + 1] = lw[j], t
        for c in range(N8):
            kept[i, j, c] = m[j, c]
            for d in range(N8):
                keptP[i, j, c, d] = P[j, c, d]
    rs[RS_KEPT] += 1.0


@jit
def judged_range(
    rs: np.ndarray, rp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, w: np.ndarray, kept: np.ndarray,
    keptP: np.ndarray, t: float, z: float, x_t: float, y_t: float, y_hat: float, sigma_y: float, span: float, shift: float,
    hermite: bool, e: np.ndarray, wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> int:  # fmt: skip
    """Take in slant range z [m] of time t [s] at own position [m] by the rules rp [14], state rs [6]; returns what became of it.

    m, P, lw, wk, k, nu: as of bank_range; w [7+n] the window; kept, keptP as of `keep`; y_hat +- sigma_y [m], span, shift: the prior of bank_start for a
    new start. nu [2] <- innovation [m] and variance [m^2], of the estimate before it was opened where it was refused.
    """
    rs[RS_COUNT] += 1.0
    if rp[RP_BACK] > 0.0:
        keep(m, P, lw, t, rs, kept, keptP)
    repeat = abs(z - rs[RS_LAST]) < rp[RP_STUCK]
    rs[RS_LAST] = z
    if repeat:
        return STUCK
    if bank_range(m, P, lw, z, x_t, y_t, hermite, rp[RP_GATE], e, wk, k, nu):
        rs[RS_ROW] = 0.0
        window_push(w, nu[NU] / math.sqrt(nu[NU_VAR]))
        alarm = w[W_ALARM] > 0.0 or (rp[RP_YOUNG] > 0.0 and young_alarm(w, rp[RP_YOUNG]))
        if not alarm or rp[RP_OPEN] == 0.0:
            return USED
        first, variance = nu[NU], nu[NU_VAR]
        leave_plan(m, P, lw, t, rp, rs, kept, keptP, e)
        if rp[RP_BACK] > 0.0:  # else it is in the estimate
            bank_range(m, P, lw, z, x_t, y_t, hermite, 0.0, e, wk, k, nu)
        nu[NU], nu[NU_VAR] = first, variance
        window_reset(w)
        rs[RS_OPENED] += 1.0
        return OPENED
    agree = abs(nu[NU] - rs[RS_NU]) < rp[RP_AGREE]
    rs[RS_ROW] = rs[RS_ROW] + 1.0 if agree or rs[RS_ROW] == 0.0 else 1.0
    rs[RS_NU] = nu[NU]
    if rp[RP_ROW] == 0.0:  # nothing else tells of them
        window_push(w, nu[NU] / math.sqrt(nu[NU_VAR]))
    if rp[RP_ROW] == 0.0 or rs[RS_ROW] < rp[RP_ROW]:
        return REFUSED
    rs[RS_ROW] = 0.0
    window_reset(w)
    if rs[RS_COUNT] <= rp[RP_EARLY]:
        bank_start(m, P, lw, z, x_t, y_t, y_hat, sigma_y, span, shift, e)
        rs[RS_KEPT] = 0.0
        return RESTARTED
    first, variance = nu[NU], nu[NU_VAR]
    leave_plan(m, P, lw, t, rp, rs, kept, keptP, e)
    bank_range(m, P, lw, z, x_t, y_t, hermite, 0.0, e, wk, k, nu)
    nu[NU], nu[NU_VAR] = first, variance
    rs[RS_OPENED] += 1.0
    return OPENED
