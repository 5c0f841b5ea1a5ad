"""Time of one sample of the windshear mission's estimators, monitor, guidance and control, on an approach in light turbulence."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.control import WindshearControl
from flightsw.missions.windshear.estimator import ALL, WindshearNav, WindshearParams
from flightsw.missions.windshear.guidance import LAWS, WindshearGuidance, WindshearGuidanceParams, with_law
from flightsw.missions.windshear.model import approach_trim
from flightsw.missions.windshear.monitor import WindshearMonitor
from hil_scripts.bench.gust import Timed, timed
from hil_scripts.bench.row import Row
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams
from sim_plant.wind.microburst import MICROBURSTS

DURATION_S, DT = 12.0, 0.02
FILTERS: tuple[tuple[str, str, int], ...] = (
    ("ekf13", "ekf", 13), ("ukf13", "ukf", 13), ("srckf13", "srckf", 13), ("srukf13", "srukf", 13), ("ekf15", "ekf", 15),
    ("ukf15", "ukf", 15), ("srckf15", "srckf", 15),
)  # fmt: skip


def readings(duration_s: float = DURATION_S) -> tuple[np.ndarray, np.ndarray]:
    """Readings [N,9] of an approach held at its trim, and the controls [2] (kN, rad) of it."""
    jet = TwinJet(TwinJetParams(), TwinJetAir(MICROBURSTS["seed"], 1.07, 0.77), 1, duration_s + 1.0, DT)
    z = np.empty((round(duration_s / DT), k.NY))
    u = jet.controls.copy()
    for i in range(len(z)):
        z[i] = jet.reading
        jet.step(u)
    return z, u * np.array([1e-3, 1.0])


def estimators(duration_s: float = DURATION_S) -> dict[str, Timed]:
    """Every estimator of the mission on the same readings, from a cold start; and the kinematic monitor."""
    z, u = readings(duration_s)
    out = {}
    for name, kind, states in FILTERS:
        nav = WindshearNav(WindshearParams(filter=kind, states=states))
        out[name] = timed(lambda i, n=nav: n.step(z[i], ALL, u, DT), len(z))  # type: ignore[misc]
    monitor = WindshearMonitor()
    out["monitor"] = timed(lambda i: monitor.step(z[i], ALL, DT), len(z))
    return out


def laws(steps: int = 2000) -> dict[str, Timed]:
    """Guidance and control of one sample: on the approach, and in the escape by each law."""
    thrust, elevator = approach_trim(twinjet(), 75.0, -math.radians(3.0))
    rng = np.random.default_rng(1)
    x = np.zeros((steps, k.NX))
    x[:, : k.WX + 2] = 0.0, 120.0, 75.0, -0.05, 0.09, 0.0, thrust, 0.0, 0.0
    x[:, k.KL] = x[:, k.KD] = 1.0
    x[:, k.WX : k.WX + 2] += rng.standard_normal((steps, 2))
    x[:, k.H] += rng.standard_normal(steps)
    out = {}
    for name in ("approach", *(law for law in LAWS if law != "continue")):
        law = "continue" if name == "approach" else name
        guidance, control = WindshearGuidance(with_law(WindshearGuidanceParams(), law)), WindshearControl()
        control.reset(thrust, elevator)
        if name != "approach":
            guidance.abort()

        def step(i: int, g: WindshearGuidance = guidance, c: WindshearControl = control) -> None:
            c.step(x[i], g.step(x[i], 0.1, DT))

        out[name] = timed(step, steps)
    return out


def rows() -> list[Row]:
    """Estimators, guidance and control of the jet transport, one 50 Hz sample each."""
    out = []
    for name, took in estimators().items():
        text = f"windshear {name}, one sample"
        out.append(Row(f"windshear.{name}.step_us", text, took.median_us, "us", "<= 2000"))
        out.append(Row(f"windshear.{name}.p99_us", f"windshear {name}, 99th percentile", took.p99_us, "us"))
    for name, took in laws().items():
        text = f"windshear {name}: guidance and inverse dynamics"
        out.append(Row(f"windshear.law.{name}.step_us", text, took.median_us, "us"))
    return out
