"""Kernels of answer.py: controls that explain a motion, and their means over windows (docs/sources/recovery.md 11)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.sixdof.recovery.readings_kernel import (
    AHEAD,
    ALPHA,
    ASIDE,
    BELOW,
    BETA,
    DOWN,
    FORWARD,
    IXX,
    IYY,
    IZZ,
    LOAD,
    MASS,
    PITCHED,
    PITCHING,
    PRESSURE,
    ROLLED,
    ROLLING,
    SPEED,
    YAWED,
    YAWING,
)  # fmt: skip

# file's numbers
(
    CL0, CLA, CLDE, CD0, CK, CM0, CMA, CMAD, CMQ, CMDE, CYB, CYDR, CLB, CLP, CLR, CLDA, CLDR, CNB, CNP, CNR, CNDA, CNDR,
    AREA, SPAN, CHORD, IDLE, FULL, NUMBERS,
) = range(28)  # fmt: skip
THRUST = 3
# what is remembered from step to step: controls of the last [4] (surfaces rad, thrust N); what is lasting [8]; what counts at
# least, and of the movement [4]; by which gyro and reference have been apart at most [3] rad; thrust of an engine as slow as the
# file's spool [N], below 0: not known; that there is [N]; [s] that has been learnt
LAST, LASTING, LEAST, SHARE, APART, SLOW, AVAILABLE, LEARNT_S, MEMORY = 0, 4, 12, 16, 20, 23, 24, 25, 26
SIGMAS = 6.0  # of the mean of a window, as learnt
LEARN_S = 20.0  # [s]
DOUBTFUL = 0.5  # [-] of what is too far, beyond which nothing is learnt
LAZY = 0.7  # [-] of the file's spool
APART_S = 2.0  # [s] over which it is forgotten that gyro and reference were apart


def numbers(ac: Aircraft) -> np.ndarray:
    """[NUMBERS] of an aircraft's file."""
    c, g = ac.aero, ac.geometry
    return np.array([
        c.CL0, c.CL_alpha, c.CL_de, c.CD0, c.K, c.Cm0, c.Cm_alpha, c.Cm_alphadot, c.Cm_q, c.Cm_de, c.CY_beta, c.CY_dr,
        c.Cl_beta, c.Cl_p, c.Cl_r, c.Cl_da, c.Cl_dr, c.Cn_beta, c.Cn_p, c.Cn_r, c.Cn_da, c.Cn_dr, g.S_m2, g.b_m, g.c_m,
        ac.engine.spool_idle_ps, ac.engine.spool_full_ps,
    ])  # fmt: skip


@jit
def swinging(x: np.ndarray) -> float:
    """[rad/s] of the incidence in the motion x [MOTION], by rates and forces."""
    ca, sa = math.cos(x[ALPHA]), math.sin(x[ALPHA])
    across = (x[DOWN] + G0 * x[BELOW]) * ca - (x[AHEAD] + G0 * x[FORWARD]) * sa
    return x[PITCHING] + across / x[SPEED] - x[ROLLING] * math.tan(x[BETA])


@jit
def explained(x: np.ndarray, P: np.ndarray, dt: float, out: np.ndarray) -> None:
    """out [8]: aileron, elevator, rudder [rad] and thrust [N] that make the motion x [MOTION] (readings_kernel.py) of a step
    of dt [s], with incidence and sideslip by the vanes; the same by the forces."""
    V, qS = x[SPEED], x[PRESSURE] * P[AREA]
    p, q, r = 0.5 * (x[ROLLING] + x[ROLLED]), 0.5 * (x[PITCHING] + x[PITCHED]), 0.5 * (x[YAWING] + x[YAWED])
    ixx, iyy, izz = x[IXX], x[IYY], x[IZZ]
    hb, hc = 0.5 * P[SPAN] / V, 0.5 * P[CHORD] / V
    roll = (ixx * (x[ROLLING] - x[ROLLED]) / dt - (iyy - izz) * q * r) / (qS * P[SPAN]) - hb * (P[CLP] * p + P[CLR] * r)
    yaw = (izz * (x[YAWING] - x[YAWED]) / dt - (ixx - iyy) * p * q) / (qS * P[SPAN]) - hb * (P[CNP] * p + P[CNR] * r)
    pitch = (iyy * (x[PITCHING] - x[PITCHED]) / dt - (izz - ixx) * p * r) / (qS * P[CHORD])
    pitch -= P[CM0] + hc * (P[CMQ] * q + P[CMAD] * swinging(x))
    lift = x[LOAD] * x[MASS] * G0 / qS
    elevator = (P[CLA] * pitch - P[CMA] * (lift - P[CL0])) / (P[CLA] * P[CMDE] - P[CMA] * P[CLDE])
    # sideslip by the side force: CY_beta b + CY_dr r = side; b put into the two moments
    side = x[ASIDE] * x[MASS] / qS
    for k in range(2):
        alpha = x[ALPHA] if k == 0 else (lift - P[CL0] - P[CLDE] * elevator) / P[CLA]
        if k == 0:
            lda, nda, ldr, ndr = roll - P[CLB] * x[BETA], yaw - P[CNB] * x[BETA], P[CLDR], P[CNDR]
        else:
            b, b_dr = side / P[CYB], -P[CYDR] / P[CYB]
            lda, nda, ldr, ndr = roll - P[CLB] * b, yaw - P[CNB] * b, P[CLDR] + P[CLB] * b_dr, P[CNDR] + P[CNB] * b_dr
        det = P[CLDA] * ndr - ldr * P[CNDA]
        out[4 * k] = (lda * ndr - nda * ldr) / det
        out[4 * k + 1] = (pitch - P[CMA] * alpha) / P[CMDE]
        out[4 * k + 2] = (nda * P[CLDA] - lda * P[CNDA]) / det
        out[4 * k + 3] = x[MASS] * x[AHEAD] - qS * (
            lift * math.sin(alpha) - (P[CD0] + P[CK] * lift * lift) * math.cos(alpha)
        )


