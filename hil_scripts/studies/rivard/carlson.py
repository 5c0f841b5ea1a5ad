"""The source's update in a square root (Carlson, Fast triangular formulation of the square root filter, AIAA Journal 11, 1973),
and whether it pays in a short word: what Rivard (1982), section VI, leaves open.

The onboard filters work in double, where it would change nothing but rounding; so it stands here and not among their parameters.
States in the order of range_filter.py: y [m], deviation of the along-track velocity [m/s], x [m]; frame R.

python -m hil_scripts.studies.rivard.carlson
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np

from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous.params import KN, NM, RendezvousNavParams, three_vector

Array = np.ndarray
SPEED = 396.0 * KN  # [m/s] of both aircraft
END_M = 5.0 * NM  # the flight ends this far apart along track


@dataclass(frozen=True)
class Setting:
    """A head-on flight past each other, both straight: where it begins, and how good the ranges are."""

    text: str
    range_m: float
    sigma_y_m: float  # of the lateral position at the start
    offset_m: float
    interval_s: float
    sigma_m: float  # of a range
    noise: float = 1.0  # on both process noises of the filter


# the source's own two starts, and ranges of two-way time of flight on a receiver that is known to hold its track
SETTINGS = (
    Setting("30 NM, 10 s, TACAN", 30 * NM, NM, 9.6 * NM, 10.0, 0.1013 * NM),
    Setting("30 NM, 2 s, TACAN", 30 * NM, NM, 9.6 * NM, 2.0, 0.1013 * NM),
    Setting("100 NM, 2 s, TACAN", 100 * NM, 6.149 * NM, 9.6 * NM, 2.0, 0.1013 * NM),
    Setting("100 NM, 2 s, 2 m, its noise", 100 * NM, 6.149 * NM, 9.6 * NM, 2.0, 2.0),
    Setting("100 NM, 2 s, 0.2 m, its noise", 100 * NM, 6.149 * NM, 9.6 * NM, 2.0, 0.2),
    Setting("100 NM, 2 s, 2 m, no noise", 100 * NM, 6.149 * NM, 9.6 * NM, 2.0, 2.0, 0.0),
    Setting("100 NM, 2 s, 0.2 m, no noise", 100 * NM, 6.149 * NM, 9.6 * NM, 2.0, 0.2, 0.0),
)


def printed(P: Array, h: Array, r: float) -> tuple[Array, Array]:
    """Covariance [n,n] and gain [n] after one scalar of row h [n] and variance r: (21) with its inverse, (25), rivard.md E6."""
    K = P @ h / (h @ P @ h + r)
    return P - np.outer(K, h @ P), K


def joseph(P: Array, h: Array, r: float) -> tuple[Array, Array]:
    """The same as (I - K h) P (I - K h)^T + K r K^T, made symmetric as flightsw/filters/correction.py does."""
    K = P @ h / (h @ P @ h + r)
    A = np.eye(len(h), dtype=P.dtype) - np.outer(K, h)
    out = np.tril(A @ P @ A.T + r * np.outer(K, K))
    return out + np.tril(out, -1).T, K


def flown(P: Array, h: Array, r: float) -> tuple[Array, Array]:
    """The same as P - k k^T/s with k = P h: scalar_update of the onboard filters, symmetric as it stands."""
    k = P @ h
    s = h @ k + r
    return P - np.outer(k, k) / s, k / s


def carlson(S: Array, h: Array, r: float) -> tuple[Array, Array]:
    """Upper triangular root [n,n] of the covariance S S^T, and gain [n], after one scalar of row h [n] and variance r > 0.

    f = S^T h, d_0 = r, b = 0; column by column d_j = d_(j-1) + f_j^2, S_ij <- S_ij sqrt(d_(j-1)/d_j) - b_i f_j/sqrt(d_(j-1) d_j),
    b_i += S_ij f_j of the old S; K = b/d_n. No difference of variances is formed. Works in the word of S.
    """
    f, out, b = S.T @ h, np.zeros_like(S), np.zeros_like(h)
    d = S.dtype.type(r)
    for j in range(len(h)):
        before, d = d, d + f[j] * f[j]
        keep, take = np.sqrt(before / d), f[j] / (np.sqrt(before) * np.sqrt(d))
        out[: j + 1, j] = S[: j + 1, j] * keep - b[: j + 1] * take
        b[: j + 1] += S[: j + 1, j] * f[j]
    return out, b / d


FULL = {"printed": printed, "flown": flown, "joseph": joseph}  # updates of a full covariance
FORMS = (*FULL, "carlson")


def upper(P: Array) -> Array:
    """Upper triangular S [n,n] with S S^T = P. Raises numpy.linalg.LinAlgError for P not positive definite."""
    return np.asarray(np.linalg.cholesky(P[::-1, ::-1])[::-1, ::-1])


def carried(S: Array, Phi: Array, G: Array) -> Array:
    """Upper triangular root [n,n] of Phi S S^T Phi^T + G G^T, by orthogonal triangularisation in the word of S: (20)."""
    R: Array = np.asarray(np.linalg.qr(np.hstack([Phi @ S, G])[::-1].T, mode="r"))
    return R.T[::-1, ::-1]


def covariances(s: Setting, form: str, word: type[np.floating]) -> Array:
    """P [N,3,3] in double after each range of a flight whose filter counts in `word`; the printed equations' own rows h."""
    e = three_vector(RendezvousNavParams(estimator="ekf3"), -SPEED)
    e[k3.E3_VAR0], dt = s.sigma_m**2, s.interval_s
    x, P0, Q = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    k3.ekf3_start(x, P0, s.range_m, 0.0, -s.offset_m, 0.0, s.sigma_y_m, e)
    noise = e.copy()
    noise[[k3.E3_QX, k3.E3_QY]] *= s.noise
    k3.ekf3_predict(np.zeros(3), Q, dt, noise)
    Phi = np.eye(3, dtype=word)
    Phi[k3.S3_X, k3.S3_V] = dt
    root = np.linalg.cholesky(Q).astype(word) if s.noise > 0.0 else np.zeros((3, 3), word)
    P, S, r = P0.astype(word), upper(P0).astype(word), float(s.sigma_m**2)
    out, ahead = [], float(x[k3.S3_X])
    while (ahead := ahead - 2.0 * SPEED * dt) > END_M:
        d = math.sqrt(ahead**2 + s.offset_m**2 + e[k3.E3_A0] ** 2)
        h = np.zeros(3, word)
        h[k3.S3_X], h[k3.S3_Y] = ahead / d, s.offset_m / d
        if form == "carlson":
            S = carlson(carried(S, Phi, root), h, r)[0]
            P = S.astype(float) @ S.T.astype(float)
        else:
            P = P.astype(word)
            P = FULL[form](Phi @ P @ Phi.T + Q.astype(word), h, r)[0]
        out.append(P.astype(float))
    return np.array(out)


