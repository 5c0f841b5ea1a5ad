"""Time of one sample of the gust mission's estimators and laws, on readings of a flight in light turbulence."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimators import ESTIMATORS, GustNavTable, make_gust_nav
from flightsw.missions.gust.laws import LAWS, GustCtrlTable, GustLaws
from flightsw.missions.gust.model import Turbulence, published
from flightsw.missions.gust.servos import GustServos
from hil_scripts.bench.row import Row
from hil_scripts.studies.hoffmann import flight as hf

DURATION_S = 12.0
DROP = 50  # samples of start-up
PERIOD_US = 20_000.0  # one 50 Hz sample


@dataclass(frozen=True)
class Timed:
    """Median and dearest percentile [us] of a step."""

    median_us: float
    p99_us: float


def timed(step: Callable[[int], object], count: int) -> Timed:
    """Median and 99th percentile of step(i), i = 0 to count - 1, the first `DROP` left out."""
    took = []
    for i in range(count):
        t0 = time.perf_counter()
        step(i)
        t1 = time.perf_counter()
        if i >= DROP:
            took.append(t1 - t0)
    return Timed(float(np.median(took)) * 1e6, float(np.percentile(took, 99)) * 1e6)


def estimators(duration_s: float = DURATION_S) -> dict[str, Timed]:
    """Every estimator of the mission on the same readings, GNSS speed and accelerometer included (printed: its own five)."""
    flight = hf.fly(hf.FlightPlan(duration_s, hf.wind(hf.LIGHT), hf.AlexisParams(direct=True)), 1)
    out = {}
    for name in ESTIMATORS:
        table = GustNavTable(estimator=name)
        nav = make_gust_nav(table)
        ok = flight.fresh & table.channels
        out[name] = timed(lambda i, n=nav, m=ok: n.step(flight.y[i], int(m[i]), flight.u[i], hf.DT), len(flight.y))  # type: ignore[misc]
    return out


def laws(steps: int = 2000) -> dict[str, Timed]:
    """Every law with the servo model of one sample."""
    ac = published()
    rng = np.random.default_rng(1)
    x = rng.standard_normal((steps, k.NX)) * np.array([0.01, 0.02, 0.5, 0.05, 0.02, 0.5, 0.02, 1.0, 0.0])
    y = np.array([0.0, 0.0, ac.V0_mps, 0.0, ac.H0_m, ac.V0_mps, 0.0])
    out = {}
    for name in LAWS:
        law, servos = GustLaws(GustCtrlTable(law=name), ac, Turbulence(), hf.DT, 1), GustServos(ac)

        def step(i: int, law: GustLaws = law, servos: GustServos = servos) -> None:
            servos.send(law.step(x[i], y, servos))
            servos.step(hf.DT)

        out[name] = timed(step, steps)
    return out


def rows() -> list[Row]:
    """Estimators and laws of the small UAV, one 50 Hz sample each."""
    out = []
    for name, took in estimators().items():
        out.append(Row(f"gust.{name}.step_us", f"gust estimator {name}, one sample", took.median_us, "us", "<= 2000"))
        out.append(Row(f"gust.{name}.p99_us", f"gust estimator {name}, 99th percentile", took.p99_us, "us"))
    for name, took in laws().items():
        out.append(Row(f"gust.law.{name}.step_us", f"gust law {name} and servo model", took.median_us, "us"))
    return out
