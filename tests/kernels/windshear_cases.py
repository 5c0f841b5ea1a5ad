"""Seeded inputs of the wind-shear kernels for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import inversion as kn
from flightsw.missions.windshear import monitor_kernel as kk
from flightsw.missions.windshear.control import NidParams
from flightsw.missions.windshear.model import parameter_vector

Rng = np.random.Generator
Args = list
P = parameter_vector(twinjet())
P[[k.P_FADE1, k.P_FADE2, k.P_LAGV, k.P_LAGA]] = 0.2, 0.2, 0.1, 0.05
G = NidParams().vector()
SPREAD = np.array([100.0, 20.0, 3.0, 0.05, 0.04, 0.02, 5.0, 5.0, 3.0, 0.5, 0.5, 0.1, 0.1, 0.05, 0.05])
MEAN = np.array([-3000.0, 200.0, 75.0, -0.05, 0.08, 0.0, 40.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0])


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def state(r: Rng, n: int = 15) -> np.ndarray:
    return np.ascontiguousarray((MEAN + SPREAD * r.normal(size=15))[:n])


def errors(r: Rng) -> np.ndarray:
    """A state with what the instruments are wrong by."""
    own = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0]) + 0.1 * r.normal(size=8)
    x = state(r)
    return np.concatenate([x, own, x[[k.VA, k.AL]], 1e-3 * r.normal(size=1)])


def states(r: Rng) -> np.ndarray:
    n = int(r.choice([13, 15, k.NE]))
    return np.array([errors(r) if n == k.NE else state(r, n) for _ in range(2 * n + 1)])


def controls(r: Rng) -> np.ndarray:
    return np.array([r.uniform(6.0, 90.0), r.uniform(-0.2, 0.2)])


def steps(r: Rng) -> Args:
    X = states(r)
    return [X, controls(r), P, 0.02, z(2, X.shape[1])]


def kinematic(r: Rng) -> np.ndarray:
    scale = np.array([20.0, 3.0, 2.0, 0.05, 5.0, 3.0, 0.5, 0.5, 0.1, 0.1])
    return np.array([200.0, 75.0, -4.0, 0.03, 0, 0, 0, 0, 0, 0]) + scale * r.normal(size=(21, kk.NK))


def demand(r: Rng) -> np.ndarray:
    return np.array([float(r.integers(4)), r.uniform(-8, 8), r.uniform(70, 85), r.uniform(0.1, 0.3), 0.2])


def codes(r: Rng, n: int) -> np.ndarray:
    return r.permutation(n).astype(np.int64)


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.windshear.dynamics.lift_curve": lambda r: [r.uniform(-0.1, 0.6), P],
    "missions.windshear.dynamics.lift_slope": lambda r: [r.uniform(-0.1, 0.6), P],
    "missions.windshear.dynamics.lift_drag": lambda r: [
        r.uniform(50, 90),
        r.uniform(-0.1, 0.4),
        r.normal() * 0.1,
        1.1,
        0.9,
        P,
    ],
    "missions.windshear.dynamics.pitch_acceleration": lambda r: [r.uniform(50, 90), *r.normal(size=3) * 0.1, P],
    "missions.windshear.dynamics.thrust_limit": lambda r: [r.uniform(50, 90), P],
    "missions.windshear.dynamics.path_rates": lambda r: [state(r), 1.1, 0.9, r.normal() * 0.1, P],
    "missions.windshear.dynamics.rates": lambda r: [state(r), controls(r), P, z(15)],
    "missions.windshear.dynamics.propagate": steps,
    "missions.windshear.dynamics.measure": lambda r: [
        states(r),
        codes(r, k.NZ),
        k.NZ,
        controls(r),
        P,
        z(2 * k.NE + 1, k.NZ),
    ],
    "missions.windshear.dynamics.misread": lambda r: [r.normal(), int(r.integers(k.NZ)), errors(r), P],
    "missions.windshear.dynamics.f_factor": lambda r: [state(r), 9.81],
    "missions.windshear.dynamics.turbulence_columns": lambda r: [state(r, 13), *r.uniform(0, 1, 2), 13, z(13, 15)],
    "missions.windshear.dynamics.turbulence_drift": lambda r: [state(r), *r.uniform(0, 2, 2)],
    "missions.windshear.monitor_kernel.propagate_kinematic": lambda r: [kinematic(r), r.normal(size=3), 0.02],
    "missions.windshear.monitor_kernel.measure_kinematic": lambda r: [
        kinematic(r),
        codes(r, kk.NZ),
        kk.NZ,
        z(21, kk.NZ),
    ],
    "missions.windshear.inversion.clip": lambda r: [r.normal(), -0.5, 0.5],
    "missions.windshear.inversion.incidence_for": lambda r: [r.uniform(-0.05, 0.05), state(r), 0.02, -0.08, 0.22, P],
    "missions.windshear.inversion.invert": lambda r: [state(r), demand(r), r.normal() * 0.05, P, G, z(kn.NO)],
}
