"""Figures of a receiver that starts en route: when each phase was reached, the join-up against truth, fuel of both aircraft.

Only for runs in which the receiver's mission has been en route. Fuel is the change of true mass: before contact that is what
an aircraft burned itself; in contact the two are told apart by their sum only.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from ground.columns import Columns, Table, hold, match
from ground.views.refueling.aircraft import NAMES, RECEIVER, TANKER

ENROUTE, JOIN_UP, OBSERVATION, CONTACT, LEG = 20, 21, 1, 5, 10  # WKF_PHASE
WAKE_OF = "kc135r"
HALF_WAY_M = 200.0
Flat = dict[str, Any]


def wake_clearance(xi: NDArray[np.float64], alpha: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance [m] (n,) of xi (n,3), tanker body axes, from the nearer vortex core of the wing.

    Cores leave the wing at +-pi/8 of the span and follow the free stream: (-cos alpha, 0, -sin alpha) in body axes.
    """
    ac = load_aircraft(WAKE_OF)
    back = np.stack([-np.cos(alpha), np.zeros_like(alpha), -np.sin(alpha)], axis=1)
    out = np.full(len(xi), np.inf)
    for side in (-1.0, 1.0):
        root = np.array([ac.wake.wing_ac_m[0], side * math.pi / 8.0 * ac.geometry.b_m, ac.wake.wing_ac_m[2]])
        d = xi - root
        along = np.maximum((d * back).sum(axis=1), 0.0)
        out = np.minimum(out, np.linalg.norm(d - along[:, None] * back, axis=1))
    return out


def first_us(status: Table, phase: int, after_us: int = -1) -> int | None:
    """Time [us] at which a phase was first reported after `after_us`; None: never."""
    at = status.t_us[(status["phase"] == phase) & (status.t_us > after_us)]
    return int(at[0]) if len(at) else None


def has_joinup(tlm: Columns) -> bool:
    """True if the receiver's mission began en route."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    return status is not None and first_us(status, ENROUTE) is not None


def half_way_s(truth: Columns, tlm: Columns) -> float | None:
    """Time [s] of the join-up at which the receiver is HALF_WAY_M behind the tanker; None without one that comes so far."""
    status, true = tlm.get(RECEIVER, "MISSION_STATUS"), truth.get(RECEIVER, "TRUTH")
    if status is None or true is None:
        return None
    joining = hold(true.t_us, status.t_us, status["phase"]) == JOIN_UP
    there = true.t_us[joining & (true["xi"][:, 0] > -HALF_WAY_M)]
    return float(there[0]) * 1e-6 if len(there) else None


def join_metrics(truth: Columns, tlm: Columns) -> Flat:
    """join.* and fuel.*; {} where the receiver was never en route."""
    status, true = tlm.get(RECEIVER, "MISSION_STATUS"), truth.get(RECEIVER, "TRUTH")
    lead, lead_true = tlm.get(TANKER, "MISSION_STATUS"), truth.get(TANKER, "TRUTH")
    if status is None or true is None or lead_true is None or first_us(status, ENROUTE) is None:
        return {}
    start = first_us(status, JOIN_UP)
    station, contact = first_us(status, OBSERVATION), first_us(status, CONTACT)
    boom = true.t_us[true["contact"] != 0]
    latched = int(boom[0]) if len(boom) else None
    rolled_out = first_us(lead, LEG) if lead is not None else None
    marks = {"rollout": rolled_out, "joinup": start, "station": station, "boom": latched, "contact": contact}
    out: Flat = {f"join.{k}_at_s": None if v is None else v * 1e-6 for k, v in marks.items()}
    out |= _approach(truth, status, start, station)
    return out | _fuel(truth, marks)


def _approach(truth: Columns, status: Table, start: int | None, station: int | None) -> Flat:
    """The join-up as flown: distance at its start, closure, clearance of the wake, how far forward it went."""
    keys = ("start_m", "start_lateral_m", "closure_max_mps", "wake_clearance_min_m", "forward_max_m", "duration_s")
    out: Flat = dict.fromkeys(f"join.{k}" for k in keys)
    if start is None:
        return out
    true, lead = truth.tables[RECEIVER, "TRUTH"], truth.tables[TANKER, "TRUTH"]
    i, j = match(true.t_us, lead.t_us)
    true, lead = true.pick(i), lead.pick(j)
    flown = hold(true.t_us, status.t_us, status["phase"]) == JOIN_UP
    xi = true["xi"][flown].astype(np.float64)
    if not len(xi):
        return out
    distance = np.linalg.norm(xi, axis=1)
    closing = -np.diff(distance) / (np.diff(true.t_us[flown]) * 1e-6)
    out["join.start_m"], out["join.start_lateral_m"] = float(distance[0]), float(xi[0, 1])
    out["join.closure_max_mps"] = float(closing.max())
    out["join.wake_clearance_min_m"] = float(wake_clearance(xi, lead["alpha"][flown].astype(np.float64)).min())
    out["join.forward_max_m"] = float(xi[:, 0].max())
    out["join.duration_s"] = None if station is None else (station - start) * 1e-6
    return out


def _fuel(truth: Columns, marks: dict[str, int | None]) -> Flat:
    """fuel.<aircraft>.burned_to_<mark>_kg up to the boom; fuel.burned_kg of both together over the run."""
    out: Flat = {}
    total = 0.0
    for sysid, name in NAMES.items():
        t = truth.tables[sysid, "TRUTH"]
        mass = t["mass"].astype(np.float64)
        for mark in ("joinup", "station", "boom"):
            at = marks[mark]
            used = None if at is None else float(mass[0] - mass[np.searchsorted(t.t_us, at)])
            out[f"fuel.{name}.burned_to_{mark}_kg"] = used
        total += float(mass[0] - mass[-1])
    out["fuel.burned_kg"] = total
    r = truth.tables[RECEIVER, "TRUTH"]
    change = np.diff(r["mass"].astype(np.float64))
    out["fuel.receiver.gained_in_contact_kg"] = float(change[r["contact"][1:] != 0].sum())
    return out