@dataclass(frozen=True)
class Judged:
    """What a word does to a form: ranges fused, covariances among them that are none, largest relative error of a sigma."""

    ranges: int
    lost: int
    sigma_error: float


def judge(P: Array, true: Array) -> Judged:
    """Compare P [N,3,3] with the covariances in double, true [N,3,3]: lost where a variance or an eigenvalue of the symmetric
    part of the correlation is not positive; an error of a sigma whose variance is not positive is 1."""
    lost, error = 0, 0.0
    for a, b in zip(P, true, strict=True):
        v, sigma = np.diag(a), np.sqrt(np.diag(b))
        C = (a + a.T) / 2.0 / np.outer(sigma, sigma)
        lost += not (np.all(v > 0.0) and np.linalg.eigvalsh(C)[0] > 0.0)
        error = max(error, float(np.abs(np.sqrt(np.maximum(v, 0.0)) / sigma - 1.0).max()))
    return Judged(len(P), lost, error)


def main() -> int:
    """Print both words' figures of every setting. Returns the exit code."""
    print(f"{'setting':32s} {'ranges':>6s}" + "".join(f" | {f + ': lost, sigma off':>26s}" for f in FORMS))
    for s in SETTINGS:
        true = covariances(s, "carlson", np.float64)
        found = [judge(covariances(s, form, np.float32), true) for form in FORMS]
        line = "".join(f" | {j.lost:15d} {j.sigma_error:10.1e}" for j in found)
        print(f"{s.text:32s} {found[0].ranges:6d}{line}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
