"""Detectors over whole records: single sample, mean of the last n, CUSUM (sevil.md 9.3). All take residuals of parity.py."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightsw.missions.receiver.airdata.fdi.metrics import threshold
from flightsw.missions.receiver.airdata.fdi.monitor_kernel import ALIKE, ONE, TWO, window_record
from flightsw.missions.receiver.airdata.fdi.parity import PARITY, Residuals, covariance, normalise, null_space
from flightsw.missions.receiver.airdata.fdi.parity_kernels import cusum_record

Array = np.ndarray

P_KEEP, P_JUMP, P_CALM = 1e-6, 1e-5, 1e-2  # tail probabilities: standing decision, change inside a window, quiet


def threshold_table(p_alarm: float, p_decide: float = 1e-4, p_calm: float = P_CALM, p_alike: float = 0.0) -> Array:
    """Thresholds [6,4] of the kernels: rows alarm, decide, keep, jump, calm, alike; columns degrees of freedom 0 to 3.

    p_alike: probability of an error of the prediction as large as must speak against two that lie alike before one is blamed;
    0: not asked. Raises ValueError for other probabilities outside (0,1).
    """
    th = np.zeros((6, 4))
    if p_alike > 0.0:
        th[ALIKE, ONE], th[ALIKE, TWO] = threshold(p_alike, 1), threshold(p_decide, 1)
    for row, p in enumerate((p_alarm, p_decide, min(P_KEEP, p_decide), P_JUMP, p_calm)):
        th[row, ONE:] = [threshold(p, dof) for dof in (1, 2, 3)]
    return th


def moving_mean(x: Array, n: int) -> Array:
    """Mean over the last n samples along axis 0, fewer at the beginning. Raises ValueError for n < 1."""
    if n < 1:
        raise ValueError(f"window n={n}; allowed >= 1")
    x = np.asarray(x, dtype=float)
    out = x.copy()
    for k in range(1, min(n, len(x))):
        out[k:] += x[:-k]
    m = np.minimum(np.arange(1, len(x) + 1), n).astype(float)
    return out / m.reshape(-1, *(1,) * (x.ndim - 1))


def windowed(
    Y: Array, sigma: Array | float, n: int, E: Array | None = None, S: Array | None = None, form: str = "additive"
) -> Residuals:
    """Residuals of the mean of the last n samples (fewer at the start); n = 1 is the single-sample test.

    Y [N,3] readings, E [N,3] expected ones (None: all equal, the plain test), S [3,3] or [N,3,3] covariance of E, which does not
    average out; `form` "additive" or "multiplicative" (mean reading in the null space of the mean expectation). Noise of
    one reading: sigma (one, or [3]). Raises ValueError for another form, or multiplicative without E.
    """
    if form not in ("additive", "multiplicative"):
        raise ValueError(f"form={form!r}; allowed: additive, multiplicative")
    Y = np.asarray(Y, dtype=float)
    m = np.minimum(np.arange(1, len(Y) + 1), n)[:, None, None]
    C = covariance(sigma) / m if S is None else covariance(sigma) / m + S
    if form == "multiplicative":
        if E is None:
            raise ValueError("form='multiplicative', E=None; allowed: E [N,3]")
        V = null_space(moving_mean(np.broadcast_to(E, Y.shape), n))
        return normalise(np.einsum("nij,nj->ni", V, moving_mean(Y, n)), V, C)
    r = Y if E is None else Y - E
    return normalise(moving_mean(r, n) @ PARITY.T, PARITY, C)


def windowed_cleared(
    Y: Array, sigma: Array | float, n: int, p_alarm: float, E: Array | None = None, S: Array | None = None
) -> Residuals:
    """As `windowed` (additive), but while in alarm the window drops its older samples once the newer ones are calm again.

    Without that a window keeps up to n-1 faulty samples after a fault has gone (sevil.md 9.3). p_alarm: false-alarm probability
    per sample of the alarm that arms the clearing.
    """
    Y = np.ascontiguousarray(Y, dtype=float)
    r = Y if E is None else Y - E
    N = len(r)
    h = np.ones((N, 3))
    var = np.diag(covariance(sigma)).copy()
    Sk = np.zeros((1, 3, 3)) if S is None else np.ascontiguousarray(S, dtype=float).reshape(-1, 3, 3)
    mean, dirn, cov, gamma = np.empty((N, 3)), np.empty((N, 3)), np.empty((N, 3, 3)), np.empty(N)
    window_record(np.ascontiguousarray(r), h, var, Sk, n, threshold_table(p_alarm), mean, dirn, cov, gamma)
    return normalise(mean @ PARITY.T, PARITY, cov)


@dataclass(frozen=True)
class Cusum:
    """CUSUM result: sums [N,6] for probes 1..3 reading high, low in turn; alarm [N]; probe [N] 0..2; sign [N]."""

    sums: Array
    alarm: Array
    probe: Array
    sign: Array


def cusum(res: Residuals, delta: float = 2.0, h: float = 13.0, cap: float | None = None, reset: bool = False) -> Cusum:
    """CUSUM of single-sample residuals along the six signed probe directions (sevil.md 9.3).

    delta: shift in standard deviations it is tuned to; alarm above h. Sums stop at `cap` (default 2 h), so that an alarm
    ends a few samples after its fault; with `reset` they restart at every alarm instead (counts events).
    Raises ValueError unless delta > 0 and 0 < h <= cap.
    """
    top = 2.0 * h if cap is None else cap
    if not (delta > 0.0 and 0.0 < h <= top):
        raise ValueError(f"delta={delta}, h={h}, cap={top}; allowed delta > 0, 0 < h <= cap")
    sums = np.empty((len(res.t), 6))
    cusum_record(np.ascontiguousarray(res.t), np.ascontiguousarray(res.mu), delta, h, top, reset, sums)
    high = np.argmax(sums, axis=1)
    return Cusum(sums, sums.max(axis=1) > h, high // 2, 1 - 2 * (high % 2))
