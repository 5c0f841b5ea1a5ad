"""Alarm index, isolation index, true and false alarm percentages (Sevil 2013, eq. 5.29 to 5.33; errata E3, E4), and theory."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import chdtri

Array = np.ndarray


def threshold(p_false: float, dof: int = 2) -> float:
    """Chi-square value exceeded with probability p_false (eq. 5.15); -2 ln p_false for two degrees of freedom.

    Raises ValueError unless 0 < p_false < 1 and dof >= 1.
    """
    if not 0.0 < p_false < 1.0 or dof < 1:
        raise ValueError(f"p_false={p_false}, dof={dof}; allowed inside (0,1), >= 1")
    return -2.0 * math.log(p_false) if dof == 2 else float(chdtri(dof, p_false))


def noncentrality(fault: float, sigma: float, n: int = 1) -> float:
    """lambda = n (2/3) f^2/sigma^2 of one probe's constant fault in the mean of n samples, any probe (sevil.md 6, 9.3)."""
    return n * (2.0 / 3.0) * (fault / sigma) ** 2


def detection_probability(fault: float, sigma: float, p_false: float, n: int = 1) -> float:
    """Probability of an alarm per sample: noncentral chi-square with 2 degrees of freedom, window filled with the fault."""
    from scipy.stats import ncx2  # a second of start-up, and theory only

    h = threshold(p_false)
    lam = noncentrality(fault, sigma, n)
    return p_false if lam == 0.0 else float(ncx2.sf(h, 2, lam))


def alarm_index(gamma: Array, h: float) -> Array:
    """AI [N]: 1 where the hypothesis of no fault is rejected, gamma > h (eq. 5.29 prints the cases swapped: E3, E8)."""
    return (np.asarray(gamma) > h).astype(np.int64)


def isolation_index(alarm: Array, probe: Array) -> Array:
    """SII [N]: 0 without alarm, else probe number 1..3 of probe [N] in 0..2 (eq. 5.30)."""
    return np.where(np.asarray(alarm) != 0, np.asarray(probe) + 1, 0)


def true_alarm_pct(alarm: Array, first: int, last: int) -> float:
    """TAP [%]: share of alarms among the samples first..last (0-based, both included) in which the fault is present (5.32).

    Raises ValueError when the interval is empty or outside the record.
    """
    a = _checked(alarm, first, last)
    return 100.0 * float(a[first : last + 1].mean())


def false_alarm_pct(alarm: Array, first: int | None = None, last: int | None = None) -> float:
    """FAP [%]: share of alarms among the samples outside first..last, or among all when no fault is given (5.31, 5.33).

    Eq. 5.33 divides by N and by the length of the fault; right is the number of samples outside (erratum E4).
    Raises ValueError when the interval is outside the record or leaves nothing.
    """
    if first is None or last is None:
        a = np.asarray(alarm, dtype=float)
        return 100.0 * float(a.mean())
    a = _checked(alarm, first, last)
    outside = a.size - (last - first + 1)
    if outside == 0:
        raise ValueError(f"fault {first}..{last} covers all {a.size} samples; FAP needs samples outside")
    return 100.0 * float(a.sum() - a[first : last + 1].sum()) / outside


def false_alarm_pct_printed(alarm: Array, first: int, last: int) -> float:
    """FAP [%] by eq. 5.33 as printed: divided by N and by the fault's length (E4); for comparison only."""
    a = _checked(alarm, first, last)
    return 100.0 * float(a.sum() - a[first : last + 1].sum()) / a.size / (last - first + 1)


def isolation_pct(alarm: Array, probe: Array, faulty: int, first: int, last: int) -> float:
    """Share [%] of the alarms in first..last that blame probe `faulty` (0..2); NaN without alarms."""
    a = _checked(alarm, first, last)[first : last + 1] != 0.0
    hit = np.asarray(probe)[first : last + 1][a] == faulty
    return 100.0 * float(hit.mean()) if hit.size else math.nan


def delay(alarm: Array, first: int) -> int:
    """Samples from the first faulty one to the alarm, counting both: 1 = at once; -1 if there is none."""
    a = np.flatnonzero(np.asarray(alarm)[first:])
    return int(a[0]) + 1 if a.size else -1


def _checked(alarm: Array, first: int, last: int) -> Array:
    a = np.asarray(alarm, dtype=float)
    if not 0 <= first <= last < a.size:
        raise ValueError(f"fault interval {first}..{last}; allowed 0 <= first <= last < {a.size}")
    return a
