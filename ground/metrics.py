"""Figures of a run for `summary.json`: truth against command and estimate, at the estimate's sample times.

Station keeping: true xi of the receiver minus the commanded one (RELATIVE_STATE.cmd_pos) while the mission measures.
Wind: NAV_STATE against the effective wind in TRUTH; receiver over the same time as station keeping, tanker from
`SETTLE_S` on. Magnitude error relative to the true magnitude, direction error in the horizontal plane.
Wake position and fault detection from air data, where the run has them: figures.py. A receiver that starts en route:
ground.views.joinup.figures. A tanker that meets one by TACAN: ground.views.rendezvous.read.
Whether published sigmas tell the truth, what navigation refused, fuel that ran dry: ground.consistency.
Keys are flat and dotted, SI unless the name ends in another unit; a figure without samples is None. `left_out`: samples for
which there is no truth near enough (ground.align).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.align import align, seconds
from ground.columns import Columns, Table, hold, load
from ground.consistency import consistency_metrics, fuel_metrics, refusal_metrics
from ground.folder import load_run
from ground.geometry import wrap
from ground.link.packets import AIRCRAFT, IDS, RECEIVER, TANKER
from ground.views.airdata.figures import airdata_metrics
from ground.views.gust.figures import gust_metrics
from ground.views.gust.read import has_gust
from ground.views.joinup.figures import join_metrics
from ground.views.rendezvous.read import rendezvous_metrics
from ground.views.windshear.figures import windshear_metrics
from ground.views.windshear.read import has_windshear
from ground.whole import log_figures

assert {"NAV_STATE", "RELATIVE_STATE", "MISSION_STATUS", "TRUTH"} <= set(IDS), "dialect lacks a message of the metrics"

SETTLE_S = 60.0  # [s] the tanker's wind figures start here
TURN_RATE = np.radians(0.2)  # [rad/s] commanded turn rate from which the tanker counts as turning
TELEMETRY_GAP_US = 250_000  # [us] estimates of two aircraft are brought together over this much
PHASE_TURN = 11  # WKF_PHASE
AXES = "xyz"
NED = "ned"
Flat = dict[str, Any]


def error_stats(error: NDArray[np.float64]) -> Flat:
    """error_rms_m.x .. error_max_m.z of errors (n,3) [m]; None without samples."""
    out: Flat = {}
    for i, axis in enumerate(AXES):
        e = np.abs(error[:, i])
        some = len(e) > 0
        out[f"error_rms_m.{axis}"] = float(np.sqrt(np.mean(e * e))) if some else None
        out[f"error_p95_m.{axis}"] = float(np.percentile(e, 95)) if some else None
        out[f"error_max_m.{axis}"] = float(e.max()) if some else None
    return out


def wind_stats(truth: NDArray[np.float64], hat: NDArray[np.float64], sigma: NDArray[np.float64]) -> Flat:
    """Errors of wind estimates (n,3) NED [m/s] with their 1-sigma, against truth. nees: mean square of error over its own sigma,
    about 1 for an estimate that knows its error, below for one that is better than it says; nees_over_3 of the three axes."""
    keys = ["magnitude_rms_pct", "direction_rms_deg", "inside_3sigma_pct", "nees_over_3"]
    keys += [f"{k}.{a}" for k in ("inside_3sigma_pct", "rms_mps", "nees") for a in NED]
    out: Flat = {"samples": len(truth), **dict.fromkeys(keys)}
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


def _measuring(tlm: Columns, t_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """True where the receiver's mission counts the sample (last MISSION_STATUS at or before)."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    if status is None:
        return np.zeros(len(t_us), dtype=bool)
    return hold(t_us, status.t_us, status["measure"]).astype(bool)


def _turning(tlm: Columns, t_us: NDArray[np.int64]) -> NDArray[np.bool_]:
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


