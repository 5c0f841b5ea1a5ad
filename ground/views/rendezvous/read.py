"""The rendezvous in a run: geometry of its frame, the moment of roll-out, figures for `summary.json`.

Frame of RENDEZVOUS_STATE: x from the control point to the initial point, y 90 deg counter-clockwise seen from above.
Misses at roll-out (true bank below 2 deg after the turn), from the truth of both aircraft: x_m = x - separation - x_tanker
(positive: tanker too far ahead), y_m = y - y_tanker. NEES is that of (x, v_x, y), over 3: 1 for a filter that knows itself.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.align import align
from ground.columns import Columns, Table, hold
from ground.geometry import quat_euler
from ground.views.refueling.aircraft import RECEIVER, TANKER

Array = NDArray[np.float64]
Flat = dict[str, Any]
ROLLOUT, LEG = 15, 10  # WKF_PHASE
TURN = 1  # WKF_RDV_PHASE
LEVEL = np.radians(2.0)
SEPARATION_M = 2.0 * 1852.0
UPPER = np.triu_indices(4)


def has_rendezvous(tlm: Columns) -> bool:
    """True if the tanker sent RENDEZVOUS_STATE."""
    return tlm.get(TANKER, "RENDEZVOUS_STATE") is not None


def separation(run: Path) -> float:
    """Distance [m] the tanker was told to roll out ahead: from RUN/flight_tanker.toml, else 2 NM."""
    try:
        guid = tomllib.loads((run / "flight_tanker.toml").read_text())["rendezvous"]["pilot"]["guidance"]
        return float(guid["separation_m"])
    except (OSError, ValueError, KeyError, TypeError):
        return SEPARATION_M


def to_r(frame: Array, north: Array, east: Array) -> Array:
    """(x, y) (n,2) of horizontal vectors; frame (3,): only its direction [2] is used. Subtract the origin before."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.stack([c * north + s * east, s * north - c * east], axis=-1)


