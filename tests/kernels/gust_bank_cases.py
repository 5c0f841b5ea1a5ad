"""Seeded inputs of the kernels of the bank of servo models for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.filters.bank import markov
from flightsw.missions.gust.model import published
from flightsw.missions.gust.servos import surface_limits
from tests.kernels.gust_cases import GUST, gust_controls, z

Rng = np.random.Generator
N = 11
OF = np.array([0, 1, 2, 1, 1])


def state(r: Rng, k: int = 1) -> np.ndarray:
    return r.normal(size=(k, N)) * np.array([0.02, 0.05, 1.0, 0.1, 0.1, 1.0, 0.1, 5.0, 0.02, 0.1, 1.0])


def covariance(r: Rng, k: int) -> np.ndarray:
    a = r.normal(size=(k, N, N)) * 0.05
    return np.array([x @ x.T + 1e-4 * np.eye(N) for x in a])


def surfaces(r: Rng, k: int = 3) -> np.ndarray:
    return np.array([gust_controls(r) for _ in range(k)])


def codes(r: Rng) -> np.ndarray:
    return r.permutation(7).astype(np.int64)


AT = "missions.gust.servo_bank"
CASES: dict[str, Callable[[Rng], list]] = {
    f"{AT}.states.forces": lambda r: [state(r)[0], gust_controls(r), GUST, z(4)],
    f"{AT}.states.rates": lambda r: [state(r)[0], gust_controls(r), GUST, z(4), z(N)],
    f"{AT}.states.propagate": lambda r: [state(r)[0], gust_controls(r), GUST, 0.02, z(6, N)],
    f"{AT}.states.instruments": lambda r: [state(r)[0], gust_controls(r), GUST, z(4), z(7)],
    f"{AT}.states.air_slopes": lambda r: [state(r)[0], gust_controls(r), GUST, z(4), z(6, N)],
    f"{AT}.states.rate_slopes": lambda r: [state(r)[0], gust_controls(r), GUST, z(4), z(6, N), z(N, N)],
    f"{AT}.states.instrument_slopes": lambda r: [state(r)[0], gust_controls(r), GUST, z(4), z(6, N), z(7, N)],
    f"{AT}.kernel.move_surfaces": lambda r: [
        surfaces(r), surfaces(r), z(3, 3), surfaces(r, 6), np.array([1, 3, 5]), np.array([20.0, 40.0, 80.0]), 0.7,
        surface_limits(published()), 0.02,
    ],
    f"{AT}.kernel.carry": lambda r: [
        covariance(r, 1)[0], r.normal(size=(N, N)), 0.02, covariance(r, 1)[0], z(N, N), z(N, N)
    ],
    f"{AT}.kernel.predict": lambda r: [
        state(r, 5), covariance(r, 5), OF, surfaces(r), r.uniform(0.1, 1.0, 5), covariance(r, 1)[0], covariance(r, 1)[0], GUST,
        0.02, z(6, N), z(4, N, N),
    ],
    f"{AT}.kernel.foresee": lambda r: [
        state(r)[0], covariance(r, 1)[0], gust_controls(r), GUST, codes(r), r.normal(size=7), r.uniform(0.01, 1.0, 7), 6, z(4),
        z(6, N), z(7, N), z(N), z(7), z(7, 7),
    ],
    f"{AT}.kernel.correct": lambda r: [
        state(r, 5), covariance(r, 5), OF, surfaces(r), GUST, codes(r), r.normal(size=7), r.uniform(0.1, 1.0, (5, 7)), 6, z(4),
        z(6, N), z(7, N), z(3, N), z(5), z(5),
    ],
    f"{AT}.kernel.mix": lambda r: [
        state(r, 3), covariance(r, 3), r.dirichlet(np.ones(3)), markov(3, 20.0, 0.02), z(3, N), z(3, N, N), z(3)
    ],
    f"{AT}.kernel.weigh": lambda r: [r.dirichlet(np.ones(4)), r.normal(size=4), 1e-30],
    f"{AT}.kernel.combine": lambda r: [state(r, 3), covariance(r, 3), r.dirichlet(np.ones(3)), z(N), z(N, N)],
}  # fmt: skip