@jit
def unexplained(x: np.ndarray, P: np.ndarray, dt: float, believed: np.ndarray, out: np.ndarray) -> None:
    """As `explained`, both less the controls that are believed to have acted [4]."""
    explained(x, P, dt, out)
    for j in range(4):
        out[j] -= believed[j]
        out[4 + j] -= believed[j]


@jit
def learn(off: np.ndarray, mean: np.ndarray, gain: float, weak: bool, lasting: np.ndarray, square: np.ndarray) -> None:
    """A step's `off` [8] into what is lasting [8], and `mean` [2, 8] squared into `square`, by a share `gain`; `weak`: thrust
    that is missed is not got used to."""
    for i in range(8):
        if weak and i % 4 == THRUST:
            continue
        lasting[i] += gain * (off[i] - lasting[i])
    for w in range(2):
        for i in range(8):
            square[w, i] += gain * (mean[w, i] * mean[w, i] - square[w, i])


@jit
def total(ring: np.ndarray, n: int, count: int, j: int) -> float:
    """Sum of column j of the last `count` of n rows written to a ring, from the last on."""
    k, out = (n - 1) % ring.shape[0], 0.0
    for _ in range(count):
        out += ring[k, j]
        k = k - 1 if k > 0 else ring.shape[0] - 1
    return out


@jit
def spread(ring: np.ndarray, n: int, count: int, j: int) -> float:
    """Largest less smallest of the same."""
    k, lo, hi = (n - 1) % ring.shape[0], math.inf, -math.inf
    for _ in range(count):
        lo, hi = min(lo, ring[k, j]), max(hi, ring[k, j])
        k = k - 1 if k > 0 else ring.shape[0] - 1
    return hi - lo


@jit
def means(
    off: np.ndarray, n: int, told: np.ndarray, windows: np.ndarray, recent: int, lasting: np.ndarray, square: np.ndarray,
    least: np.ndarray, sigmas: float, share: np.ndarray, out: np.ndarray, over: np.ndarray,
) -> None:  # fmt: skip
    """Means out [2, 8] of the last `windows` [2] steps less what is lasting, and of each control how many times it is as far off
    as it may be, over [4]: 0 where vanes and forces do not say the same.

    off [*, 8], told [*, 4]: rings, of which n steps have been written, what is off and what is believed; recent: steps over which
    the surfaces' movement counts; square [2, 8]: mean squares of `out`; least, share [4]: what counts at least, and of the
    movement.
    """
    for j in range(4):
        over[j] = 0.0
        moved = spread(told, n, min(n, told.shape[0] if j == THRUST else recent), j)
        floor = max(least[j], share[j] * moved)
        for w in range(2):
            count = min(windows[w], n)
            for side in range(2):
                i = 4 * side + j
                out[w, i] = total(off, n, count, i) / count - lasting[i]
            if w == 0 and j == THRUST:
                continue
            a, b = out[w, j], out[w, 4 + j]
            if a * b > 0.0:
                x = min(
                    abs(a) / max(floor, sigmas * math.sqrt(square[w, j])),
                    abs(b) / max(floor, sigmas * math.sqrt(square[w, 4 + j])),
                )
                over[j] = max(over[j], x)


@jit
def learnt(
    off: np.ndarray, mean: np.ndarray, most: float, weak: bool, dt: float, m: np.ndarray, square: np.ndarray
) -> None:
    """`learn` a step of dt [s], unless something is `most` [-] as far off as it may be and that is doubtful; m [MEMORY]."""
    if m[LEARNT_S] < LEARN_S or most < DOUBTFUL:
        m[LEARNT_S] += dt
        gain = dt / (LEARN_S if m[LEARNT_S] > LEARN_S else m[LEARNT_S])
        learn(off, mean, gain, weak, m[LASTING:LEAST], square)


