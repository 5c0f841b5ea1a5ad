"""What Lee (2011) leaves open: process noise that follows the turbulence, and rotational wind on the receiver."""

from __future__ import annotations

from typing import Any

import numpy as np

from flightsw.sixdof.estimator_core import NavParams
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee.closed_loop import LoopCase
from hil_scripts.studies.lee.closed_loop import fly as fly_loop
from hil_scripts.studies.lee.filters import run
from hil_scripts.studies.lee.study import EXACT, LIGHT, sensor_params

ROUGH = 2.0  # [m/s]
SEGMENTS = ("calm", "rough", "after")
EDGE_S = 10.0  # after a change of turbulence: judged separately


def run_steps(case: Case, seed: int) -> RunResult:
    """Turbulence 0.39 -> 2 -> 0.39 m/s in one flight: adaptive filters against the filter tuned to each level."""
    sigma = fl.LARGE if case.params["noise"] == "large" else fl.SMALL
    T = float(case.params["duration_s"])
    flight = fl.fly("ecwm", T, seed, steps=(LIGHT, ROUGH, LIGHT))
    y = np.hstack([flight.x[:, :12], flight.v]) + fl.noise(len(flight.t), sigma, seed)
    acc = fl.accelerometer(flight, seed)
    base: dict[str, Any] = {**EXACT, **sensor_params(sigma)}
    filters = {
        "default": {"adapt_wind": "bank"},
        "single": {"adapt_wind": "single"},
        "fixed_calm": {"q_wind": EXACT["q_wind"]},
        "fixed_rough": {"q_wind": EXACT["q_wind"] * ROUGH / LIGHT},
    }
    W = flight.x[:, 12:15]
    values: dict[str, float] = {}
    traces: dict[str, np.ndarray] = {"t": flight.t[::4], "wind_true": W[::4]}
    rms: dict[str, list[float]] = {}
    for name, change in filters.items():
        est = run(NavParams(**(base | change)), flight, y, acc)
        traces[f"{name}.wind"], traces[f"{name}.sigma"] = est.x[::4, 12:15], est.sigma[::4, 12:15]
        e = np.linalg.norm(est.x[:, 12:15] - W, axis=1)
        rms[name] = []
        for i, seg in enumerate(SEGMENTS):
            lo, hi = T * i / 3 + EDGE_S, T * (i + 1) / 3
            r = float(np.sqrt(np.mean(e[(flight.t >= lo) & (flight.t < hi)] ** 2)))
            rms[name].append(r)
            values[f"{name}.{seg}.wind_rms_mps"] = r
    tuned = (rms["fixed_calm"][0], rms["fixed_rough"][1], rms["fixed_calm"][2])
    for name in ("default", "single", "fixed_calm", "fixed_rough"):
        for seg, r, best in zip(SEGMENTS, rms[name], tuned, strict=True):
            values[f"{name}.{seg}.ratio_to_tuned"] = r / best
    return RunResult(values, traces)


def run_rotation(case: Case, seed: int) -> RunResult:
    """Station keeping at contact with and without rotational wind states, and the error of the estimated rates."""
    plant: tuple[tuple[str, Any], ...] = ()
    for craft in ("tanker", "receiver"):
        plant += ((f"aircraft.{craft}.aero_error_frac", float(case.params["mismatch_pct"]) / 100.0),)
    values: dict[str, float] = {}
    for name, receiver in (("without", ()), ("with", (("nav.rotational_wind", True),))):
        figures, tr = fly_loop(LoopCase(duration_s=120.0, plant=plant, receiver=receiver), seed)
        values |= {f"{name}.{k}": v for k, v in figures.items()}
        m = tr["t"] >= 30.0
        for i, axis in enumerate("pqr"):
            e = (tr["rot_estimate"] - tr["wind_rot"])[m, i]
            values[f"{name}.rotation.rms_radps.{axis}"] = float(np.sqrt(np.mean(e * e)))
            values[f"{name}.rotation.true_mean_radps.{axis}"] = float(tr["wind_rot"][m, i].mean())
    return RunResult(values)


ADAPTIVE = Study(
    name="lee_adaptive",
    title="Process noise that follows the turbulence",
    purpose="turbulence 0.39 -> 2 -> 0.39 m/s in flight; RMS of each stretch against the filter tuned to its level",
    cases=(
        Case("small", {"noise": "small", "duration_s": 240.0}),
        Case("large", {"noise": "large", "duration_s": 240.0}),
    ),
    run=run_steps,
)
ROTATION = Study(
    name="lee_rotation",
    title="Rotational wind on the receiver",
    purpose="the wake's rotational wind as three more states: error of the estimate, and what it does for station keeping",
    cases=(Case("exact", {"mismatch_pct": 0.0}), Case("mismatch_10", {"mismatch_pct": 10.0})),
    run=run_rotation,
)
STUDIES = (ADAPTIVE, ROTATION)
