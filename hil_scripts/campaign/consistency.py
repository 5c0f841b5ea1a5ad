"""How good an estimate is and whether its covariance tells the truth: NEES, NIS, shares, convergence, intervals.

Definitions after Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), sec. 5.4.
"""

from __future__ import annotations

import math

import numpy as np

Array = np.ndarray


def nees(error: Array, P: Array) -> Array:
    """Normalised estimation error squared [...] = e^T P^-1 e of errors [..., n] with covariances P [..., n, n].

    Chi-square with n degrees of freedom for a consistent filter. Raises numpy.linalg.LinAlgError when a P is not
    positive definite. Innovations and their covariances give NIS by the same formula.
    """
    L = np.linalg.cholesky(P)
    z = np.linalg.solve(L, np.asarray(error)[..., None])[..., 0]
    return np.sum(z * z, axis=-1)


nis = nees


def chi2_band(dof: int, runs: int = 1, confidence: float = 0.95) -> tuple[float, float]:
    """Two-sided interval of the mean over `runs` independent values of a chi-square variable with `dof` degrees of freedom.

    Raises ValueError for dof or runs < 1 or confidence outside (0,1).
    """
    if dof < 1 or runs < 1 or not 0.0 < confidence < 1.0:
        raise ValueError(f"dof={dof}, runs={runs}, confidence={confidence}; allowed >= 1, >= 1, in (0,1)")
    q = 0.5 * (1.0 - confidence)
    from scipy.stats import chi2  # slow to import: not for every list of studies

    lo, hi = chi2.ppf([q, 1.0 - q], dof * runs) / runs
    return float(lo), float(hi)


def share_in_band(mean_nees: Array, dof: int, runs: int, confidence: float = 0.95) -> float:
    """Share of the time points [k] at which the run-averaged NEES lies in its band; about `confidence` when consistent."""
    lo, hi = chi2_band(dof, runs, confidence)
    v = np.asarray(mean_nees)
    return float(np.mean((v >= lo) & (v <= hi)))


def share_inside(error: Array, sigma: Array, k: float = 3.0) -> float:
    """Share of samples with |error| <= k sigma; error and sigma broadcast together. NaN errors count as outside."""
    return float(np.mean(np.abs(error) <= k * np.asarray(sigma)))


def convergence_time(t: Array, error: Array, bound: Array | float, hold_s: float) -> float:
    """Earliest t_i - t_0 [s] such that |error| <= bound at every sample in [t_i, t_i + hold_s]; NaN if there is none.

    t [k] ascending [s]; error [k]; bound [k] or scalar, e.g. 3 sigma. The whole hold must lie inside the record, except that
    hold_s = inf asks for all the rest of it. NaN errors are outside. A filter that starts with a very wide sigma is
    inside its own bound at once: give the bound of its steady state to measure how fast the error itself settles.
    """
    t = np.asarray(t, dtype=float)
    outside = ~(np.abs(np.asarray(error)) <= bound)
    if len(t) == 0:
        return math.nan
    # next sample that is outside, seen from each sample
    nxt = np.where(outside, t, np.inf)
    nxt = np.minimum.accumulate(nxt[::-1])[::-1]
    end = np.minimum(t + hold_s, t[-1]) if math.isinf(hold_s) else t + hold_s
    ok = (nxt > end) & (end <= t[-1] * (1.0 + 1e-12))
    i = int(np.argmax(ok))
    return float(t[i] - t[0]) if ok[i] else math.nan


def rms(x: Array, axis: int | None = None) -> Array:
    """Root mean square along an axis (all elements by default)."""
    return np.sqrt(np.mean(np.square(x), axis=axis))


def rms_interval(per_run: Array, confidence: float = 0.95) -> tuple[float, float, float]:
    """RMS over runs and its normal-theory interval (value, lo, hi) from the RMS of each run [N].

    The mean square is averaged over runs (runs are independent, samples within one are not); its standard error is carried
    through the square root. One run gives NaN limits. Raises ValueError when empty.
    """
    ms = np.square(np.asarray(per_run, dtype=float))
    if ms.size == 0:
        raise ValueError("RMS of each run: 0 runs given; allowed >= 1")
    value = math.sqrt(float(ms.mean()))
    if ms.size == 1:
        return value, math.nan, math.nan
    from scipy.stats import norm  # slow to import: not for every list of studies

    half = float(norm.ppf(0.5 + 0.5 * confidence)) * float(ms.std(ddof=1)) / math.sqrt(ms.size)
    return value, math.sqrt(max(float(ms.mean()) - half, 0.0)), math.sqrt(float(ms.mean()) + half)


def rms_bootstrap(
    per_run: Array, rng: np.random.Generator, confidence: float = 0.95, draws: int = 2000
) -> tuple[float, float, float]:
    """RMS over runs with a percentile bootstrap over runs (value, lo, hi); per_run [N] is the RMS of each run.

    The generator is the caller's, so the result is reproducible. Raises ValueError when empty.
    """
    ms = np.square(np.asarray(per_run, dtype=float))
    if ms.size == 0:
        raise ValueError("RMS of each run: 0 runs given; allowed >= 1")
    means = ms[rng.integers(0, ms.size, size=(draws, ms.size))].mean(axis=1)
    q = 0.5 * (1.0 - confidence)
    lo, hi = np.sqrt(np.quantile(means, [q, 1.0 - q]))
    return math.sqrt(float(ms.mean())), float(lo), float(hi)


def percentiles(x: Array, q: tuple[float, ...] = (50.0, 95.0, 99.0)) -> tuple[float, ...]:
    """Percentiles of |x| over all finite samples; NaN when there are none."""
    a = np.abs(np.asarray(x, dtype=float).ravel())
    a = a[np.isfinite(a)]
    if a.size == 0:
        return tuple(math.nan for _ in q)
    return tuple(float(v) for v in np.percentile(a, q))