@jit
def lagging(thrust: float, P: np.ndarray, dt: float, m: np.ndarray) -> float:
    """By how much [N] the file's slowest engine has another thrust by now than is believed: what is between is not off."""
    if m[SLOW] < 0.0 or P[FULL] == 0.0:
        m[SLOW] = thrust
    full = m[SLOW] / m[AVAILABLE]
    full = 0.0 if full < 0.0 else 1.0 if full > 1.0 else full
    most = LAZY * (P[IDLE] + (P[FULL] - P[IDLE]) * full) * m[AVAILABLE] * dt
    more = thrust - m[SLOW]
    m[SLOW] += -most if more < -most else most if more > most else more
    return m[SLOW] - thrust


@jit
def parted(x: float, y: float, z: float, dt: float, m: np.ndarray) -> None:
    """By how much gyro and reference have been apart, in m [MEMORY], after dt [s] more: now they are by x, y, z [rad]."""
    faded, now = 1.0 - dt / APART_S, (abs(x), abs(y), abs(z))
    for i in range(3):
        was = (0.0 if faded < 0.0 else faded) * m[APART + i]
        m[APART + i] = was if was > now[i] else now[i]


@jit
def looked(
    x: np.ndarray, P: np.ndarray, dt: float, u: np.ndarray, n: int, enough: int, off: np.ndarray, told: np.ndarray,
    windows: np.ndarray, recent: int, m: np.ndarray, square: np.ndarray, weak: bool, mean: np.ndarray, over: np.ndarray,
    away: float, aside: float, around: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Step n of the rings off [*,8] and told [*,4] <- `unexplained` of the motion x beyond the mean of the controls u [4] and
    those of the step before, and those; then, once `enough` steps have been written, `means` into mean [2, 8] and over [4], and
    where nothing is too far off nor `weak`, it is `learnt`. How many times the one that is most is as far off as it may be (-1.0:
    not enough steps), and where the surfaces are [rad], by the vanes over the shorter window. m [MEMORY]; away, aside, around
    [rad]: as `parted`."""
    parted(away, aside, around, dt, m)
    row, acted = off[n % off.shape[0]], told[n % told.shape[0]]
    for j in range(4):
        acted[j] = 0.5 * (m[LAST + j] + u[j])
        m[LAST + j] = u[j]
    unexplained(x, P, dt, acted, row)
    lag = lagging(acted[THRUST], P, dt, m)
    for side in range(2):
        i = 4 * side + THRUST
        within = row[i]  # between 0 and the lag
        if min(lag, 0.0) > within:
            within = min(lag, 0.0)
        if max(lag, 0.0) < within:
            within = max(lag, 0.0)
        row[i] -= within
    if n + 1 < enough:
        return -1.0, 0.0, 0.0, 0.0
    lasting, least, share = m[LASTING:LEAST], m[LEAST:SHARE], m[SHARE:APART]
    means(off, n + 1, told, windows, recent, lasting, square, least, SIGMAS, share, mean, over)
    most = over[0]
    for j in range(1, 4):
        if over[j] > most:
            most = over[j]
    if most <= 1.0 and not weak:
        learnt(row, mean, most, weak, dt, m, square)
    return most, acted[0] + mean[0, 0], acted[1] + mean[0, 1], acted[2] + mean[0, 2]


@jit
def follows(off: np.ndarray, n: int, told: np.ndarray, count: int, slope: np.ndarray, sigma: np.ndarray) -> None:
    """Of each surface the slope [3] of what is off (mean of both solutions) over what is believed, both less their means and
    trends over the last `count` steps, and one sigma of it: 0 where it follows, -1 where it stands still. Rings as in `means`."""
    size, length = off.shape[0], told.shape[0]
    mid = 0.5 * (count - 1)
    tt = count * (count * count - 1.0) / 12.0
    for j in range(3):
        su = sy = tu = ty = uu = uy = yy = 0.0
        for k in range(count):
            u = told[(n - count + k) % length, j]
            row = off[(n - count + k) % size]
            y, t = 0.5 * (row[j] + row[4 + j]), k - mid
            su += u
            sy += y
            tu += t * u
            ty += t * y
            uu += u * u
            uy += u * y
            yy += y * y
        uu -= su * su / count + tu * tu / tt
        uy -= su * sy / count + tu * ty / tt
        yy -= sy * sy / count + ty * ty / tt
        uu = max(uu, 1e-12)
        slope[j] = uy / uu
        sigma[j] = math.sqrt(max(yy - uy * uy / uu, 0.0) / (count - 3) / uu)
