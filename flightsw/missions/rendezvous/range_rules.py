"""What becomes of a range: fused, refused, a new start, or the estimate opened because the receiver has left its plan.

One wild range is refused by the gate. Ranges refused in a row that agree with one another are believed against the estimate:
while it is young it starts again from the newest of them (the first range was bad), later it is opened. A warning of the
window opens it too: the receiver has done what nobody planned, and the prior no longer holds: its course and speed are
estimated anew from before that. A set that repeats its last range to the decimetre is stuck; nothing it says is used.
Section 2 of docs/sources/rivard.md has no such rules: the source takes every range.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.rendezvous.bank import DEAD, OVERLAP, bank_match, bank_predict, bank_range, bank_start
from flightsw.missions.rendezvous.full_order import D_SIZE, E8_U, VC, VF, VY, X, Y
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
    RP_BACK,  # ranges the estimate is taken back by then, and spread; 0: it is not
    RP_TURN,  # [rad] over turns up to this
    RP_PACE,  # [m/s] and over changes of speed up to this
    RP_N,
) = range(15)
# state rs: ranges after the first, refused in a row, innovation of the last refused [m], last range [m], times opened,
# estimates kept since
RS_COUNT, RS_ROW, RS_NU, RS_LAST, RS_OPENED, RS_KEPT, RS_N = range(7)
KEPT_LW, KEPT_T = -2, -1  # of a kept component, behind its mean
_ANY = 0  # component: all are kept at the same time
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
    """Add the variances of a receiver off its plan to every living component P [M,8,8]; vy [m/s]: sigma added across track."""
    for i in range(P.shape[0]):
        if lw[i] > DEAD:
            P[i, VC, VC] += rp[RP_OPEN_VX] * rp[RP_OPEN_VX]
            P[i, VY, VY] += vy * vy
            P[i, X, X] += rp[RP_OPEN_X] * rp[RP_OPEN_X]
            P[i, Y, Y] += rp[RP_OPEN_Y] * rp[RP_OPEN_Y]


@jit_own
def fan_out(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, turn: float, pace: float, turned: int, since: float, var: float,
    e: np.ndarray,
) -> None:  # fmt: skip
    """m [M,8], P [M,8,8], lw [M] <- a receiver that has changed course by up to +-turn [rad], or speed by up to +-pace [m/s].

    The first `turned` components share out the angles, the others the speeds, all from the moments of the mixture, as flown for a
    time of mean since [s] and variance var [s^2]. Each stands for 0.9 of the spacing to either side, in angle where any has
    turned, in speed where it is one of the others. A range then says which: one Gaussian over both components of
    the velocity holds many that neither a turn nor a speed gives and is soon sure of a wrong one.
    """
    M, n = m.shape
    mean, C = np.zeros(n), np.zeros((n, n))
    bank_match(m, P, lw, mean, C)
    vx, vy = e[E8_U] + mean[VC] + mean[VF], mean[VY]
    v = math.hypot(vx, vy)
    moved, angle, speed = np.zeros(n), np.zeros(n), np.zeros(n)
    da = 2.0 * turn / (turned - 1) if turned > 1 else 0.0
    for i in range(M):
        a, b, db = -turn + da * i, 0.0, 0.0
        if i >= turned:
            db = 2.0 * pace / (M - turned - 1)
            a, b = 0.0, -pace + db * (i - turned)
        c, s = math.cos(a), math.sin(a)
        moved[VC], moved[VY] = (c - 1.0) * vx - s * vy + b * vx / v, s * vx + (c - 1.0) * vy + b * vy / v
        angle[VC], angle[VY] = -OVERLAP * da * (vy + moved[VY]), OVERLAP * da * (vx + moved[VC])
        speed[VC], speed[VY] = OVERLAP * db * vx / v, OVERLAP * db * vy / v
        for d in (moved, angle, speed):
            d[X], d[Y] = since * d[VC], since * d[VY]
        for j in range(n):
            m[i, j] = mean[j] + moved[j]
            for k in range(n):
                P[i, j, k] = C[j, k] + angle[j] * angle[k] + speed[j] * speed[k]
        for d in (moved, angle, speed):  # of a product of two that do not depend on one another
            P[i, X, X] += var * d[VC] * d[VC]
            P[i, X, Y] += var * d[VC] * d[VY]
            P[i, Y, X] += var * d[VC] * d[VY]
            P[i, Y, Y] += var * d[VY] * d[VY]
        lw[i] = 0.0


@jit
def keep(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, rs: np.ndarray, kept: np.ndarray, keptP: np.ndarray
) -> None:
    """Keep m [M,8], P [M,8,8], lw [M] of time t [s] in place of the oldest of kept [K,M,8+2] (m, lw, t), keptP [K,M,8,8]."""
    i = int(rs[RS_KEPT]) % kept.shape[0]
    rs[RS_KEPT] += 1.0
    keep_as(m, P, lw, t, i, kept, keptP)


@jit
def keep_as(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, i: int, kept: np.ndarray, keptP: np.ndarray
) -> None:  # fmt: skip
    """Keep m [M,8], P [M,8,8], lw [M] of time t [s] as number i of kept [K,M,8+2] (m, lw, t), keptP [K,M,8,8]."""
    for j in range(m.shape[0]):
        kept[i, j, KEPT_LW], kept[i, j, KEPT_T] = lw[j], t
        for c in range(m.shape[1]):
            kept[i, j, c] = m[j, c]
            for d in range(m.shape[1]):
                keptP[i, j, c, d] = P[j, c, d]


@jit
def restore(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, i: int, kept: np.ndarray, keptP: np.ndarray
) -> float:  # fmt: skip
    """m [M,8], P [M,8,8], lw [M] <- those kept as number i (see `keep`); returns their time [s]."""
    for j in range(m.shape[0]):
        lw[j] = kept[i, j, KEPT_LW]
        for c in range(m.shape[1]):
            m[j, c] = kept[i, j, c]
            for d in range(m.shape[1]):
                P[j, c, d] = keptP[i, j, c, d]
    return kept[i, _ANY, KEPT_T]


@jit_own
def leave_plan(
    m: np.ndarray, P: np.ndarray, lw: np.ndarray, t: float, rp: np.ndarray, rs: np.ndarray, kept: np.ndarray,
    keptP: np.ndarray, e: np.ndarray,
) -> None:  # fmt: skip
    """Open the estimate m [M,8], P [M,8,8], lw [M] of time t [s] for a receiver off its plan.

    Without RP_BACK as it stands. With it the estimate is first taken back to the oldest kept: the ranges since have been
    explained by a receiver on its plan and have dragged it along the ring. From there it is spread over turns (three
    quarters of it) and speeds (the rest), begun at any time since; while nothing older than the first ranges is kept, over
    speeds alone, as flown all the time: a receiver too fast or too slow shows at once, one that turns at any time.
    """
    K, M, n = kept.shape[0], m.shape[0], int(rs[RS_KEPT])
    if rp[RP_BACK] == 0.0:
        open_up(P, lw, rp, rp[RP_OPEN_VY])
        return
    since = t - restore(m, P, lw, (n - min(n, K)) % K, kept, keptP)
    bank_predict(m, P, lw, since, e, np.zeros(D_SIZE))
    if n > K:
        fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], M - M // 4, 0.5 * since, since * since / 12.0, e)
        open_up(P, lw, rp, 0.0)
    else:
        fan_out(m, P, lw, rp[RP_TURN], rp[RP_PACE], 0, since, 0.0, e)
        open_up(P, lw, rp, rp[RP_OPEN_VY])


@jit
def judged_range(
    rs: np.ndarray, rp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, w: np.ndarray, kept: np.ndarray,
    keptP: np.ndarray, t: float, z: float, x_t: float, y_t: float, y_hat: float, sigma_y: float, span: float, shift: float,
    hermite: bool, e: np.ndarray, wk: np.ndarray, k: np.ndarray, nu: np.ndarray,
) -> int:  # fmt: skip
    """Take in slant range z [m] of time t [s] at own position [m] by the rules rp [14], state rs [6]; what became of it.

    m, P, lw, wk, k, nu: as of bank_range; w [7+n] the window; kept, keptP as of `keep`; y_hat +- sigma_y [m], span, shift: the
    prior of bank_start for a new start. nu [2] <- innovation [m] and variance [m^2], of the estimate before it was opened.
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
