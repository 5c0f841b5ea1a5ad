"""Figures of the windshear mission: errors of the wind estimate and their consistency, of the hazard index, how it was flown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ground.columns import Columns
from ground.views.windshear.read import (
    ABORT,
    ACCUSED,
    AL,
    CAUTION,
    KD,
    KL,
    VA,
    WH,
    WX,
    H,
    WindshearFlight,
    X,
    flights,
    has_windshear,
)

SETTLE_S = 2.0
DEG = 180.0 / np.pi
Flat = dict[str, Any]


def _rms(x: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(x * x))) if len(x) else None


def windshear_metrics(run: Path, truth: Columns, tlm: Columns) -> Flat:
    """windshear.<aircraft>.*; {} for a run without a windshear mission. The first `SETTLE_S` are left out of errors."""
    if not has_windshear(tlm):
        return {}
    out: Flat = {}
    for f in flights(run, truth, tlm):
        out |= {f"windshear.{f.name}.{k}": v for k, v in (_estimate(f) | _hazard(f) | _flown(f)).items()}
    return out


def _estimate(f: WindshearFlight) -> Flat:
    use = f.valid & (f.t >= SETTLE_S)
    out: Flat = {"samples": int(use.sum()), "left_out": f.left_out, "valid_pct": float(100.0 * f.valid.mean())}
    for name, at in (("w_x", WX), ("w_h", WH)):
        e, s = f.x[use, at] - f.true[use, at], f.sigma[use, at]
        out[f"{name}.rms_mps"] = _rms(e)
        out[f"{name}.max_mps"] = float(np.abs(e).max()) if len(e) else None
        out[f"{name}.inside_2sigma_pct"] = float(100.0 * np.mean(np.abs(e) <= 2.0 * s)) if len(e) else None
        out[f"{name}.nees"] = float(np.mean((e / s) ** 2)) if len(e) else None
        other = f.state["wind_monitor"][use, at - WX].astype(np.float64) - f.true[use, at]
        out[f"monitor.{name}.rms_mps"] = _rms(other[np.isfinite(other)])
    out["height.rms_m"] = _rms(f.x[use, H] - f.true[use, H])
    out["alpha.rms_deg"] = _rms((f.x[use, AL] - f.true[use, AL]) * DEG)
    counted = use & (f.state["channels"] > 0)
    ratio = f.state["nis"][counted].astype(np.float64) / f.state["channels"][counted]
    out["nis_over_m"] = float(ratio.mean()) if len(ratio) else None
    if use.any():
        last = np.flatnonzero(use)[-1]
        out |= {"lift_scale": float(f.x[last, KL]), "drag_scale": float(f.x[last, KD])}
        out["turbulence_mean"] = float(f.state["turbulence"][use].mean())
    out["monitor.apart_s"] = float(((f.state["alert"] & ACCUSED) > 0).sum() * f.dt)
    return out


def _hazard(f: WindshearFlight) -> Flat:
    use = f.valid & (f.t >= SETTLE_S)
    out: Flat = {}
    for key in ("quick", "slow"):
        true = f.low(f.thresholds["caution_s" if key == "quick" else "abort_s"])
        out[f"F.{key}.rms"] = _rms(f.state[key][use] - true[use])
        out[f"F.{key}.peak"] = float(true[use].max()) if use.any() else None
        out[f"F.{key}.peak_estimate"] = float(f.state[key][use].max()) if use.any() else None
    smooth = f.low(f.thresholds["caution_s"])
    return out | {"F.peak_m": float(f.true[use, X][np.argmax(smooth[use])]) if use.any() else None}


def _flown(f: WindshearFlight) -> Flat:
    h, alert, i = f.true[:, H], f.state["alert"], f.abort
    c = f.first((alert & CAUTION) > 0)
    cautions = np.flatnonzero(np.diff(((alert & CAUTION) > 0).astype(int), prepend=0) > 0)
    out: Flat = {
        "survived": bool(h.min() > 0.0 and h[-1] > h.min()),
        "height_min_m": float(h.min()),
        "height_end_m": float(h[-1]),
        "speed_min_mps": float(f.true[:, VA].min()),
        "alpha_max_deg": float(f.true[:, AL].max() * DEG),
        "cautions": len(cautions),
        "aborted": i >= 0,
    }
    if c >= 0:
        out |= {"caution_s": float(f.t[c]), "caution_x_m": float(f.true[c, X])}
    if i >= 0:
        out |= {"abort_s": float(f.t[i]), "abort_x_m": float(f.true[i, X]), "abort_height_m": float(h[i])}
        out["by_hazard"] = bool((alert[min(i, len(alert) - 1)] & ABORT) > 0)
    return out
