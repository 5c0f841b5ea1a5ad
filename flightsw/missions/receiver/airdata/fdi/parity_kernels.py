"""Parity-space kernels for three redundant probes: basis, whitening, subset tests, change inside a window, CUSUM.

One variable at a time: readings minus expectation r [3], their covariance C [3,3], and the direction h [3] in which the unknown
common value enters (ones: additive form; the expected readings themselves: Sevil 2013 eq. 5.24). Sets of probes are 3-bit masks.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own


@jit
def popcount(mask: int) -> int:
    """Number of set bits among the lowest three."""
    return (mask & 1) + ((mask >> 1) & 1) + ((mask >> 2) & 1)


@jit
def null_basis(h: np.ndarray, V: np.ndarray) -> None:
    """V [2,3] <- orthonormal rows with V h = 0 (Sevil 2013 eq. 5.3; erratum E6: V h, not V h^T).

    For equal entries V = [sqrt(2/3) -1/sqrt6 -1/sqrt6; 0 1/sqrt2 -1/sqrt2]. A zero h has no direction: that of ones is used.
    """
    s = math.sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
    if s > 0.0:
        a, b, c = h[0] / s, h[1] / s, h[2] / s
    else:
        a = b = c = math.sqrt(1.0 / 3.0)
    if abs(a) < 0.9:
        q = math.sqrt(1.0 - a * a)
        V[0, 0], V[0, 1], V[0, 2] = q, -a * b / q, -a * c / q
    else:
        q = math.sqrt(1.0 - b * b)
        V[0, 0], V[0, 1], V[0, 2] = -b * a / q, q, -b * c / q
    V[1, 0] = b * V[0, 2] - c * V[0, 1]
    V[1, 1] = c * V[0, 0] - a * V[0, 2]
    V[1, 2] = a * V[0, 1] - b * V[0, 0]


@jit
def whiten(r: np.ndarray, C: np.ndarray, V: np.ndarray, t: np.ndarray, mu: np.ndarray) -> bool:
    """t [2] <- G^-T V r and mu [2,3] <- G^-T V with V C V^T = G^T G (eq. 5.7, 5.8, 5.18); False if that is not positive.

    G^T is the lower Cholesky factor. t has unit covariance; |t|^2 does not depend on the basis V.
    """
    a = b = d = 0.0
    for i in range(3):
        for j in range(3):
            c = 0.5 * (C[i, j] + C[j, i])
            a += V[0, i] * c * V[0, j]
            b += V[1, i] * c * V[0, j]
            d += V[1, i] * c * V[1, j]
    if not a > 0.0:
        return False
    l00 = math.sqrt(a)
    l10 = b / l00
    e = d - l10 * l10
    if not e > 0.0:
        return False
    l11 = math.sqrt(e)
    t[0] = t[1] = 0.0
    for i in range(3):
        mu[0, i] = V[0, i] / l00
        mu[1, i] = (V[1, i] - l10 * mu[0, i]) / l11
        t[0] += mu[0, i] * r[i]
        t[1] += mu[1, i] * r[i]
    return True


@jit_own
def subset_fit(r: np.ndarray, C: np.ndarray, h: np.ndarray, inv_c: float, mask: int) -> tuple[float, float]:
    """(gamma, x): how badly the probes of `mask` disagree on one common value, and that value.

    x = h^T W r / (h^T W h + inv_c), gamma = r^T W r - (h^T W r)^2 / (h^T W h + inv_c), W the inverse of C over the probes;
    gamma = min over x of (r - h x)^T W (r - h x) + x^2 inv_c is chi-square with popcount - 1 degrees of freedom, one more when
    a virtual sensor says x = 0 with variance 1/inv_c (> 0). Without virtual sensor and for all three probes it is the
    parity statistic |T|^2 of eq. 5.14 (any basis). A covariance that is not positive gives (inf, 0).
    """
    L = np.zeros((3, 3))
    a = np.zeros(3)
    b = np.zeros(3)
    n = 0
    for i in range(3):
        if not (mask >> i) & 1:
            continue
        k = 0
        sa, sb, sd = r[i], h[i], C[i, i]
        for j in range(i):
            if not (mask >> j) & 1:
                continue
            s = 0.5 * (C[i, j] + C[j, i])
            for q in range(k):
                s -= L[n, q] * L[k, q]
            s /= L[k, k]
            L[n, k] = s
            sa -= s * a[k]
            sb -= s * b[k]
            sd -= s * s
            k += 1
        if not sd > 0.0:
            return math.inf, 0.0
        d = math.sqrt(sd)
        L[n, n] = d
        a[n] = sa / d
        b[n] = sb / d
        n += 1
    aa = ab = 0.0
    bb = inv_c
    for i in range(n):
        aa += a[i] * a[i]
        ab += a[i] * b[i]
        bb += b[i] * b[i]
    if not bb > 0.0:
        return aa, 0.0
    g = aa - ab * ab / bb
    return (g if g > 0.0 else 0.0), ab / bb


@jit
def subset_gammas(r: np.ndarray, C: np.ndarray, h: np.ndarray, inv_c: float, ok: int, g: np.ndarray) -> None:
    """g [8] <- for each set s of suspects: the statistic of the other probes of `ok`; inf where s is not within `ok`."""
    for s in range(8):
        g[s] = math.inf
        if s & ~ok == 0:
            g[s] = subset_fit(r, C, h, inv_c, ok & ~s)[0]


@jit
def smallest_set(g: np.ndarray, ok: int, within: int, extra: int, start: int, h: np.ndarray) -> int:
    """The smallest set of suspects inside `within` whose absence makes the rest of `ok` agree; -1 if there is none.

    g [8] from subset_gammas; extra 1 with a virtual sensor, else 0; sets of fewer than `start` suspects are not considered;
    h [4]: threshold by degrees of freedom. The rest must be testable (at least one degree of freedom), except that a
    virtual sensor may contradict every probe. Among sets of equal size the smallest statistic wins (sevil.md 9.4).
    """
    k = popcount(ok)
    for size in range(start, k + 1):
        dof = k - size - 1 + extra
        if dof < 1 and not (extra == 1 and size == k):
            break
        best, low = -1, math.inf
        for s in range(8):
            if popcount(s) != size or s & ~(ok & within) != 0:
                continue
            if g[s] < low and (dof < 1 or g[s] <= h[dof]):
                best, low = s, g[s]
        if best >= 0:
            return best
    return -1


@jit_own
def collapse(
    r: np.ndarray, h: np.ndarray, first: int, n: int, use: np.ndarray, C1: np.ndarray, S: np.ndarray, ok: int,
    jump: np.ndarray, calm: np.ndarray,
) -> int:  # fmt: skip
    """How many of the newest samples of a window to keep: n, or fewer when the residual collapsed inside it.

    r, h [N,3] rings, newest sample at `first`, counting back n; use [N] whether a sample counts. C1 [3,3] covariance of one
    sample, S [3,3] that of an error all samples share. For each split the newer mean must be calm by itself and
    differ from the older one by more than chance (a likelihood ratio test for a change of the mean); the most likely
    split wins. jump, calm [4]: thresholds by degrees of freedom.
    """
    N = r.shape[0]
    dof = popcount(ok) - 1
    keep, best = n, 0.0
    new, old, hm = np.zeros(3), np.zeros(3), np.zeros(3)
    D = np.zeros((3, 3))
    for k in range(1, n):
        kn = ko = 0
        for c in range(3):
            new[c] = old[c] = hm[c] = 0.0
        for j in range(n):
            i = (first - j) % N
            if use[i] == 0:
                continue
            if j < k:
                kn += 1
            else:
                ko += 1
            for c in range(3):
                hm[c] += h[i, c]
                if j < k:
                    new[c] += r[i, c]
                else:
                    old[c] += r[i, c]
        if kn == 0 or ko == 0:
            continue
        for c in range(3):
            hm[c] /= kn + ko
            new[c] /= kn
            old[c] = new[c] - old[c] / ko
        for i in range(3):
            for j in range(3):
                D[i, j] = C1[i, j] / kn + S[i, j]
        if subset_fit(new, D, hm, 0.0, ok)[0] > calm[dof]:
            continue
        for i in range(3):
            for j in range(3):
                D[i, j] = C1[i, j] * (1.0 / kn + 1.0 / ko)
        g = subset_fit(old, D, hm, 0.0, ok)[0]
        if g > jump[dof] and g > best:
            keep, best = k, g
    return keep


@jit
def cusum_step(t: np.ndarray, mu: np.ndarray, delta: float, cap: float, s: np.ndarray) -> None:
    """s [6] <- one step of the CUSUM sums for +-mu_1..3: max(0, s + delta u.t - delta^2/2), the largest no higher than `cap`.

    What the largest has above `cap` is taken off all of them, so that they keep their order: one cap for each would end in
    ties, and a tie blames nobody in particular.

    t [2] whitened residual, mu [2,3]; u = +-mu_i/|mu_i|: s[2i] for a probe i that reads high, s[2i+1] low. delta: the shift in
    standard deviations it is tuned to (Page 1954, log likelihood ratio of two normals delta apart).
    """
    top = 0.0
    for i in range(3):
        q = math.sqrt(mu[0, i] * mu[0, i] + mu[1, i] * mu[1, i])
        c = (mu[0, i] * t[0] + mu[1, i] * t[1]) / q if q > 0.0 else 0.0
        for k in range(2):
            v = s[2 * i + k] + (delta * c if k == 0 else -delta * c) - 0.5 * delta * delta
            s[2 * i + k] = max(v, 0.0)
            top = max(top, v)
    if top > cap:
        for j in range(6):
            s[j] = max(s[j] - (top - cap), 0.0)


@jit
def take_off_rotation(y: np.ndarray, w: np.ndarray, probes: np.ndarray, out: np.ndarray) -> None:
    """out [9] <- readings y [9] (V1..3 [m/s], beta1..3, alpha1..3 [rad]) without the body's rotation (eq. 5.34-5.37).

    w [3] inertial body rates [rad/s], probes [3,3] body positions [m]: u_c = u_m - w x rho. Eq. 5.35 prints -S(w) rho, which is
    +w x rho because the source's S (eq. 2.8) is minus the usual cross-product matrix.
    """
    for i in range(3):
        V, b, a = y[i], y[3 + i], y[6 + i]
        x, yy, z = probes[i, 0], probes[i, 1], probes[i, 2]
        u = V * math.cos(b) * math.cos(a) - (w[1] * z - w[2] * yy)
        v = V * math.sin(b) - (w[2] * x - w[0] * z)
        ww = V * math.cos(b) * math.sin(a) - (w[0] * yy - w[1] * x)
        n = math.sqrt(u * u + v * v + ww * ww)
        out[i] = n
        s = v / n if n > 0.0 else 0.0
        out[3 + i] = math.asin(min(max(s, -1.0), 1.0))
        out[6 + i] = math.atan2(ww, u)


@jit_own
def cusum_record(
    t: np.ndarray, mu: np.ndarray, delta: float, h: float, cap: float, reset: bool, out: np.ndarray
) -> None:
    """out [N,6] <- CUSUM sums after each of the residuals t [N,2]; mu [1 or N,2,3]; with `reset` they restart above h."""
    s = np.zeros(6)
    last = mu.shape[0] - 1
    for k in range(t.shape[0]):
        cusum_step(t[k], mu[min(k, last)], delta, cap, s)
        high = 0.0
        for i in range(6):
            out[k, i] = s[i]
            high = max(high, s[i])
        if reset and high > h:
            for i in range(6):
                s[i] = 0.0