def contact_metrics(truth: Columns, tlm: Columns) -> Flat:
    """contact.* : error statistics while measuring, all together, on straight legs and in turns; time measured."""
    all_us, error = contact_error(truth, tlm)
    counts = _measuring(tlm, all_us)
    t_us, error = all_us[counts], error[counts]
    turning = _turning(tlm, t_us)
    turns = counts & _turning(tlm, all_us)
    rel = tlm.get(RECEIVER, "RELATIVE_STATE")
    sent = 0 if rel is None else int(_measuring(tlm, rel.t_us).sum())
    out: Flat = {
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


def _wind_pairs(truth: Columns, tlm: Columns, sysid: int) -> tuple[Table, Table] | None:
    """(truth rows, NAV_STATE rows) of one aircraft at the times of the latter, estimates marked valid only."""
    nav, true = tlm.get(sysid, "NAV_STATE"), truth.get(sysid, "TRUTH")
    if nav is None or true is None:
        return None
    nav = nav.pick(nav["valid"] != 0)
    a = align(true.t_us, nav.t_us)
    return a.table(true), nav.pick(a.at)


def _left_out(tlm: Columns, sysid: int, used_us: NDArray[np.int64]) -> int:
    """Valid estimates of one aircraft that no truth was near enough to."""
    nav = tlm.get(sysid, "NAV_STATE")
    return 0 if nav is None else int((nav["valid"] != 0).sum()) - len(used_us)


def wind_metrics(truth: Columns, tlm: Columns) -> Flat:
    """wind.receiver.* (while measuring), wind.tanker.* (after SETTLE_S), and the downwash seen between them."""
    out: Flat = {}
    pairs = {}
    for sysid, name in AIRCRAFT.items():
        pair = _wind_pairs(truth, tlm, sysid)
        empty = np.empty((0, 3))
        if pair is None:
            out |= {f"wind.{name}.{k}": v for k, v in wind_stats(empty, empty, empty).items()}
            continue
        true, nav = pair
        use = true.t_us >= SETTLE_S * 1e6 if sysid == TANKER else _measuring(tlm, true.t_us)
        pairs[sysid] = pair
        stats = wind_stats(
            true["wind_n"][use].astype(np.float64),
            nav["wind"][use].astype(np.float64),
            nav["wind_sigma"][use].astype(np.float64),
        )
        out |= {f"wind.{name}.{k}": v for k, v in stats.items()}
        out[f"wind.{name}.left_out"] = _left_out(tlm, sysid, true.t_us)
    out["wind.receiver.downwash_mean_mps.truth"] = out["wind.receiver.downwash_mean_mps.estimate"] = None
    if len(pairs) == 2:
        (true_t, nav_t), (true_r, nav_r) = pairs[TANKER], pairs[RECEIVER]
        lead = align(true_t.t_us, true_r.t_us, TELEMETRY_GAP_US)  # the two send at their own times
        use = _measuring(tlm, true_r.t_us[lead.at])
        if use.any():
            true = (true_r["wind_n"][lead.at][:, 2] - lead.of(true_t["wind_n"])[:, 2])[use]
            hat = (nav_r["wind"][lead.at][:, 2] - lead.of(nav_t["wind"])[:, 2])[use]
            out["wind.receiver.downwash_mean_mps.truth"] = float(true.mean(dtype=np.float64))
            out["wind.receiver.downwash_mean_mps.estimate"] = float(hat.mean(dtype=np.float64))
    return out


def failure_metrics(run: Path) -> Flat:
    """plant.failures.accepted and .refused: MAV_CMD_INJECT_FAILURE in RUN/plant.tlog; {} where nobody sent any."""
    path = run / "plant.tlog"
    if not path.exists():
        return {}
    log = load(path)
    acks = [t for s in log.sysids() if (t := log.get(s, "COMMAND_ACK")) is not None]
    result = np.concatenate([t["result"] for t in acks]) if acks else np.empty(0)
    return {"plant.failures.accepted": int((result == 0).sum()), "plant.failures.refused": int((result != 0).sum())}


def loop_metrics(tlm: Columns) -> Flat:
    """loop.slips (all aircraft, last report of each) and link.dropped (telemetry packets missing by sequence)."""
    slips = 0
    for sysid in tlm.sysids():
        timing = tlm.get(sysid, "LOOP_TIMING")
        if timing is not None and len(timing):
            slips += int(timing["slips"][-1])
    return {"loop.slips": slips, "link.dropped": sum(tlm.dropped.values())}


def compute(run: Path, truth: Columns | None = None, tlm: Columns | None = None) -> Flat:
    """All metrics of a run folder. Raises LogError if it is none or a log is no log, ValueError if meta.json is broken."""
    if truth is None or tlm is None:
        truth, tlm = load_run(run)
    out = log_figures(run, truth, tlm)
    if has_gust(tlm):  # nobody refuels
        return out | gust_metrics(run, truth, tlm) | loop_metrics(tlm) | failure_metrics(run)
    if has_windshear(tlm):
        return out | windshear_metrics(run, truth, tlm) | loop_metrics(tlm) | failure_metrics(run)
    out |= contact_metrics(truth, tlm) | wind_metrics(truth, tlm) | loop_metrics(tlm)
    out |= consistency_metrics(truth, tlm) | refusal_metrics(tlm) | fuel_metrics(run, truth)
    return (
        out
        | airdata_metrics(truth, tlm)
        | join_metrics(truth, tlm)
        | rendezvous_metrics(run, truth, tlm)
        | failure_metrics(run)
    )
