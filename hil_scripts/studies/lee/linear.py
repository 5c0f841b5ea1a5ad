"""The tanker made linear, and on it the linear removal of colour of Lee (2011), section 3.5, by covariances: no noise is drawn.

Straight flight, twelve states and the wind, whose random walk enters the air data at once; the twelve readings of (4.9b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.layout import AIR, EULER, NX, POS, WIND, X_X
from flightsw.sixdof.motion import air_jacobian
from flightsw.sixdof.trim import linearise_free, trim_free
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee.removal import FORMS, Augmented, Linear, Removal
from hil_scripts.studies.lee.study import EXACT

READ = POS.stop  # states read: all but the wind
SPEED = 190.0  # [m/s]
Q_WIND = float(EXACT["q_wind"])  # [m/s/sqrt(s)]
START = 20.0  # [m/s] 1-sigma of the wind before the first reading
WIDE = 1e3  # 1-sigma of the rest then, in 1-sigma of its reading


@dataclass(frozen=True)
class Tanker:
    """At a trim x [15]: A [15,15], B [15,4] of the state of (4.3), and G [15,3], by which increments of the wind NED enter it."""

    x: np.ndarray
    A: np.ndarray
    B: np.ndarray
    G: np.ndarray


def tanker() -> Tanker:
    """The study's tanker in straight and level flight. Raises TrimError."""
    ac = load_aircraft("kc135r")
    mass = fl.LAW.schedule.mass_kg
    t = trim_free(ac, mass, fl.LAW.schedule.h_m, SPEED, 0.0)
    A, B = linearise_free(ac, mass, t)
    R, air, G = np.zeros(9), np.zeros((3, 3)), np.zeros((NX, 3))
    dcm_from_euler(*(float(v) for v in t.x[EULER]), R)
    air_jacobian(*(float(v) for v in t.x[AIR]), R, air)
    G[AIR], G[WIND] = air, np.eye(3)
    return Tanker(t.x, A, B, G)


def system(sigma: np.ndarray, tau_s: float) -> Linear:
    """(3.20) of the tanker; sigma [12] of its readings, tau_s [s] their colour."""
    t = tanker()
    Q = Q_WIND**2 / fl.DT * np.eye(3)
    return Linear(t.A, t.G, np.eye(NX)[:READ], Q, sigma, np.full(READ, tau_s), fl.DT)


def run_removal(case: Case, seed: int) -> RunResult:
    """Error of the wind after duration_s: every form of the removal, as it is and as the filter has it, and noise states."""
    sigma = (fl.LARGE if case.params["noise"] == "large" else fl.SMALL)[:READ]
    sys = system(sigma, float(case.params["tau_s"]))
    x, P = np.zeros(NX), np.diag(np.square([*(WIDE * sigma), *[START] * 3]))
    states = Augmented(sys, x, P)
    states.correct(np.zeros(READ))
    forms = {form: Removal(sys, x, states.P[:NX, :NX], form) for form in FORMS}
    for _ in range(round(float(case.params["duration_s"]) / fl.DT)):
        states.step(np.zeros(READ), x)
        for f in forms.values():
            f.advance()
    values: dict[str, float] = {}
    for name, true, own in (("augmented", states.P, states.P), *((k, f.true, f.P) for k, f in forms.items())):
        rms, sigmas = (np.sqrt(np.diag(c)[WIND]) for c in (true, own))
        for i, a in enumerate("ned"):
            values |= {f"{name}.wind.rms_mps.{a}": float(rms[i]), f"{name}.wind.sigma_mps.{a}": float(sigmas[i])}
        values[f"{name}.wind.error_mps"] = float(np.linalg.norm(rms))
        values[f"{name}.wind.error_over_sigma"] = float(np.linalg.norm(rms) / np.linalg.norm(sigmas))
        values[f"{name}.position.rms_m.x"] = float(np.sqrt(true[X_X, X_X]))
    for name in forms:
        values[f"{name}.over_augmented"] = values[f"{name}.wind.error_mps"] / values["augmented.wind.error_mps"]
    return RunResult(values)


STUDY = Study(
    name="lee_removal",
    title="Linear removal of colour",
    purpose="Lee (2011), section 3.5, on the linear tanker, by covariances: the removal with M, A_N and Q_N, without the "
    "correlation, as chapter 4 has it, and noise states in its place",
    cases=tuple(
        Case(f"tau_{tau:g}{tail}", {"noise": noise, "tau_s": tau, "duration_s": 250.0})
        for noise, tail in (("small", ""), ("large", "_large"))
        for tau in (0.05, 1.0, 20.0)
    ),
    run=run_removal,
    default_runs=1,
)
