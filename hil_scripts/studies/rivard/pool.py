"""Sums of one batch of rendezvous, and the figures of a case from the sums of all its batches. SI, y = y - y_T.

A batch is one run of the campaign; figures over batches are those of one large sample: means and RMS from summed moments, their
intervals from the moments as well, shares with Clopper-Pearson intervals. What has no sums (quantiles) is the mean over batches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from hil_scripts.studies.rivard import kernel as rk
from hil_scripts.studies.rivard.figures import TABLE_RUNS, misses, observability, proportion
from hil_scripts.studies.rivard.mc import NM, RivardResult
from sim_plant.rng import generator

Array = np.ndarray
Out = dict[str, float | int | None]
BOX_M = (1.0 * NM, 0.5 * NM)  # a roll-out outside +- this (x, y) is counted as "outside"
BEHIND_M = -2.0 * NM  # x_m below this: the tanker rolled out behind the receiver
STILL = 0.5  # a sample time counts while this share of the batch is still flying
RESAMPLES = 2000  # tables of 30 drawn from a batch
Z = 1.959964
MOMENTS = tuple(f"moment{i}" for i in range(1, 5))


def batch(r: RivardResult, turn_at_s: float = math.inf, printed: Sequence[float] | None = None) -> dict[str, float]:
    """Values of one batch.

    turn_at_s: when the receiver manoeuvres; alarms before it are counted apart. printed: mean, sigma and RMS of x and of
    y_T - y [NM] of a printed table: adds the central 95 % of tables of 30 and the share of them below each.
    """
    n = len(r.rows)
    x, y = misses(r)
    out: dict[str, float] = {"n": float(n), "done": float(len(x))}
    for axis, v in (("x", x), ("y", y)):
        for i, name in enumerate(MOMENTS):
            out[f"{axis}.{name}"] = float(np.mean(v ** (i + 1))) if len(v) else math.nan
        out[f"{axis}.p95_m"] = float(np.percentile(np.abs(v), 95.0)) if len(v) else math.nan
    inside = (np.abs(x) <= BOX_M[0]) & (np.abs(y) <= BOX_M[1])
    out["unfinished"] = float(n - len(x))
    out["outside"] = float(n - int(inside.sum()))
    out["behind"] = float((x < BEHIND_M).sum())
    alarm = r.rows[:, rk.R_ALARM]
    after = alarm[alarm >= turn_at_s] - turn_at_s
    out["alarm.any"], out["alarm.early"] = float(np.isfinite(alarm).sum()), float((alarm < turn_at_s).sum())
    out["alarm.late"] = float(len(after))
    out["alarm.delay_s"] = float(np.median(after)) if len(after) else math.nan
    out["turn.start_s"] = _mean(r.rows[:, rk.R_TURN])
    out["turn.end_s"] = _mean(r.rows[:, rk.R_TIME])
    if printed is not None:
        out |= bands(x, y, r.seed, printed)
    return out | filter_values(r) | {f"state.{k}": v for k, v in observability(r).items()}


def _mean(v: Array) -> float:
    v = v[np.isfinite(v)]
    return float(v.mean()) if len(v) else math.nan


def filter_values(r: RivardResult) -> dict[str, float]:
    """Per sample time "t<s>": error moments and predicted sigma of x, v_x, y; sum statistics of NEES/3."""
    out: dict[str, float] = {}
    for j, t in enumerate(r.times):
        s = r.samples[r.samples[:, j, 7] > 0.0, j]
        if len(s) < STILL * len(r.rows) or not len(s):
            continue
        k = f"t{t:.0f}"
        out[f"{k}.n"] = float(len(s))
        for i, name in enumerate(("x", "vx", "y")):
            for p, m in enumerate(MOMENTS):
                out[f"{k}.{name}.{m}"] = float(np.mean(s[:, i] ** (p + 1)))
            out[f"{k}.{name}.predicted"] = float(s[:, 3 + i].mean())
        for p, m in enumerate(MOMENTS[:2]):
            out[f"{k}.nees3.{m}"] = float(np.mean(s[:, 6] ** (p + 1)))
    return out


def bands(x: Array, y: Array, seed: int, printed: Sequence[float]) -> dict[str, float]:
    """Central 95 % of mean, sigma and RMS [m] of tables of 30 resampled from this batch, and the share below the print."""
    g = generator(seed, "rivard.tables")
    pick = g.integers(0, len(x), (RESAMPLES, TABLE_RUNS)) if len(x) else np.zeros((0, TABLE_RUNS), dtype=np.int64)
    out: dict[str, float] = {}
    for axis, v, sign, row in (("x", x, 1.0, printed[:3]), ("y", y, -1.0, printed[3:])):
        t = sign * v[pick]
        rms = np.sqrt((t * t).mean(1))
        for (name, f), value in zip((("mean", t.mean(1)), ("sigma", t.std(1)), ("rms", rms)), row, strict=True):
            key = f"{axis}.table30.{name}"
            lo, hi = np.quantile(f, [0.025, 0.975]) if len(f) else (math.nan, math.nan)
            out[f"{key}_lo_m"], out[f"{key}_hi_m"] = float(lo), float(hi)
            if math.isfinite(value):
                out[f"{key}_below"] = float(np.mean(f <= value * NM)) if len(f) else math.nan
    return out


def _put(out: Out, key: str, kind: str, value: float, lo: float, hi: float, n: float) -> None:
    ci = "rms_ci95" if kind == "rms" else "ci95"
    out |= {f"{key}.{kind}": value, f"{key}.{ci}_lo": lo, f"{key}.{ci}_hi": hi, f"{key}.n": round(n)}


def _moments(runs: Sequence[Mapping[str, float]], key: str, count: str, top: int) -> tuple[float, list[float]]:
    """Total count and the pooled raw moments 1 ... top of `key`."""
    have = [r for r in runs if r.get(count, 0.0) > 0.0 and math.isfinite(r.get(f"{key}.{MOMENTS[0]}", math.nan))]
    w = np.array([r[count] for r in have])
    n = float(w.sum())
    if n == 0.0:
        return 0.0, [math.nan] * top
    return n, [float(np.dot(w, [r[f"{key}.{m}"] for r in have]) / n) for m in MOMENTS[:top]]


def spread(out: Out, key: str, unit: str, n: float, m: Sequence[float]) -> None:
    """Mean, sigma and RMS of raw moments m [4] of n values, each with its 95 % interval (central limit theorem)."""
    m1, m2, m3, m4 = m
    var = max(m2 - m1 * m1, 0.0)
    central4 = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1**4
    half = Z * math.sqrt(var / n)
    _put(out, f"{key}.mean_{unit}", "mean", m1, m1 - half, m1 + half, n)
    half = Z * math.sqrt(max(central4 - var * var, 0.0) / n)
    low, high = math.sqrt(max(var - half, 0.0)), math.sqrt(var + half)
    _put(out, f"{key}.sigma_{unit}", "mean", math.sqrt(var), low, high, n)
    half = Z * math.sqrt(max(m4 - m2 * m2, 0.0) / n)
    low, high = math.sqrt(max(m2 - half, 0.0)), math.sqrt(m2 + half)
    _put(out, f"{key}.rms_{unit}", "rms", math.sqrt(m2), low, high, n)


SHARES = ("unfinished", "outside", "behind", "alarm.any", "alarm.early", "alarm.late")


def pooled(runs: Sequence[Mapping[str, float]]) -> Out:
    """Lines of the summary of one case: "<value>.<mean|rms>", its interval and n, the number of rendezvous behind it."""
    out: Out = {}
    n = sum(r["n"] for r in runs)
    out["rendezvous"] = round(n)
    for axis in "xy":
        count, m = _moments(runs, axis, "done", 4)
        if count:
            spread(out, axis, "m", count, m)
    for name in SHARES:
        k = round(sum(r[name] for r in runs))
        lo, hi = proportion(k, round(n))
        _put(out, name, "mean", k / n, lo, hi, n)
    moments = (*MOMENTS, "n", "done")
    for key in sorted({k for r in runs for k in r}):
        tail = key.rpartition(".")[2]
        if key.endswith(".n") and key.startswith("t") and key.count(".") == 1:
            _filter(out, runs, key[:-2])
        elif tail not in moments and tail != "predicted" and key not in SHARES:
            _batches(out, runs, key)
    return out


def _filter(out: Out, runs: Sequence[Mapping[str, float]], t: str) -> None:
    """Actual and predicted sigma and mean NEES/3 at one sample time."""
    for name, unit in (("x", "m"), ("vx", "mps"), ("y", "m")):
        n, m = _moments(runs, f"{t}.{name}", f"{t}.n", 4)
        spread(out, f"{t}.{name}", unit, n, m)
        have = [r for r in runs if r.get(f"{t}.n", 0.0) > 0.0]
        said = sum(r[f"{t}.n"] * r[f"{t}.{name}.predicted"] for r in have) / n
        out |= {f"{t}.{name}.predicted_{unit}.mean": said, f"{t}.{name}.predicted_{unit}.n": round(n)}
    n, (m1, m2) = _moments(runs, f"{t}.nees3", f"{t}.n", 2)
    half = Z * math.sqrt(max(m2 - m1 * m1, 0.0) / n)
    _put(out, f"{t}.nees3", "mean", m1, m1 - half, m1 + half, n)


def _batches(out: Out, runs: Sequence[Mapping[str, float]], key: str) -> None:
    """Mean over batches with Student's t; n counts rendezvous."""
    have = [(r[key], r["n"]) for r in runs if math.isfinite(r.get(key, math.nan))]
    if not have:
        return
    v = np.array([h[0] for h in have])
    half = math.nan
    if len(v) > 1:
        from scipy import stats  # slow to import: not for every list of studies

        half = float(stats.t.ppf(0.975, len(v) - 1)) * float(v.std(ddof=1)) / math.sqrt(len(v))
    mean = float(v.mean())
    _put(out, key, "mean", mean, mean - half, mean + half, sum(h[1] for h in have))
