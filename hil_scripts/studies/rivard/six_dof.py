"""Rivard (1982) with the full aircraft: the onboard mission flying the six-degree-of-freedom tanker against kinematic figures.

Per run: "six" the scenario `rendezvous` over the real plant link in process; "kin" its kinematic twin (equal
receiver and range errors, point tanker); "mc" a batch of the kinematic Monte Carlo of the same setting, drawn on its own. The
misses have heavy tails (the bank limit), so that few runs say little about an RMS, but much about the difference of twins. y
is receiver minus tanker.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hil_scripts.campaign.consistency import rms_interval
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.rivard import kernel as rk
from hil_scripts.studies.rivard.cases import case as setting
from hil_scripts.studies.rivard.mc import run_case as run_kinematic
from hil_scripts.studies.rivard.six_dof_flight import SAMPLE_S, Meeting, fly, fly_twin, plan_of

LONG = "plant.meta.duration_s=700.0"  # a flight ends when the tanker is ahead of the receiver
PAIR = ("six", "kin")
MC_RUNS = 400  # per run
SEED_LAW = (
    "tanker.rendezvous.track.estimator.estimator=ekf3", "tanker.rendezvous.pilot.guidance.law=closed_loop",
    "tanker.rendezvous.pilot.guidance.steer=false", "tanker.rendezvous.pilot.guidance.trim_mps=0.0",
    "tanker.rendezvous.pilot.guidance.lead_s=0.0", "tanker.rendezvous.pilot.guidance.bank_min_deg=0.3",
    "tanker.rendezvous.pilot.guidance.offset_bank_deg=0.0", "tanker.rendezvous.pilot.guidance.meeting.on=false",
    "tanker.rendezvous.track.estimator.gate_nis=0.0", "tanker.rendezvous.track.estimator.window_nis=3.75",
    "tanker.rendezvous.track.estimator.window_drift=10.83", "tanker.rendezvous.track.estimator.rules.believed=0",
    "tanker.rendezvous.track.estimator.rules.repeat_m=0.0", "tanker.rendezvous.track.estimator.rules.young_z=0.0",
    "tanker.rendezvous.track.estimator.aids.on=false",
    "tanker.rendezvous.track.estimator.rules.open=false", "tanker.rendezvous.track.estimator.rules.open_back=0",
    "tanker.rendezvous.track.estimator.rules.open_turn_deg=0.0", "tanker.rendezvous.track.estimator.rules.open_speed_mps=0.0",
)  # fmt: skip


def run_case(case: Case, seed: int) -> RunResult:
    """One rendezvous of each kind."""
    plan = plan_of((LONG, *case.params.get("sets", ())), seed)
    six, kin = fly(plan), fly_twin(plan)
    values = six.values("six") | kin.values("kin")
    m = run_kinematic(
        setting(case.params["mc"]).but(**case.params.get("but", {})), MC_RUNS, seed % 2**31, 1, samples=False
    )
    done = m.rows[:, rk.R_DONE] > 0.0
    values["mc.n"], values["mc.done"] = float(MC_RUNS), float(done.sum())
    for axis, at in (("x", rk.R_XM), ("y", rk.R_YM)):
        v = m.rows[done, at]
        values[f"mc.{axis}.square_m2"], values[f"mc.{axis}.mean_m"] = float(np.mean(v * v)), float(v.mean())
    return RunResult(values, traces(six, kin))


def traces(six: Meeting, kin: Meeting) -> dict[str, Any]:
    """Tracks [N,7] for a picture: t, tanker x y, receiver x y, estimate x y."""
    return {"six.track": np.array(six.track), "kin.track": np.array(kin.track)}


def pool(rows: Sequence[Mapping[str, float]]) -> dict[str, float | int | None]:
    """Figures of a case: RMS with 95 % interval of each kind, RMS of the paired difference, ratio of RMS six over kin and mc."""
    out: dict[str, float | int | None] = {"n": len(rows)}
    col = {k: np.array([r.get(k, math.nan) for r in rows]) for k in sorted({k for r in rows for k in r})}
    for name in PAIR:
        out[f"{name}.unfinished"] = int(np.sum(col[f"{name}.done"] < 0.5))
        for axis in "xy":
            v = col[f"{name}.{axis}_m"]
            v = v[np.isfinite(v)]
            if len(v) > 1:
                rms, lo, hi = rms_interval(v)
                out[f"{name}.{axis}.rms_m"], out[f"{name}.{axis}.rms_lo_m"], out[f"{name}.{axis}.rms_hi_m"] = (
                    rms,
                    lo,
                    hi,
                )
                out[f"{name}.{axis}.mean_m"], out[f"{name}.{axis}.max_m"] = float(v.mean()), float(np.abs(v).max())
        for key in ("turn_s", "end_s", "speed_mps"):
            v = col.get(f"{name}.{key}", np.full(1, math.nan))
            if np.isfinite(v).any():
                out[f"{name}.{key}.mean"] = float(np.nanmean(v))
        if f"{name}.alarm_s" in col:
            out[f"{name}.alarms"] = int(np.isfinite(col[f"{name}.alarm_s"]).sum())
        for t in SAMPLE_S:
            v = col.get(f"{name}.nees3.t{t:.0f}", np.full(1, math.nan))
            if np.isfinite(v).any():
                out[f"{name}.nees3.t{t:.0f}"] = float(np.nanmean(v))
    out["mc.n"], out["mc.unfinished"] = int(col["mc.n"].sum()), int((col["mc.n"] - col["mc.done"]).sum())
    for axis in "xy":
        w = col["mc.done"] / col["mc.done"].sum()
        out[f"mc.{axis}.rms_m"] = math.sqrt(float(w @ col[f"mc.{axis}.square_m2"]))
        out[f"mc.{axis}.mean_m"] = float(w @ col[f"mc.{axis}.mean_m"])
    for axis in "xy":
        d = col[f"six.{axis}_m"] - col[f"kin.{axis}_m"]
        d = d[np.isfinite(d)]
        if len(d):
            out[f"difference.{axis}.rms_m"], out[f"difference.{axis}.mean_m"] = (
                float(np.sqrt(np.mean(d * d))),
                float(d.mean()),
            )
        six = out.get(f"six.{axis}.rms_m")
        for other in ("kin", "mc"):
            base = out.get(f"{other}.{axis}.rms_m")
            if six and base:
                out[f"ratio.{other}.{axis}"] = six / base
    return out


ROLL = {"truth_roll_rate_degps": 5.0, "guid_roll_rate_degps": 5.0}
STUDY = Study(
    name="rivard_6dof",
    title="Rendezvous, full aircraft against kinematic",
    purpose="the mission rendezvous flying the 6-DOF tanker: miss at roll-out against the kinematic Monte Carlo",
    cases=(
        Case("product", {"mc": "b7re", "but": {"guid_lead_s": -4.0}}),
        Case("seed", {"mc": "k3_a", "but": ROLL, "sets": list(SEED_LAW)}),
    ),
    run=run_case,
    default_runs=100,
    pool=pool,
)
