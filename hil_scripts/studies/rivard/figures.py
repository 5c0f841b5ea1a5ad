"""Figures of a set of rendezvous: RMS with intervals, the band of 30-run tables, consistency of the filter. SI, y = y - y_T."""

from __future__ import annotations

import math

import numpy as np

from hil_scripts.campaign.consistency import rms_interval
from hil_scripts.studies.rivard import kernel as rk
from hil_scripts.studies.rivard.mc import RivardResult

STATES = ("velocity_mps", "fluctuation_mps", "drift_mps", "altitude_m", "bias_m")
TABLE_RUNS = 30  # runs behind a printed figure


def proportion(k: int, n: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a proportion k/n."""
    from scipy.stats import beta  # slow to import: not for every list of studies

    q = 0.5 * (1.0 - confidence)
    lo = float(beta.ppf(q, k, n - k + 1)) if k > 0 else 0.0
    hi = float(beta.ppf(1.0 - q, k + 1, n - k)) if k < n else 1.0
    return lo, hi


def misses(r: RivardResult) -> tuple[np.ndarray, np.ndarray]:
    """Misses x_m, y_m [m] of the rendezvous that finished."""
    ok = r.rows[:, rk.R_DONE] > 0.0
    return r.rows[ok, rk.R_XM], r.rows[ok, rk.R_YM]


def figures(r: RivardResult) -> dict[str, float]:
    """Flat dotted keys: n, unfinished, then per axis mean, sigma, RMS with 95 % interval, 95th percentile, times, alarms."""
    n = len(r.rows)
    done = int(np.sum(r.rows[:, rk.R_DONE] > 0.0))
    out: dict[str, float] = {"n": float(n), "unfinished": 1.0 - done / n}
    out["unfinished.lo"], out["unfinished.hi"] = proportion(n - done, n)
    if done:
        for axis, v in zip("xy", misses(r), strict=True):
            rms, lo, hi = rms_interval(v)
            out[f"{axis}.mean_m"], out[f"{axis}.sigma_m"] = float(v.mean()), float(v.std())
            out[f"{axis}.rms_m"], out[f"{axis}.rms_lo_m"], out[f"{axis}.rms_hi_m"] = rms, lo, hi
            out[f"{axis}.p95_m"] = float(np.percentile(np.abs(v), 95.0))
        out["turn.start_s"] = float(np.nanmean(r.rows[:, rk.R_TURN]))
        out["turn.end_s"] = float(np.nanmean(r.rows[:, rk.R_TIME]))
    alarm = r.rows[:, rk.R_ALARM]
    warned = int(np.sum(np.isfinite(alarm)))
    out["alarm"] = warned / n
    out["alarm.lo"], out["alarm.hi"] = proportion(warned, n)
    out["alarm.first_s"] = float(np.nanmedian(alarm)) if warned else math.nan
    out["refused.mean"] = float(r.rows[:, rk.R_REFUSED].mean())
    return out


def consistency(r: RivardResult) -> dict[str, float]:
    """Per sample time: actual and predicted sigma of x, v_x, y, mean error of y, mean NEES/3 with 95 % interval."""
    out: dict[str, float] = {}
    for j, t in enumerate(r.times):
        s = r.samples[r.samples[:, j, 7] > 0.0, j]
        if len(s) < 2:
            continue
        key = f"t{t:.0f}"
        out[f"{key}.n"] = float(len(s))
        for i, (name, unit) in enumerate((("x", "m"), ("vx", "mps"), ("y", "m"))):
            out[f"{key}.{name}.sigma_{unit}"] = float(s[:, i].std())
            out[f"{key}.{name}.mean_{unit}"] = float(s[:, i].mean())
            out[f"{key}.{name}.predicted_{unit}"] = float(s[:, 3 + i].mean())
        half = 1.96 * float(s[:, 6].std(ddof=1)) / math.sqrt(len(s))
        m = float(s[:, 6].mean())
        out[f"{key}.nees3"], out[f"{key}.nees3_lo"], out[f"{key}.nees3_hi"] = m, m - half, m + half
    return out


def observability(r: RivardResult) -> dict[str, float]:
    """Per sample time and state: actual error sigma over the sigma before any range (1: the ranges say nothing about it)."""
    out: dict[str, float] = {}
    for j, t in enumerate(r.times):
        keep = (r.samples[:, j, 7] > 0.0) & (r.states[:, j, 10] > 0.0)
        s = r.states[keep, j]
        if len(s) < 2:
            continue
        for i, name in enumerate(STATES):
            true = s[:, 5 + i]
            out[f"t{t:.0f}.{name.rsplit('_', 1)[0]}.ratio"] = float(np.std(s[:, i] - true) / np.std(true))
            out[f"t{t:.0f}.{name.rsplit('_', 1)[0]}.predicted_ratio"] = float(s[:, 10 + i].mean() / np.std(true))
    return out


def table_band(r: RivardResult, runs: int = TABLE_RUNS) -> dict[str, tuple[float, float]]:
    """Central 95 % of mean, sigma and RMS [m] of tables of `runs` rendezvous, per axis: keys "x.mean", "x.sigma", ... SI.

    Raises ValueError with fewer than 20 such tables.
    """
    out = {}
    for axis, v in zip("xy", misses(r), strict=True):
        k = len(v) // runs
        if k < 20:
            raise ValueError(f"{len(v)} rendezvous make {k} tables of {runs}; allowed >= 20")
        t = v[: k * runs].reshape(k, runs)
        for name, f in (("mean", t.mean(1)), ("sigma", t.std(1)), ("rms", np.sqrt((t * t).mean(1)))):
            lo, hi = np.quantile(f, [0.025, 0.975])
            out[f"{axis}.{name}"] = (float(lo), float(hi))
    return out
