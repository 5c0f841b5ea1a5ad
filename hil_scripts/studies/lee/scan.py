"""The printed method at its best: Lee (2011) prints neither the window of the calculated wind nor Q, both were tuned by trial."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee.filters import consistency, run, wind_figures
from hil_scripts.studies.lee.study import filters

WINDOWS = (1, 5, 41)  # samples of the calculated wind, 2n + 1
ROOTS = (0.1, 0.2, 0.33, 0.66)  # [m/s/sqrt(s)] roots of the wind's Q; those of V, beta and alpha go with it
FIGURES = ("wind.magnitude_rms_pct", "wind.magnitude_p95_pct", "wind.magnitude_max_pct", "wind.direction_rms_deg",
           "wind.inside_3sigma_pct", "wind.convergence_s.n", "wind.convergence_s.e", "wind.convergence_s.d",
           "nees.wind_mean")  # fmt: skip


def name(samples: int, root: float) -> str:
    """Key of a setting, for example w41_q0p33."""
    return f"w{samples}_q{root:g}".replace(".", "p")


def run_scan(case: Case, seed: int) -> RunResult:
    """The printed filter with every window and Q, an extended one in its place, and the default, on one flight and its noise."""
    p = case.params
    sigma = fl.LARGE if p["noise"] == "large" else fl.SMALL
    flight = fl.fly(str(p["wind"]), float(p["duration_s"]), seed)
    y = np.hstack([flight.x[:, :12], flight.v]) + fl.noise(len(flight.t), sigma, seed, 0.0)
    acc, after = fl.accelerometer(flight, seed), float(p["after_s"])
    known = filters(sigma, str(p["wind"]), 0.0)
    tuned = {"default": known["default"]}
    for samples in WINDOWS:
        for root in ROOTS:
            q: dict[str, Any] = {"q_wind": root, "q_V": root, "q_beta": root / 190.0, "q_alpha": root / 190.0}
            tuned[name(samples, root)] = replace(known["printed"], cmw_samples=samples, **q)
    # "EKF leads to divergence" (4.4): the same equations, readings, window and Q
    tuned["ekf"] = replace(tuned[name(1, 0.33)], filter="ekf")
    values: dict[str, float] = {}
    for key, params in tuned.items():
        est = run(params, flight, y, acc)
        figures = wind_figures(flight.t, flight.x[:, 12:15], est.x[:, 12:15], est.sigma[:, 12:15], after)
        figures |= consistency(flight.t, flight.x, est, after)
        values |= {f"{key}.{k}": figures[k] for k in FIGURES}
    return RunResult(values)


def _case(label: str, wind: str, noise: str) -> Case:
    params: dict[str, Any] = {"wind": wind, "noise": noise, "duration_s": 250.0, "after_s": 60.0}
    return Case(label, params)


STUDY = Study(
    name="lee_scan",
    title="The printed method at its best",
    purpose="window of the calculated wind and Q, which Lee (2011) tuned by trial and does not print: every setting on the same "
    "flights and noise, this project's filter beside it",
    cases=(
        _case("I", "sounding", "small"),
        _case("I_sine", "sine", "small"),
        _case("II", "ecwm", "small"),
        _case("III", "ecwm", "large"),
        _case("IV_sine", "sine", "large"),
    ),
    run=run_scan,
    default_runs=20,
    small_cases=("II", "III"),
)
