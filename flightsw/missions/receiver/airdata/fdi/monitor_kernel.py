"""One variable, one sample of the air-data monitor: window, test, decision, exclusion and re-admission (sevil.md 9.3 to 9.5)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own
from flightsw.missions.receiver.airdata.fdi.parity_kernels import (
    collapse,
    popcount,
    smallest_set,
    subset_fit,
    subset_gammas,
)

# rows of the threshold table [6,4]; columns: degrees of freedom, but of ALIKE: how much better than "the other two lie alike" the
# prediction must fit "this one lies" (ONE), and the other way about (TWO); 0: not asked
ALARM, DECIDE, KEEP, JUMP, CALM, ALIKE = 0, 1, 2, 3, 4, 5
ONE, TWO = 1, 2
# counters of a channel, columns of cnt [3,6]; DOUBT: samples in a row in which it was not decided who lies
QUIET, NEED, SINCE, TOTAL, BLAMED, DOUBT = 0, 1, 2, 3, 4, 5
# entries of lim [4]
BASE, TOP, RELAPSE, DROP = 0, 1, 2, 3
# entries of the result out [7]
O_ALARM, O_BLAMED, O_NEGATIVE, O_UNRESOLVED, O_SAMPLES, O_BAD, O_PROBES = 0, 1, 2, 3, 4, 5, 6


@jit
def window_mean(
    R: np.ndarray, H: np.ndarray, use: np.ndarray, first: int, span: int, r: np.ndarray, h: np.ndarray
) -> int:
    """r, h [3] <- means of the rings R, H [N,3] over the newest `span` samples that count (use [N]); returns how many."""
    N = R.shape[0]
    m = 0
    for c in range(3):
        r[c] = h[c] = 0.0
    for j in range(span):
        i = (first - j) % N
        if use[i] == 0:
            continue
        m += 1
        for c in range(3):
            r[c] += R[i, c]
            h[c] += H[i, c]
    if m > 0:
        for c in range(3):
            r[c] /= m
            h[c] /= m
    return m


@jit
def covariance(var: np.ndarray, S: np.ndarray, m: int, C: np.ndarray) -> None:
    """C [3,3] <- diag(var)/m + S: noise averages out over m samples, the error of the expectation does not."""
    for i in range(3):
        for j in range(3):
            C[i, j] = S[i, j]
        C[i, i] += var[i] / m


@jit
def exclude(cnt: np.ndarray, lim: np.ndarray) -> None:
    """Counters of a channel (row of cnt) at its exclusion: soon after a re-admission it must prove itself twice as long."""
    again = cnt[SINCE] < lim[RELAPSE]
    cnt[NEED] = min(2 * cnt[NEED], lim[TOP]) if again else lim[BASE]
    cnt[QUIET] = 0
    cnt[TOTAL] += 1


@jit
def blame(
    r: np.ndarray, C: np.ndarray, h: np.ndarray, inv_c: float, ok: int, settled: int, th: np.ndarray, g: np.ndarray
) -> int:
    """Which probes of `ok` are faulty, given that not all agree; -1 when that cannot be told.

    Subsets of `settled`, probes blamed for a good while, come first and at the wider threshold KEEP: a standing decision is
    not widened for one unlikely sample. One of three that differs from two that agree is blamed only where the virtual sensor
    bears it out (row ALIKE): it may be those that lie alike. g [8] is filled with the statistics.
    """
    extra = 1 if inv_c > 0.0 else 0
    subset_gammas(r, C, h, inv_c, ok, g)
    d = -1
    if settled & ok != 0:
        d = smallest_set(g, ok, settled, extra, 1, th[KEEP])
    if d >= 0:
        return d
    d = smallest_set(g, ok, 7, extra, 1, th[DECIDE])
    if extra == 1 and th[ALIKE, ONE] > 0.0 and d > 0 and popcount(d) == 1 and popcount(ok) == 3:
        others = ok & ~d
        lead = g[others] - g[d]
        if lead < th[ALIKE, ONE]:
            d = others if -lead > th[ALIKE, TWO] and g[others] <= th[DECIDE, ONE] else -1
    return d


@jit
def agrees(
    r: np.ndarray, C: np.ndarray, h: np.ndarray, inv_c: float, rest: int, c: int, th: np.ndarray
) -> bool:  # fmt: skip
    """Whether probe c fits the other probes of `rest`; the virtual sensor is asked only when there is no other probe.

    It is asked at the threshold DECIDE: its error lasts for seconds, so many quiet samples say no more than one.
    """
    limit = th[CALM, ONE]
    if popcount(rest) > 1:
        inv_c = 0.0
    elif inv_c > 0.0:
        limit = th[DECIDE, ONE]
    else:
        return False
    with_c = subset_fit(r, C, h, inv_c, rest)[0]
    return with_c - subset_fit(r, C, h, inv_c, rest & ~(1 << c))[0] <= limit


@jit
def signs(r: np.ndarray, C: np.ndarray, h: np.ndarray, inv_c: float, ok: int, d: int) -> int:
    """Mask of the probes in d that read low against what the others (and the virtual sensor) say."""
    rest = ok & ~d
    x = subset_fit(r, C, h, inv_c, rest)[1] if rest != 0 else 0.0
    low = 0
    for c in range(3):
        if (d >> c) & 1 and r[c] - h[c] * x < 0.0:
            low |= 1 << c
    return low


@jit_own
def monitor_variable(
    R: np.ndarray, H: np.ndarray, val: np.ndarray, use: np.ndarray, first: int, span: int, ok: int, bad: int,
    excluded: int, hint: int, var: np.ndarray, S: np.ndarray, inv_c: float, th: np.ndarray, lim: np.ndarray,
    cnt: np.ndarray, r: np.ndarray, h: np.ndarray, C: np.ndarray, g: np.ndarray, out: np.ndarray,
) -> tuple[int, int, float]:  # fmt: skip
    """One sample of one variable; returns (span, excluded, gamma).

    R, H [N,3] rings of residuals and of the direction of the common value, val [N] probes with a sane reading, newest at `first`;
    use [N] scratch; span: samples since the window was cleared, at most N. ok: probes to test now, bad: probes whose
    reading is impossible, excluded: probes kept out, hint: probe mask another detector (CUSUM) blames, 0 for none.
    var [3] noise variances, S [3,3] covariance of the expectation, inv_c: 1/variance of the virtual sensor or 0, th [6,4]
    thresholds, lim [4] limits, cnt [3,6] channel counters; scratch and results r, h [3] window means, C [3,3] their
    covariance, g [8], out [7]. gamma has popcount(ok) - 1 degrees of freedom.
    """
    N = R.shape[0]
    for k in range(7):
        out[k] = 0
    out[O_PROBES] = ok
    gamma, d, resolved = 0.0, 0, True
    for i in range(N):
        use[i] = 1 if val[i] & ok == ok else 0
    m = window_mean(R, H, use, first, span, r, h)
    if m > 0 and ok != 0:
        covariance(var, S, m, C)
    testable = m > 0 and popcount(ok) > 1
    if testable:
        dof = popcount(ok) - 1
        gamma = subset_fit(r, C, h, 0.0, ok)[0]
        if not gamma < math.inf:
            out[O_BAD] = 1
            gamma, m = 0.0, 0
        if gamma > th[ALARM, dof] and m > 1:
            covariance(var, np.zeros((3, 3)), 1, C)
            k = collapse(R, H, first, span, use, C, S, ok, th[JUMP], th[CALM])
            if k < span:
                span = k
                m = window_mean(R, H, use, first, span, r, h)
            covariance(var, S, m, C)
            gamma = subset_fit(r, C, h, 0.0, ok)[0]
        if gamma > th[ALARM, dof]:
            settled = 0
            for c in range(3):
                settled |= 1 << c if cnt[c, BLAMED] >= lim[BASE] else 0
            d = blame(r, C, h, inv_c, ok, settled, th, g)
            if d < 0:
                d, resolved = ok, False
            out[O_ALARM] = 1
        elif hint != 0 and ok == 7 and m > 0:
            d = hint
            out[O_ALARM] = 1
    out[O_SAMPLES] = m
    out[O_BLAMED] = bad | (d if resolved else 0)
    out[O_UNRESOLVED] = 0 if resolved else d
    if resolved and d != 0:
        out[O_NEGATIVE] = signs(r, C, h, inv_c, ok, d)
    for c in range(3):
        bit = 1 << c
        cnt[c, SINCE] = min(cnt[c, SINCE] + 1, 1 << 30)
        cnt[c, BLAMED] = min(cnt[c, BLAMED] + 1, 1 << 30) if resolved and d & bit != 0 else 0
        # where two may lie alike a window has to fill before it can be told
        doubted = th[ALIKE, ONE] > 0.0 and cnt[c, DOUBT] > N
        cnt[c, DOUBT] = min(cnt[c, DOUBT] + 1, 1 << 30) if d & bit != 0 and not resolved else 0
        drop = lim[DROP] != 0 and (th[ALIKE, ONE] == 0.0 or cnt[c, DOUBT] > N)
        wrong = bad & bit != 0 or (d & bit != 0 and (resolved or drop))
        if doubted and resolved and d != 0 and d & bit == 0 and ok & bit != 0:  # decided since, and it was another
            excluded &= ~bit
        if excluded & bit == 0:
            if wrong:
                excluded |= bit
                exclude(cnt[c], lim)
        elif wrong or d & bit != 0 or ok & bit == 0 or m == 0 or not agrees(r, C, h, inv_c, ok & ~d, c, th):
            cnt[c, QUIET] = 0
        else:
            cnt[c, QUIET] += 1
            if cnt[c, QUIET] >= cnt[c, NEED]:
                excluded &= ~bit
                cnt[c, SINCE] = 0
    return span, excluded, gamma


@jit_own
def window_record(
    r: np.ndarray, h: np.ndarray, var: np.ndarray, S: np.ndarray, n: int, th: np.ndarray, mean: np.ndarray,
    dirn: np.ndarray, cov: np.ndarray, gamma: np.ndarray,
) -> None:  # fmt: skip
    """A whole record of one variable through the window test with clearing on collapse; no exclusion.

    r, h [N,3] residuals and direction of the common value, var [3], S [1 or N,3,3], n window, th [6,4] thresholds. Results after
    each sample: mean, dirn [N,3], cov [N,3,3] of the mean, gamma [N]. Same decisions as monitor_variable with all
    probes in use.
    """
    N = r.shape[0]
    R, H = np.zeros((n, 3)), np.zeros((n, 3))
    use = np.ones(n, dtype=np.int64)
    C = np.zeros((3, 3))
    zero = np.zeros((3, 3))
    last = S.shape[0] - 1
    ok = (1 << r.shape[1]) - 1  # all three; for a 7, fixed when compiled, the callees would be compiled once more
    span = 0
    for k in range(N):
        first = k % n
        for c in range(3):
            R[first, c] = r[k, c]
            H[first, c] = h[k, c]
        span = min(span + 1, n)
        s = S[min(k, last)]
        m = window_mean(R, H, use, first, span, mean[k], dirn[k])
        covariance(var, s, m, C)
        g = subset_fit(mean[k], C, dirn[k], 0.0, ok)[0]
        if g > th[ALARM, TWO] and m > 1:
            covariance(var, zero, 1, C)
            keep = collapse(R, H, first, span, use, C, s, ok, th[JUMP], th[CALM])
            if keep < span:
                span = keep
                m = window_mean(R, H, use, first, span, mean[k], dirn[k])
            covariance(var, s, m, C)
            g = subset_fit(mean[k], C, dirn[k], 0.0, ok)[0]
        gamma[k] = g
        for i in range(3):
            for j in range(3):
                cov[k, i, j] = C[i, j]