def to_plan(frame: Array, x: Array, y: Array) -> Array:
    """(east, -north) (..., 2) [m] of points in the rendezvous frame: north up where a view's y points down."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.stack([frame[1] + s * x - c * y, -(frame[0] + c * x + s * y)], axis=-1)


def frame_of(state: Table) -> Array:
    """Frame (3,) [m, m, rad] of a run."""
    return state["frame"][-1].astype(np.float64)


def covariances(rows: NDArray[np.float32]) -> Array:
    """(n,4,4) of upper triangles (n,10)."""
    P = np.zeros((len(rows), 4, 4))
    P[:, UPPER[0], UPPER[1]] = rows
    P[:, UPPER[1], UPPER[0]] = rows
    return P


def rollout_us(truth: Columns, tlm: Columns) -> int | None:
    """Time [us] the tanker is level after the turn; None if it never is."""
    status, true = tlm.get(TANKER, "MISSION_STATUS"), truth.get(TANKER, "TRUTH")
    if status is None or true is None:
        return None
    rolling = np.flatnonzero(status["phase"] == ROLLOUT)
    if not len(rolling):
        return None
    after = np.flatnonzero(true.t_us >= status.t_us[rolling[0]])
    bank = quat_euler(true["q_nb"][after])[:, 2]
    level = after[np.abs(bank) < LEVEL]
    return int(true.t_us[level[0]]) if len(level) else None


def errors(truth: Columns, state: Table) -> tuple[NDArray[np.int64], Array, Array]:
    """(t_us (n,), estimate minus truth (n,4) of x, v_x, y, v_y, covariance (n,4,4)) while the estimate is valid."""
    true = truth.get(RECEIVER, "TRUTH")
    s = state.pick(state["valid"] != 0)
    if true is None or not len(s):
        return np.empty(0, dtype=np.int64), np.empty((0, 4)), np.empty((0, 4, 4))
    a = align(true.t_us, s.t_us)
    f, pos, vel = frame_of(state), a.of(true["pos_n"]), a.of(true["vel_n"])
    at = to_r(f, pos[:, 0] - f[0], pos[:, 1] - f[1])
    v = to_r(f, vel[:, 0], vel[:, 1])
    want = np.stack([at[:, 0], v[:, 0], at[:, 1], v[:, 1]], axis=1)
    return s.t_us[a.at], s["est"][a.at].astype(np.float64) - want, covariances(s["cov"][a.at])


def nees3(error: Array, cov: Array) -> Array:
    """NEES/3 (n,) of (x, v_x, y); rows whose covariance is singular are NaN."""
    P, e = cov[:, :3, :3], error[:, :3]
    ok = np.linalg.det(P) > 0.0
    out = np.full(len(e), np.nan)
    if ok.any():
        out[ok] = np.einsum("ni,ni->n", e[ok], np.linalg.solve(P[ok], e[ok][:, :, None])[:, :, 0]) / 3.0
    return out


def rendezvous_metrics(run: Path, truth: Columns, tlm: Columns) -> Flat:
    """rendezvous.*; {} for a run without one."""
    state = tlm.get(TANKER, "RENDEZVOUS_STATE")
    if state is None:
        return {}
    out: Flat = dict.fromkeys(
        (f"rendezvous.{k}" for k in ("x_m", "y_m", "turn_s", "rollout_s", "closing_mps", "alarm_s", "nees3_mean")), None
    )
    own, other = truth.get(TANKER, "TRUTH"), truth.get(RECEIVER, "TRUTH")
    end = rollout_us(truth, tlm)
    out["rendezvous.done"] = int(end is not None)
    turning = state.t_us[state["phase"] == TURN]
    if len(turning):
        out["rendezvous.turn_s"] = float(turning[0]) * 1e-6
    if end is not None and own is not None and other is not None and end in other.t_us:
        f = frame_of(state)
        i, j = int(np.searchsorted(own.t_us, end)), int(np.searchsorted(other.t_us, end))
        d = to_r(f, *(other["pos_n"][j, k] - own["pos_n"][i, k] for k in (0, 1)))
        v = to_r(f, *(other["vel_n"][j, k] - own["vel_n"][i, k] for k in (0, 1)))
        out["rendezvous.rollout_s"] = end * 1e-6
        out["rendezvous.x_m"], out["rendezvous.y_m"] = float(d[0] - separation(run)), float(d[1])
        out["rendezvous.closing_mps"] = float(-v[0])
    t, e, P = errors(truth, state)
    out["rendezvous.left_out"] = int((state["valid"] != 0).sum()) - len(t)
    before = t <= (end if end is not None else t[-1] if len(t) else 0)
    if before.any():
        q = nees3(e[before], P[before])
        out["rendezvous.nees3_mean"] = float(np.nanmean(q))
        for k, axis in ((0, "x"), (2, "y")):
            out[f"rendezvous.error_m.{axis}"] = float(e[before][-1, k])
            out[f"rendezvous.sigma_m.{axis}"] = float(np.sqrt(P[before][-1, k, k]))
    alarm = state.t_us[state["alarm"] != 0]
    out["rendezvous.alarms"] = int((np.diff(state["alarm"].astype(np.int8), prepend=0) > 0).sum())
    if len(alarm):
        out["rendezvous.alarm_s"] = float(alarm[0]) * 1e-6
    out["rendezvous.ranges"], out["rendezvous.refused"] = int(state["updates"][-1]), int(state["refused"][-1])
    if own is not None:
        part = own.t_us <= (end if end is not None else own.t_us[-1])
        bank = quat_euler(own["q_nb"][part])[:, 2]
        out["rendezvous.bank_max_deg"] = float(np.degrees(np.abs(bank).max()))
        height = hold(own.t_us[part], own.t_us[:1], own["pos_n"][:1, 2]) - own["pos_n"][part, 2]
        out["rendezvous.height_error_max_m"] = float(np.abs(height).max())
    return out
