"""Figures of the air-data estimators for `summary.json`: wake position against truth, fault detection by channel.

Position error: WAKE_POSITION.pos minus the true position in the tanker's air-path axes at the same sample time, valid
samples only; `available_pct` is their share. Telemetry carries 10 samples a second: an alarm shorter than that may be
missed here, while `exclusions` is the onboard count. Nothing is returned for a run without these messages.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.columns import Columns, Table, hold
from ground.views.airdata.read import PROBES, VARIABLES, true_position
from ground.views.refueling.aircraft import RECEIVER

Flat = dict[str, Any]
Mask = NDArray[np.bool_]
# name in the summary -> WKF_PHASE
PHASES = {"observation": 1, "to_precontact": 2, "precontact": 3, "closing": 4, "contact": 5, "disconnect": 6}
PHASES |= {"return": 7, "breakaway": 8}
LEGS = ("down", "lateral", "forward")
STILL_MPS = 0.01  # [m/s] commanded speed below which the leg before goes on
GAP_US = 1_000_000  # [us] a sample stands for at most this long


def position_stats(error: NDArray[np.float64], cov: NDArray[np.float64], valid: Mask, nis: NDArray) -> Flat:
    """Statistics of errors (n,2) y, z [m] with covariance (n,3) yy, yz, zz [m^2]; only rows with `valid` count, except
    in samples and available_pct. inside_2sigma_pct: inside the 2-sigma ellipse (86.5 % of a Gaussian)."""
    keys = [f"{k}.{a}" for k in ("rms_m", "p95_m") for a in ("y", "z", "radial")]
    keys += ["mean_m.y", "mean_m.z", "max_m.radial"]
    out: Flat = {"samples": len(valid), "available_pct": None, **dict.fromkeys(keys)}
    out |= {"inside_2sigma_pct": None, "nis_mean": None}
    if not len(valid):
        return out
    out["available_pct"] = float(100.0 * valid.mean())
    if not valid.any():
        return out
    e, (yy, yz, zz) = error[valid], cov[valid].T
    for axis, v in (("y", e[:, 0]), ("z", e[:, 1]), ("radial", np.hypot(e[:, 0], e[:, 1]))):
        out[f"rms_m.{axis}"] = float(np.sqrt(np.mean(v * v)))
        out[f"p95_m.{axis}"] = float(np.percentile(np.abs(v), 95))
        if axis != "radial":
            out[f"mean_m.{axis}"] = float(v.mean())
    out["max_m.radial"] = float(np.hypot(e[:, 0], e[:, 1]).max())
    det = yy * zz - yz * yz
    with np.errstate(divide="ignore", invalid="ignore"):
        d2 = (zz * e[:, 0] ** 2 - 2.0 * yz * e[:, 0] * e[:, 1] + yy * e[:, 1] ** 2) / det
    out["inside_2sigma_pct"] = float(100.0 * np.mean((det > 0.0) & (d2 <= 4.0)))
    out["nis_mean"] = float(nis[valid].mean(dtype=np.float64))
    return out


def legs(vel: NDArray[np.float64]) -> NDArray[np.int64]:
    """Leg (n,) of a commanded path by its velocity (n,3) [m/s, tanker body]: 0 down, 1 lateral, 2 forward (and up), the
    dominant axis deciding; while it stands still, the leg before goes on; -1 before the first."""
    size = np.abs(vel)
    out = np.where(size[:, 1] >= np.maximum(size[:, 0], size[:, 2]), 1, np.where(vel[:, 2] > size[:, 0], 0, 2))
    moving = size.max(axis=1) > STILL_MPS
    last = np.maximum.accumulate(np.where(moving, np.arange(len(vel)), -1)) if len(vel) else np.empty(0, dtype=np.int64)
    return np.where(last >= 0, out[last], -1)


def _phases(tlm: Columns, t_us: NDArray[np.int64]) -> dict[str, Mask]:
    """Which of the times belong to each phase, and to each leg on the way to pre-contact."""
    status, rel = tlm.get(RECEIVER, "MISSION_STATUS"), tlm.get(RECEIVER, "RELATIVE_STATE")
    phase = np.zeros(len(t_us)) if status is None else hold(t_us, status.t_us, status["phase"])
    out = {name: phase == number for name, number in PHASES.items()}
    on_way = out["to_precontact"]
    leg = np.full(len(t_us), -1)
    if rel is not None:
        before = hold(rel.t_us, status.t_us, status["phase"]) if status is not None else np.zeros(len(rel))
        part = rel.pick(before == PHASES["to_precontact"])  # the velocity before the first leg says nothing
        leg = hold(t_us, part.t_us, legs(part["cmd_vel"].astype(np.float64)), -1)
    return out | {f"to_precontact.{name}": on_way & (leg == i) for i, name in enumerate(LEGS)}


def position_metrics(truth: Columns, tlm: Columns) -> Flat:
    """airdata.position.* over the whole run, airdata.position.<phase>.* by phase and leg; {} without the message."""
    wake = tlm.get(RECEIVER, "WAKE_POSITION")
    if wake is None:
        return {}
    at = wake["time_usec"].astype(np.int64)
    known, true = true_position(truth).at(at)
    left_out = int((~known).sum())
    wake, at, true = wake.pick(known), at[known], true[known]
    error = wake["pos"].astype(np.float64)[:, 1:] - true[:, 1:]
    valid, cov = wake["valid"] != 0, wake["cov"].astype(np.float64)
    out = {f"airdata.position.{k}": v for k, v in position_stats(error, cov, valid, wake["nis"]).items()}
    out["airdata.position.left_out"] = left_out
    out["airdata.position.restarts"] = int(wake["restarts"].max()) if len(wake) else 0
    for name, use in _phases(tlm, at).items():
        stats = position_stats(error[use], cov[use], valid[use], wake["nis"][use])
        out |= {f"airdata.position.{name}.{k}": v for k, v in stats.items()}
    if not wake["nis_dof"].any():  # a method without innovations
        out |= {k: None for k in out if k.endswith(".nis_mean")}
    return out


def _seconds(table: Table, on: Mask) -> float:
    """How long [s] the rows marked `on` stand: each until the next row."""
    t = table.t_us
    step = np.minimum(np.diff(t, append=t[-1:]), GAP_US)
    return float(step[on].sum()) * 1e-6


def fdi_metrics(tlm: Columns) -> Flat:
    """airdata.fdi.*: alarms (onsets), time in alarm, exclusions (onboard count), time each channel was kept out; mean of
    the test statistic, 2 without a fault, and the threshold it is held against; {} without the message."""
    fdi = tlm.get(RECEIVER, "FDI_STATUS")
    if fdi is None:
        return {}
    alarm, excluded = fdi["alarm"].astype(np.int64), fdi["excluded"].astype(np.int64)
    out: Flat = {
        "airdata.fdi.samples": len(fdi),
        "airdata.fdi.valid_pct": float(100.0 * (fdi["valid"] != 0).mean()),
        "airdata.fdi.exclusions": int(fdi["exclusions"].max()),
        "airdata.fdi.threshold": float(fdi["threshold"][-1]),
    }
    checked = fdi["gamma"][fdi["valid"] != 0].astype(np.float64)
    for i, variable in enumerate(VARIABLES):
        out[f"airdata.fdi.gamma_mean.{variable}"] = float(checked[:, i].mean()) if len(checked) else None
    total = 0
    for i, variable in enumerate(VARIABLES):
        on = alarm >> i & 1 > 0
        onsets = int((np.diff(on.astype(np.int8), prepend=0) > 0).sum())
        total += onsets
        out[f"airdata.fdi.alarms.{variable}"] = onsets
        out[f"airdata.fdi.alarm_s.{variable}"] = _seconds(fdi, on)
        for j, probe in enumerate(PROBES):
            kept_out = excluded >> (3 * i + j) & 1 > 0
            out[f"airdata.fdi.excluded_s.{variable}.{probe}"] = _seconds(fdi, kept_out)
    out["airdata.fdi.alarms"] = total
    return out


def airdata_metrics(truth: Columns, tlm: Columns) -> Flat:
    """All figures of this module."""
    return position_metrics(truth, tlm) | fdi_metrics(tlm)
