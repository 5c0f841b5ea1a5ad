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
from flightsw.missions.rendezvous.bank import DEAD, bank_range, bank_start
from flightsw.missions.rendezvous.full_order import VC, VY, X, Y
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
    RP_N,
) = range(12)
# state rs: ranges after the first, refused in a row, innovation of the last refused [m], last range [m], times opened
RS_COUNT, RS_ROW, RS_NU, RS_LAST, RS_OPENED, RS_N = range(6)
USED, REFUSED, STUCK, RESTARTED, OPENED = range(5)


@jit
def rules_reset(rs: np.ndarray, first: float) -> None:
    """rs [5] <- as after the first range [m]."""
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
def open_up(P: np.ndarray, lw: np.ndarray, rp: np.ndarray) -> None:
    """Add the variances of a receiver off its plan to every living component P [M,8,8]."""
    for i in range(P.shape[0]):
        if lw[i] > DEAD:
            P[i, VC, VC] += rp[RP_OPEN_VX] * rp[RP_OPEN_VX]
            P[i, VY, VY] += rp[RP_OPEN_VY] * rp[RP_OPEN_VY]
            P[i, X, X] += rp[RP_OPEN_X] * rp[RP_OPEN_X]
            P[i, Y, Y] += rp[RP_OPEN_Y] * rp[RP_OPEN_Y]


@jit
def judged_range(
    rs: np.ndarray, rp: np.ndarray, m: np.ndarray, P: np.ndarray, lw: np.ndarray, w: np.ndarray, z: float, x_t: float,
    y_t: float, y_hat: float, sigma_y: float, span: float, shift: float, hermite: bool, e: np.ndarray, wk: np.ndarray,
    k: np.ndarray, nu: np.ndarray,
) -> int:  # fmt: skip
    """Take in slant range z [m] at own position [m] by the rules rp [10], state rs [5]; returns what became of it.

    m, P, lw, wk, k, nu: as of bank_range; w [7+n] the window; y_hat +- sigma_y [m], span, shift: the prior of bank_start for a
    new start. nu [2] <- innovation [m] and variance [m^2], of the estimate before it was opened where it was refused.
    """
    rs[RS_COUNT] += 1.0
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
        open_up(P, lw, rp)
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
        return RESTARTED
    first, variance = nu[NU], nu[NU_VAR]
    open_up(P, lw, rp)
    bank_range(m, P, lw, z, x_t, y_t, hermite, 0.0, e, wk, k, nu)
    nu[NU], nu[NU_VAR] = first, variance
    rs[RS_OPENED] += 1.0
    return OPENED
