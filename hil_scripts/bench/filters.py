"""One step of the onboard SR-UKF against filterpy's UKF: same aircraft model, 15 states and 15 measurements."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.sixdof.layout import NX
from flightsw.sixdof.measure import measure_free
from flightsw.sixdof.motion import propagate_free

DT = 0.05  # [s] estimator period
RHO = 0.59  # [kg/m^3] air density near 7010 m
CODES = 15  # twelve states and the inertial velocity
START = np.array([195.0, 0.0, 0.06, 0.0, 0.0, 0.0, 0.3, 0.06, 0.0, 0.0, 0.0, -7010.0, 10.0, 5.0, 0.0])
CONTROLS = np.array([0.0, -0.02, 0.0, 15000.0])  # [rad, rad, rad, N] near trim; the cost does not depend on it
SPREAD = np.array([0.1, 2e-3, 2e-3, 2e-3, 2e-3, 2e-3, 2e-3, 2e-3, 2e-3, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3])


def _core(kind: str = "srukf") -> EstimatorCore:
    core = EstimatorCore(load_aircraft("learjet24"), NavParams(filter=kind), CODES)
    core.codes[:] = np.arange(CODES)
    core.r[:] = np.sqrt(np.full(CODES, 0.1))
    core.ukf.x[:] = START
    core.ukf.set_factor(np.diag(SPREAD))
    np.fill_diagonal(core.ukf.SQ, 0.1 * SPREAD)
    return core


def step_us(kind: str = "srukf", steps: int = 2000) -> float:
    """Microseconds of one predict and correct of filter `kind` (flightsw.filters.factory), median of ten batches."""
    c = _core(kind)
    y, work = np.zeros(CODES), np.zeros((5, NX))

    def step() -> None:
        c.ukf.draw()
        propagate_free(c.ukf.X, CONTROLS, RHO, c.P, DT, work)
        c.ukf.recombine()
        c.ukf.draw()
        measure_free(c.ukf.X, c.codes, CODES, c.ukf.Y)
        y[:] = c.ukf.Y[0]
        c.ukf.correct(y, c.r, CODES)

    return _median_us(step, steps)


def filterpy_step_us(steps: int = 100) -> float:
    """Microseconds of one predict and update of filterpy's UnscentedKalmanFilter, median of ten batches."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    c = _core()
    y, work = np.zeros((1, CODES)), np.zeros((5, NX))

    def fx(x: np.ndarray, dt: float) -> np.ndarray:
        row = x.reshape(1, -1).copy()
        propagate_free(row, CONTROLS, RHO, c.P, dt, work)
        return row[0]

    def hx(x: np.ndarray) -> np.ndarray:
        measure_free(np.ascontiguousarray(x).reshape(1, -1), c.codes, CODES, y)
        return y[0].copy()

    points = MerweScaledSigmaPoints(15, alpha=1.0, beta=2.0, kappa=0.0)
    ukf = UnscentedKalmanFilter(dim_x=15, dim_z=CODES, dt=DT, hx=hx, fx=fx, points=points)
    ukf.x, ukf.P = START.copy(), np.diag(SPREAD**2)
    ukf.Q, ukf.R = np.diag((0.1 * SPREAD) ** 2), np.diag(c.r**2)

    def step() -> None:
        ukf.predict()
        ukf.P = 0.5 * (ukf.P + ukf.P.T)
        ukf.update(hx(ukf.x))

    return _median_us(step, steps)


def _median_us(step: Callable[[], None], steps: int) -> float:
    step()
    batches = []
    for _ in range(10):
        t0 = time.perf_counter()
        for _ in range(max(1, steps // 10)):
            step()
        batches.append((time.perf_counter() - t0) / max(1, steps // 10))
    return float(np.median(batches)) * 1e6


def filterpy_python_model_us() -> float:
    """As `filterpy_step_us`, the model in plain Python: a process of its own with compilation switched off.

    Raises RuntimeError with the process's last words if it fails.
    """
    return _interpreted("from hil_scripts.bench.filters import filterpy_step_us as f; print(f(20))")


def python_step_us(kind: str) -> float:
    """As `step_us`, all kernels as plain Python and numpy arrays: a process of its own with compilation switched off."""
    return _interpreted(f"from hil_scripts.bench.filters import step_us as f; print(f({kind!r}, 10))")


def _interpreted(code: str) -> float:
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    r = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300, check=False)
    if r.returncode:
        raise RuntimeError(f"without compilation: {r.stderr[-500:]}")
    return float(r.stdout)
