"""Figures of the gust mission: error of the wind and bias estimates, their consistency, and a_z with and without alleviation.

The first `SETTLE_S` are left out; an error whose truth the run does not hold throughout is None. The reduction compares an
aircraft that alleviates with one that holds, at the same times in the same air; where one aircraft flew both laws one after the
other, a_z is given per law.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.columns import Columns
from ground.views.gust.read import HOLD, LAWS, SHOWN, GustFlight, flights, has_gust

SETTLE_S = 2.0
BIAS_S = 25.0  # [s] the bias counts from here, well after its step
DEG = 180.0 / np.pi
UNITS = {"alpha_w": ("deg", DEG), "v_w": ("mps", 1.0), "bias": ("deg", DEG)}
Flat = dict[str, Any]


def _rms(x: NDArray[np.float64]) -> float | None:
    return float(np.sqrt(np.mean(x * x))) if len(x) else None


def gust_metrics(run: Path, truth: Columns, tlm: Columns) -> Flat:
    """gust.<aircraft>.* and gust.alleviation.*; {} for a run without a gust mission."""
    if not has_gust(tlm):
        return {}
    out: Flat = {}
    all_of_them = flights(run, truth, tlm)
    for f in all_of_them:
        out |= {f"gust.{f.name}.{k}": v for k, v in _estimate(f).items()}
        out |= {f"gust.{f.name}.{k}": v for k, v in _loads(f).items()}
    return out | _reduction(all_of_them)


def _estimate(f: GustFlight) -> Flat:
    use = f.valid & (f.t >= SETTLE_S)
    late = use & (f.t >= BIAS_S) if f.t[-1] > BIAS_S + 1.0 else use
    out: Flat = {"samples": int(use.sum()), "left_out": f.left_out, "valid_pct": float(100.0 * f.valid.mean())}
    for i, name in enumerate(SHOWN):
        unit, factor = UNITS[name]
        mask = late if name == "bias" else use
        e, s = (f.est[mask, i] - f.truth[mask, i]) * factor, f.sigma[mask, i] * factor
        if not np.isfinite(f.truth[mask, i]).all():  # part of the time will not do: the numbers would be of that part
            e, s = e[:0], s[:0]
        out[f"{name}.rms_{unit}"] = _rms(e)
        out[f"{name}.mean_{unit}"] = float(e.mean()) if len(e) else None
        known = np.isfinite(s)
        out[f"{name}.nees"] = float(np.mean((e[known] / s[known]) ** 2)) if known.any() else None
        out[f"{name}.inside_2sigma_pct"] = (
            float(100.0 * np.mean(np.abs(e[known]) <= 2 * s[known])) if known.any() else None
        )
    counted = use & (f.state["channels"] > 0)
    nis = f.state["nis"][counted].astype(np.float64) / f.state["channels"][counted]
    out["nis_over_m"] = float(nis.mean()) if len(nis) else None
    scale = f.state["scale"][use].astype(np.float64)
    out["scale_mean"] = float(scale.mean()) if len(scale) else None
    return out


def _loads(f: GustFlight) -> Flat:
    use = f.t >= SETTLE_S
    low = f.low()
    out: Flat = {"a_z.rms_mps2": _rms(f.a_z[use]), "a_z.low_rms_mps2": _rms(low[use])}
    laws = np.unique(f.law[use])
    if len(laws) > 1:
        for law in laws:
            part = use & (f.law == law)
            out[f"{LAWS[int(law)]}.a_z.rms_mps2"] = _rms(f.a_z[part])
            out[f"{LAWS[int(law)]}.a_z.low_rms_mps2"] = _rms(low[part])
    height = -f.true["pos_n"][use, 2]
    out["height_rms_m"] = _rms(height - (-f.true["pos_n"][0, 2]))
    for key in ("elevator", "flap"):
        angle = f.state[key][use].astype(np.float64)
        out[f"{key}.rms_deg"] = _rms(angle * DEG)
        out[f"{key}.max_deg"] = float(np.abs(angle).max() * DEG) if len(angle) else None
    out["alpha_max_deg"] = float(np.abs(f.true["alpha"][use]).max() * DEG) if use.any() else None
    return out


def pair(found: list[GustFlight]) -> tuple[GustFlight, GustFlight] | None:
    """(the aircraft that alleviates, the one that holds all the time), None where the run does not have both."""
    hold = [f for f in found if (f.law[f.t >= SETTLE_S] == HOLD).all()]
    other = [f for f in found if (f.law[f.t >= SETTLE_S] != HOLD).any()]
    return (other[0], hold[0]) if hold and other else None


def _reduction(found: list[GustFlight]) -> Flat:
    both = pair(found)
    if both is None:
        return {}
    active, hold = both
    same, i, j = np.intersect1d(active.t_us, hold.t_us, return_indices=True)
    use = (same >= SETTLE_S * 1e6) & (active.law[i] != HOLD)
    out: Flat = {"gust.alleviation.samples": int(use.sum())}
    for key, a, h in (("total", active.a_z, hold.a_z), ("low", active.low(), hold.low())):
        x, y = _rms(a[i][use]), _rms(h[j][use])
        ok = x is not None and y is not None and y > 0.0
        out[f"gust.alleviation.{key}_reduction_pct"] = 100.0 * (1.0 - x / y) if ok else None  # type: ignore[operator]
        peak = np.abs(a[i][use]).max() if use.any() else 0.0, np.abs(h[j][use]).max() if use.any() else 0.0
        out[f"gust.alleviation.{key}_peak_reduction_pct"] = (
            float(100.0 * (1.0 - peak[0] / peak[1])) if peak[1] else None
        )
    return out
