"""Figures of refuelling: station keeping of the receiver, the downwash it feels, the relative estimate.

Station keeping: true xi of the receiver minus the commanded one (RELATIVE_STATE.cmd_pos) while the mission measures. Errors of
the receiver's estimates count over the same time. What a run of the two lacks is None. `left_out`: samples for which there is no
truth near enough (ground.align).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import VALUES
from ground.align import align, seconds
from ground.columns import Columns, hold
from ground.consistency import AXES_NEES, nees, pairs
from ground.geometry import quat_conj, quat_euler, quat_mul, wrap
from ground.run import Run
from ground.views.base import Figures, Mask
from ground.views.refueling.aircraft import NAMES, RECEIVER, TANKER
from ground.wind import EMPTY, wind_pairs, wind_stats

TURN_RATE = np.radians(0.2)  # [rad/s] commanded turn rate from which the tanker counts as turning
TELEMETRY_GAP_US = 250_000  # [us] estimates of two aircraft are brought together over this much
PHASE_TURN = VALUES["WKF_PHASE_TURN"]
AXES = "xyz"


def error_stats(error: NDArray[np.float64]) -> Figures:
    """error_rms_m.x .. error_max_m.z of errors (n,3) [m]; None without samples."""
    out: Figures = {}
    for i, axis in enumerate(AXES):
        e = np.abs(error[:, i])
        some = len(e) > 0
        out[f"error_rms_m.{axis}"] = float(np.sqrt(np.mean(e * e))) if some else None
        out[f"error_p95_m.{axis}"] = float(np.percentile(e, 95)) if some else None
        out[f"error_max_m.{axis}"] = float(e.max()) if some else None
    return out


def measuring(tlm: Columns, t_us: NDArray[np.int64]) -> Mask:
    """True where the receiver's mission counts the sample (last MISSION_STATUS at or before)."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    if status is None:
        return np.zeros(len(t_us), dtype=bool)
    return hold(t_us, status.t_us, status["measure"]).astype(bool)


def _turning(tlm: Columns, t_us: NDArray[np.int64]) -> Mask:
    """True where the tanker is in its turn: phase TURN or a commanded turn rate above TURN_RATE."""
    status = tlm.get(TANKER, "MISSION_STATUS")
    if status is None:
        return np.zeros(len(t_us), dtype=bool)
    turn = (np.abs(status["cmd_psi_dot"]) > TURN_RATE) | (status["phase"] == PHASE_TURN)
    return hold(t_us, status.t_us, turn.astype(np.uint8)).astype(bool)


def contact_error(truth: Columns, tlm: Columns) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(t_us, error (n,3) [m]) of station keeping over the whole run: true xi minus commanded xi, tanker body axes."""
    rel, true = tlm.get(RECEIVER, "RELATIVE_STATE"), truth.get(RECEIVER, "TRUTH")
    if rel is None or true is None:
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    a = align(true.t_us, rel.t_us)
    return rel.t_us[a.at], a.of(true["xi"]) - rel["cmd_pos"][a.at].astype(np.float64)


def contact_metrics(truth: Columns, tlm: Columns) -> Figures:
    """contact.* : error statistics while measuring, all together, on straight legs and in turns; time measured."""
    all_us, error = contact_error(truth, tlm)
    counts = measuring(tlm, all_us)
    t_us, error = all_us[counts], error[counts]
    turning = _turning(tlm, t_us)
    turns = counts & _turning(tlm, all_us)
    rel = tlm.get(RECEIVER, "RELATIVE_STATE")
    sent = 0 if rel is None else int(measuring(tlm, rel.t_us).sum())
    out: Figures = {
        "contact.samples": len(t_us),
        "contact.left_out": sent - len(t_us),
        "contact.time_s": seconds(all_us, counts),
    }
    for name, part in (("", slice(None)), ("straight.", ~turning), ("turn.", turning)):
        out |= {f"contact.{name}{k}": v for k, v in error_stats(error[part]).items()}
    out["contact.straight.time_s"] = seconds(all_us, counts & ~turns)
    out["contact.turn.time_s"] = seconds(all_us, turns)
    true = truth.get(RECEIVER, "TRUTH")
    inside = None if true is None else hold(t_us, true.t_us, true["inside"]).astype(bool)
    out["contact.inside_envelope_pct"] = float(100.0 * inside.mean()) if inside is not None and len(inside) else None
    return out


def downwash(run: Run) -> Figures:
    """wind.receiver.downwash_mean_mps.*: down wind at the receiver less the tanker's while measuring, truth and estimate."""
    key = "wind.receiver.downwash_mean_mps"
    out: Figures = {f"{key}.truth": None, f"{key}.estimate": None}
    first, second = wind_pairs(run, TANKER), wind_pairs(run, RECEIVER)
    if first is None or second is None:
        return out
    (true_t, nav_t), (true_r, nav_r) = first, second
    lead = align(true_t.t_us, true_r.t_us, TELEMETRY_GAP_US)  # the two send at their own times
    use = measuring(run.tlm, true_r.t_us[lead.at])
    if use.any():
        true = (true_r["wind_n"][lead.at][:, 2] - lead.of(true_t["wind_n"])[:, 2])[use]
        hat = (nav_r["wind"][lead.at][:, 2] - lead.of(nav_t["wind"])[:, 2])[use]
        out[f"{key}.truth"] = float(true.mean(dtype=np.float64))
        out[f"{key}.estimate"] = float(hat.mean(dtype=np.float64))
    return out


def relative(run: Run) -> Figures:
    """nees.relative.position and attitude: whether the relative estimate's published sigmas tell the truth."""
    out: Figures = dict.fromkeys(("nees.relative.position", "nees.relative.attitude"))
    rel, lead = pairs(run.truth, run.tlm, RECEIVER, "RELATIVE_STATE"), run.truth.get(TANKER, "TRUTH")
    if rel is None or lead is None:
        return out
    true, hat = rel
    out["nees.relative.position"] = nees(hat["pos"].astype(np.float64) - true["xi"], hat["sigma"])
    a = align(lead.t_us, true.t_us)
    euler = quat_euler(quat_mul(quat_conj(a.quaternions(lead["q_nb"])), true["q_nb"][a.at]))
    out["nees.relative.attitude"] = nees(wrap(hat["euler"][a.at].astype(np.float64) - euler), hat["euler_sigma"][a.at])
    return out


def missing(run: Run) -> Figures:
    """None for the common figures of an aircraft of the two that the run does not hold."""
    out: Figures = {}
    for sysid, name in NAMES.items():
        if wind_pairs(run, sysid) is None:
            out |= {f"wind.{name}.{k}": v for k, v in wind_stats(EMPTY, EMPTY, EMPTY).items()}
        if run.tlm.get(sysid, "NAV_STATE") is None:
            out |= {f"nees.{name}.{k}": None for k in AXES_NEES}
    return out
