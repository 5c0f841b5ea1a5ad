"""Errors of wind estimates: NAV_STATE against the effective wind in TRUTH, at the estimate's times.

`left_out`: estimates for which there is no truth near enough (ground.align).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ground.align import align
from ground.columns import Table
from ground.geometry import wrap
from ground.run import Run
from ground.views.base import Figures, Mask

NED = "ned"
EMPTY = np.empty((0, 3))
Counts = Callable[[int, NDArray[np.int64]], Mask]  # (system id, times [us]) -> which of them count


def wind_stats(truth: NDArray[np.float64], hat: NDArray[np.float64], sigma: NDArray[np.float64]) -> Figures:
    """Errors of wind estimates (n,3) NED [m/s] with their 1-sigma, against truth. nees: mean square of error over its own sigma,
    about 1 for an estimate that knows its error, below for one that is better than it says; nees_over_3 of the three axes."""
    keys = ["magnitude_rms_pct", "direction_rms_deg", "inside_3sigma_pct", "nees_over_3"]
    keys += [f"{k}.{a}" for k in ("inside_3sigma_pct", "rms_mps", "nees") for a in NED]
    out: Figures = {"samples": len(truth), **dict.fromkeys(keys)}
    if not len(truth):
        return out
    mag, mag_hat = np.linalg.norm(truth, axis=1), np.linalg.norm(hat, axis=1)
    rel = (mag_hat - mag)[mag > 0] / mag[mag > 0]
    angle = wrap(np.arctan2(hat[:, 1], hat[:, 0]) - np.arctan2(truth[:, 1], truth[:, 0]))
    error = hat - truth
    inside = np.abs(error) <= 3.0 * sigma
    out["magnitude_rms_pct"] = float(100.0 * np.sqrt(np.mean(rel**2))) if len(rel) else None
    out["direction_rms_deg"] = float(np.degrees(np.sqrt(np.mean(angle**2))))
    out["inside_3sigma_pct"] = float(100.0 * inside.mean())
    with np.errstate(divide="ignore", invalid="ignore"):
        q = (error / sigma) ** 2
    out["nees_over_3"] = float(q.mean())
    for i, axis in enumerate(NED):
        out[f"inside_3sigma_pct.{axis}"] = float(100.0 * inside[:, i].mean())
        out[f"nees.{axis}"] = float(q[:, i].mean())
        out[f"rms_mps.{axis}"] = float(np.sqrt(np.mean(error[:, i] ** 2)))
    return out


def wind_pairs(run: Run, sysid: int) -> tuple[Table, Table] | None:
    """Rows of TRUTH and of NAV_STATE of one aircraft at the latter's times, valid estimates only; None: it has not both."""
    nav, true = run.tlm.get(sysid, "NAV_STATE"), run.truth.get(sysid, "TRUTH")
    if nav is None or true is None:
        return None
    nav = nav.pick(nav["valid"] != 0)
    a = align(true.t_us, nav.t_us)
    return a.table(true), nav.pick(a.at)


def wind_figures(run: Run, crafts: Mapping[int, str], counts: Counts) -> Figures:
    """wind.<aircraft>.* of these aircraft (system id -> name), if they have estimate and truth, over the times that count."""
    out: Figures = {}
    for sysid, name in crafts.items():
        pair = wind_pairs(run, sysid)
        if pair is None:
            continue
        true, nav = pair
        use = counts(sysid, true.t_us)
        columns = (true["wind_n"], nav["wind"], nav["wind_sigma"])
        out |= {f"wind.{name}.{k}": v for k, v in wind_stats(*(c[use].astype(np.float64) for c in columns)).items()}
        out[f"wind.{name}.left_out"] = int((run.tlm.tables[sysid, "NAV_STATE"]["valid"] != 0).sum()) - len(true)
    return out
