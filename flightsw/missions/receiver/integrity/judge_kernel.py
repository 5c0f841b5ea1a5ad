"""What the bank's filters say of the sources at a step: positions, tests and likelihoods, in one call (verdict.py)."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.kernel import spread
from flightsw.missions.receiver.integrity.layout import B_AT, B_D, B_U, SOURCES

# thresholds of IntegrityParams, in this order
PARAMS = ("k_fault_free", "k_missed", "k_once", "k_alarm", "alarm_steps", "llr_alarm", "llr_ahead")
K_FAULT_FREE, K_MISSED, K_ONCE, K_ALARM, ALARM_STEPS, LLR_ALARM, LLR_AHEAD = range(len(PARAMS))
# of a verdict: protection level [3] m, test over its threshold and log-likelihood of every source, 1.0 if a test has failed, the
# source that is blamed (-1: none), by forks of this slot
PL, RATIO = 0, 3
SCORES = RATIO + SOURCES
DISAGREE = SCORES + SOURCES
BLAMED, SLOT, OUT = DISAGREE + 1, DISAGREE + 2, DISAGREE + 3


@jit
def stand(
    X: np.ndarray, C: np.ndarray, dx: float, dy: float, dz: float, lead: float, place: np.ndarray
) -> tuple[float, float, float]:
    """place [3,n] <- of a state lead [s] before: the position in tanker axes; returns that [m] of filter 0 of X [M,n].

    C [9]: the tanker's attitude by its word; (dx, dy, dz) [m] NED: where the receiver is. xi = C d - (C d) x a, a the error of C.
    """
    x = C[0] * dx + C[1] * dy + C[2] * dz
    y = C[3] * dx + C[4] * dy + C[5] * dz
    z = C[6] * dx + C[7] * dy + C[8] * dz
    a, b, c = X[0, B_AT], X[0, B_AT + 1], X[0, B_AT + 2]
    for i in range(3):
        for j in range(3):
            place[i, B_D + j] = C[3 * i + j]
            place[i, B_U + j] = lead * C[3 * i + j]
    place[0, B_AT], place[0, B_AT + 1], place[0, B_AT + 2] = -0.0, z, -y
    place[1, B_AT], place[1, B_AT + 1], place[1, B_AT + 2] = -z, -0.0, x
    place[2, B_AT], place[2, B_AT + 1], place[2, B_AT + 2] = y, -x, -0.0
    return (
        x - (0.0 * a + -z * b + y * c),
        y - (z * a + 0.0 * b + -x * c),
        z - (-y * a + x * b + 0.0 * c),
    )


@jit
def tested(m: int, z: np.ndarray, par: np.ndarray, run: np.ndarray) -> tuple[float, bool]:
    """Separation z [M] of filter m from 0 over its threshold, and whether that is an alarm; run [M]: steps beyond it in a row."""
    run[m] = run[m] + 1 if z[m] > par[K_ALARM] else 0
    return z[m] / par[K_ALARM], z[m] > par[K_ONCE] or run[m] >= par[ALARM_STEPS]


@jit
def forks(
    slot: int,
    sources: int,
    live: int,
    z: np.ndarray,
    L: np.ndarray,
    born: float,
    par: np.ndarray,
    run: np.ndarray,
    out: np.ndarray,
) -> None:
    """Tests and likelihoods of one slot's forks into out [OUT]; L [M] log-likelihoods, born: filter 0's when they began."""
    first, null = 1 + sources * (1 + slot), L[0] - born
    top, best, most = out[SCORES], -1, 0.0
    for k in range(1, SOURCES):
        if out[SCORES + k] > top:
            top = out[SCORES + k]
    for k in range(sources):
        if not live >> k & 1:
            continue
        score = L[first + k] - null
        ratio, failed = tested(first + k, z, par, run)
        if failed:
            out[DISAGREE] = 1.0
        if ratio > out[RATIO + k]:
            out[RATIO + k] = ratio
        if score / par[LLR_ALARM] > out[RATIO + k]:
            out[RATIO + k] = score / par[LLR_ALARM]
        if score > out[SCORES + k]:
            out[SCORES + k] = score
        if best < 0 or score > most:
            best, most = k, score
    second, others = 0.0, 0
    for k in range(sources):
        if live >> k & 1 and k != best:
            score = L[first + k] - null
            if others == 0 or score > second:
                second = score
            others += 1
    if most > par[LLR_ALARM]:
        out[DISAGREE] = 1.0
        if most > second + par[LLR_AHEAD] and most > top:
            out[BLAMED], out[SLOT] = best, slot


@jit
def judged(
    X: np.ndarray, P: np.ndarray, place: np.ndarray, grown: float, L: np.ndarray, born: np.ndarray, sources: int, live: int,
    heard: int, par: np.ndarray, z: np.ndarray, off: np.ndarray, sigma: np.ndarray, run: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """out [OUT] <- the verdict on `sources` sources, with those of the mask `live`, of those `heard` since the start.

    born [slots]: log-likelihood of filter 0 when a slot began; par [7] thresholds; z, off, sigma as `spread`; run [M] in place.
    """
    spread(X, P, place, grown, z, off, sigma)
    several = 0
    for k in range(sources):
        several += live >> k & 1
    for i in range(out.shape[0]):
        out[i] = 0.0
    out[BLAMED] = -1.0
    for i in range(3):
        out[PL + i] = par[K_FAULT_FREE] * sigma[0, i]
    for k in range(sources):
        if not heard >> k & 1:
            continue
        ratio, failed = tested(1 + k, z, par, run)
        if live >> k & 1:
            out[RATIO + k] = ratio
            if failed and several > 1:
                out[DISAGREE] = 1.0
        for i in range(3):
            least = off[1 + k, i] + par[K_MISSED] * sigma[1 + k, i]
            if least > out[PL + i]:
                out[PL + i] = least
    if several > 1:
        for slot in range(born.shape[0]):
            forks(slot, sources, live, z, L, born[slot], par, run, out)
