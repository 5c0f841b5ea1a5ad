"""Result files: runs.parquet (one row per run) and summary.json (statistics per case and value).

Both are functions of the rows alone: sorted, without wall time, so that they are equal to the byte however many workers
made them and however often the campaign was interrupted.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hil_scripts.campaign.study import CampaignError, finite
from hil_scripts.campaign.task import Row

PARQUET = "runs.parquet"
SUMMARY = "summary.json"
CONFIDENCE = 0.95
Pool = Callable[[Sequence[Mapping[str, float]]], dict[str, float | int | None]]
KEYS = ("case", "run", "master_seed", "seed", "status", "reason")


def ordered(rows: Sequence[Row]) -> list[Row]:
    """Rows by case and run index; of two with one key the first counts."""
    first: dict[tuple[str, int], Row] = {}
    for row in rows:
        first.setdefault((row.case, row.run), row)
    return [first[k] for k in sorted(first)]


def replace_bytes(path: Path, data: bytes) -> None:
    """Write a file so that a reader sees the old or the new one, never half. Raises OSError."""
    tmp = path.with_name(path.name + ".part")
    tmp.write_bytes(data)
    tmp.replace(path)


def write_parquet(path: Path, rows: Sequence[Row], master_seed: int) -> None:
    """One row per run, columns KEYS and then one double per value (null where a run has none). Raises CampaignError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = ordered(rows)
    names = sorted({k for r in rows for k in r.values})
    clash = sorted(set(names) & set(KEYS))
    if clash:
        raise CampaignError(f"value {clash[0]!r} has the name of a key column ({', '.join(KEYS)})")
    arrays = [
        pa.array([r.case for r in rows], pa.string()),
        pa.array([r.run for r in rows], pa.int64()),
        pa.array([master_seed] * len(rows), pa.int64()),
        pa.array([r.seed for r in rows], pa.int64()),
        pa.array([r.status for r in rows], pa.string()),
        pa.array([r.reason for r in rows], pa.string()),
        *(pa.array([r.values.get(n) for r in rows], pa.float64()) for n in names),
    ]
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table(arrays, names=[*KEYS, *names]), sink, compression="zstd")
    replace_bytes(path, sink.getvalue().to_pybytes())


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """95 % confidence interval of the mean, Student's t with n-1 degrees of freedom; None below two values."""
    n = len(values)
    if n < 2:
        return None
    from scipy import stats  # slow to import: not for every list of studies

    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, n - 1)) * float(np.std(values, ddof=1)) / math.sqrt(n)
    mean = float(np.mean(values))
    return mean - half, mean + half


def share_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """95 % confidence interval of a share of zeros and ones (Wilson 1927); None without values."""
    n = len(values)
    if n == 0:
        return None
    from scipy import stats  # slow to import: not for every list of studies

    z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2.0))
    p = float(np.mean(values))
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)


def statistics(values: Sequence[float], binary: bool) -> dict[str, float | None]:
    """Statistics over runs of one value: mean with ci95, rms (root of the mean square) with rms_ci95, p95, n.

    Values that are not finite are left out and counted as `nonfinite` (present only if there are any).
    rms_ci95 is the interval of the mean square, its root taken; it brackets the pooled RMS of runs of equal length.
    """
    good = [v for v in values if finite(v)]
    out: dict[str, float | None] = dict.fromkeys(
        ("mean", "rms", "p95", "ci95_lo", "ci95_hi", "rms_ci95_lo", "rms_ci95_hi"), None
    )
    out["n"] = len(good)
    if len(good) < len(values):
        out["nonfinite"] = len(values) - len(good)
    if not good:
        return out
    square = [v * v for v in good]
    out["mean"], out["p95"] = float(np.mean(good)), float(np.percentile(good, 95))
    out["rms"] = math.sqrt(float(np.mean(square)))
    ci, ci_square = (share_interval(good) if binary else mean_interval(good)), mean_interval(square)
    if ci is not None:
        out["ci95_lo"], out["ci95_hi"] = ci
    if ci_square is not None:
        out["rms_ci95_lo"], out["rms_ci95_hi"] = math.sqrt(max(0.0, ci_square[0])), math.sqrt(ci_square[1])
    return out


def summarise(rows: Sequence[Row], binary: Sequence[str] = ("lost",), pool: Pool | None = None) -> dict[str, Any]:
    """Flat summary: "<case>.<value>.<statistic>", "<case>.runs", "<case>.failed". Raises CampaignError on a clash.

    pool: see Study.pool; what it gives that is not finite becomes None.
    """
    flat: dict[str, Any] = {}

    def put(key: str, value: Any) -> None:
        if key in flat:
            raise CampaignError(f"summary key {key!r} arises twice; rename the case or the value")
        flat[key] = value

    rows = ordered(rows)
    for case in sorted({r.case for r in rows}):
        mine = [r for r in rows if r.case == case]
        put(f"{case}.runs", len(mine))
        put(f"{case}.failed", sum(r.status != "ok" for r in mine))
        if pool is not None:
            good = [r.values for r in mine if r.status == "ok"]
            for name, v in (pool(good) if good else {}).items():
                put(f"{case}.{name}", v if v is not None and finite(v) else None)
            continue
        for name in sorted({k for r in mine for k in r.values}):
            values = [r.values[name] for r in mine if name in r.values]
            for stat, value in statistics(values, name.rpartition(".")[2] in binary).items():
                put(f"{case}.{name}.{stat}", value)
    return flat


def write_summary(path: Path, rows: Sequence[Row], binary: Sequence[str], pool: Pool | None = None) -> None:
    """summary.json: sorted keys, null where there is no number."""
    text = json.dumps(summarise(rows, binary, pool), indent=1, sort_keys=True, allow_nan=False)
    replace_bytes(path, text.encode() + b"\n")
