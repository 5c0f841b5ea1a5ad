"""Sevil (2013): position along the way from observation to contact (sevil.md 8.3), and with a wake that is not the modelled
one (8.5). Kinematic flights: the plant's wake makes the readings, the onboard model is never told what was changed in it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil import static as st
from hil_scripts.studies.sevil import track as tk
from hil_scripts.studies.sevil.flight import Conditions, PlantWake, fly_air

CALM: dict[str, Any] = {
    "turbulence_mps": 0.0, "wind_mps": (0.0, 0.0, 0.0), "att_bias_deg": 0.0, "att_noise_deg": 0.0, "x_sigma_m": 0.0,
}  # fmt: skip


def plant_wake(changes: dict[str, Any]) -> PlantWake:
    """The plant's wake with entries of PlantWake changed; `wing_z_m`, `tail_z_m`, `tail_x_m` are added to the positions."""
    w, more = PlantWake(), dict(changes)
    wing, tail = list(w.wing_m), list(w.tail_m)
    wing[2] += float(more.pop("wing_z_m", 0.0))
    tail[2] += float(more.pop("tail_z_m", 0.0))
    tail[0] += float(more.pop("tail_x_m", 0.0))
    factor = float(more.pop("mass_factor", 1.0))
    cores = float(more.pop("core_factor", 1.0))
    return replace(
        w, mass_kg=w.mass_kg * factor, wing_m=(wing[0], wing[1], wing[2]), tail_m=(tail[0], tail[1], tail[2]),
        core_wing_m=w.core_wing_m * cores, core_tail_m=w.core_tail_m * cores, **more,
    )  # fmt: skip


def run_dynamic(case: Case, seed: int) -> RunResult:
    """Algorithms 11 and 15, differential maximum likelihood and the filters on one flight."""
    p = case.params
    c = Conditions(**{"guess_sigma_m": float(p.get("guess_m", 5.0)), **(CALM if p.get("calm") else {})})
    f = fly_air(c, seed)
    values: dict[str, float] = {}
    traces: dict[str, Any] = {"t": f.t[::4], "true": f.xi[::4, 1:], "leg": f.leg[::4]}
    for a in p.get("algorithms", [11, 15]):
        at, pos = tk.contour_track(f, a)
        values |= tk.leg_figures(f, at, pos, f"A{a}")
        traces |= {"second": f.t[at], f"A{a}.position": pos}
    if p.get("ml", True):
        at, pos = tk.ml_track(f)
        values |= tk.leg_figures(f, at, pos, "ml")
        traces |= {"second": f.t[at], "ml.position": pos}
    sigma = max(c.guess_sigma_m, 1.0)
    for name in p.get("filters", ["fixed", "augmented", "height"]):
        guess = None if p.get("self_start") else (float(f.guess[0]), float(f.guess[1]), sigma)
        tr = tk.track(f, name, guess=guess)
        values |= tk.filter_figures(f, tr, name)
        traces |= {f"{name}.position": tr.pos[::4], f"{name}.sigma": tr.sigma[::4]}
    return RunResult(values, traces)


def run_mismatch(case: Case, seed: int) -> RunResult:
    """The filters in a wake other than the one they believe in, and the static error of such a wake without any noise."""
    p = case.params
    wake = plant_wake(dict(p.get("wake", {})))
    c = Conditions(wake=wake, x_sigma_m=float(p.get("x_sigma_m", 1.0)))
    f = fly_air(c, seed)
    if "x_error_m" in p:
        f = replace(f, x_m=f.xi[:, 0] + float(p["x_error_m"]))
    if "roll_deg" in p:
        f = replace(f, att_m=f.att_m - np.array([0.0, 0.0, math.radians(float(p["roll_deg"]))]))
    values: dict[str, float] = {}
    traces: dict[str, Any] = {"t": f.t[::4], "true": f.xi[::4, 1:]}
    for name in p.get("filters", ["fixed", "augmented", "height"]):
        tr = tk.track(f, name, guess=(float(f.guess[0]), float(f.guess[1]), 5.0))
        values |= tk.filter_figures(f, tr, name)
        traces |= {f"{name}.position": tr.pos[::4], f"{name}.sigma": tr.sigma[::4]}
    points = st.points_of("small", False, seed)
    ml = st.estimators({"noise": 1.0})["diff"]
    readings = st.disturbed(points, {}, seed, wake)
    found = [ml.locate(y, st.FRAME, 20) for y in readings]
    est = np.array([(math.nan, math.nan) if x is None else x.pos for x in found])
    values |= {f"static.{k}": v for k, v in st.figures(points, est).items() if k in ("rms_m", "median_m", "worst_m")}
    # what the tail and the wing really carry relative to the model, for the learnt scales
    nominal = PlantWake()
    lift = wake.mass_kg * (1.0 + wake.tail_download_frac) / (nominal.mass_kg * (1.0 + nominal.tail_download_frac))
    down = wake.mass_kg * wake.tail_download_frac / (nominal.mass_kg * nominal.tail_download_frac)
    return RunResult(values | {"true.scale_wing": lift, "true.scale_tail": down}, traces)


def _dyn(**more: Any) -> dict[str, Any]:
    return {"kind": "dynamic", **more}


def _mis(wake: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {"kind": "mismatch", "wake": wake or {}, **more}


TABLE_DYNAMIC = (Case("dynamic_all", _dyn()),)
TABLE_MISMATCH = (
    Case("mismatch_weight_-10", _mis({"mass_factor": 0.9})),
    Case("mismatch_tail_0.03", _mis({"tail_download_frac": 0.03})),
    Case("mismatch_wing_z_0.5", _mis({"wing_z_m": 0.5})),
)
_FILTERS = {"algorithms": [], "ml": False, "filters": ["height"]}
DYNAMIC = Study(
    name="sevil_dynamic",
    title="Position from observation to contact",
    purpose="contour algorithms, maximum likelihood and filters along the approach; first guesses off by 5, 10, 20 m; own start",
    cases=(
        Case("all", _dyn()),
        Case("calm", _dyn(calm=True)),
        *(Case(f"guess_{g}", _dyn(guess_m=float(g), **_FILTERS)) for g in (5, 10, 20)),
        Case("self_start", _dyn(self_start=True, **_FILTERS)),
    ),
    run=run_dynamic,
    default_runs=8,
)
MISMATCH = Study(
    name="sevil_mismatch",
    title="Wake unlike the model",
    purpose="contact error of the filter with circulations frozen, estimated, and with the vortices' height as a third unknown",
    cases=(
        Case("none", _mis()),
        Case("weight_+5", _mis({"mass_factor": 1.05})),
        Case("weight_-10", _mis({"mass_factor": 0.9})),
        *(Case(f"tail_{d:g}", _mis({"tail_download_frac": d})) for d in (0.045, 0.03, 0.0)),
        Case("wing_z_+0.5", _mis({"wing_z_m": 0.5})),
        Case("tail_z_+0.5", _mis({"tail_z_m": 0.5})),
        Case("wake_z_+0.5", _mis({"wing_z_m": 0.5, "tail_z_m": 0.5})),
        Case("cores_x2", _mis({"core_factor": 2.0})),
        Case("tail_x_-2", _mis({"tail_x_m": -2.0})),
        Case("x_error_3", _mis(x_error_m=3.0)),
        Case("roll_0.5", _mis(roll_deg=0.5)),
    ),
    run=run_mismatch,
    default_runs=6,
)
STUDIES = (DYNAMIC, MISMATCH)
