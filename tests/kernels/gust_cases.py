"""Seeded inputs of the gust mission's kernels for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.missions.gust.model import Turbulence, linear_model, published
from flightsw.missions.gust.model import parameter_vector as gust_vector

Rng = np.random.Generator
Args = list


GUST = gust_vector(published(), Turbulence())


GUST_LINEAR = linear_model()


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def gust_state(r: Rng, k: int = 1) -> np.ndarray:
    return r.normal(size=(k, 9)) * np.array([0.02, 0.05, 1.0, 0.1, 0.1, 1.0, 0.1, 5.0, 0.02])


def gust_controls(r: Rng) -> np.ndarray:
    return r.normal(size=3) * np.array([0.1, 20.0, 0.1])


def codes(r: Rng, top: int) -> np.ndarray:
    return r.permutation(top).astype(np.int64)


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.gust.dynamics.air": lambda r: [gust_state(r)[0], GUST, z(4)],
    "missions.gust.dynamics.lift_drag": lambda r: [r.uniform(15, 25), *r.normal(size=2) * 0.1, gust_controls(r), GUST],
    "missions.gust.dynamics.follow": lambda r: [
        gust_state(r)[0],
        gust_controls(r),
        GUST,
        np.array([20.0, 0.05, 0.02, -0.03]),
        10.0,
        1.0,
        z(9),
    ],
    "missions.gust.dynamics.rates": lambda r: [gust_state(r)[0], gust_controls(r), GUST, z(4), z(9)],
    "missions.gust.dynamics.propagate": lambda r: [gust_state(r, 19), gust_controls(r), GUST, 0.02, z(6, 9)],
    "missions.gust.dynamics.measure": lambda r: [
        gust_state(r, 19),
        codes(r, 7),
        7,
        gust_controls(r),
        GUST,
        z(4),
        z(19, 7),
    ],
    "missions.gust.dynamics.propagate_linear": lambda r: [
        gust_state(r, 19),
        r.normal(size=(9, 9)),
        r.normal(size=(9, 3)),
        gust_controls(r),
        z(9),
    ],
    "missions.gust.dynamics.measure_linear": lambda r: [
        gust_state(r, 19),
        GUST_LINEAR.C,
        GUST_LINEAR.D,
        gust_controls(r),
        codes(r, 7),
        6,
        z(19, 7),
    ],
    "missions.gust.dynamics.constant_gain_step": lambda r: [
        gust_state(r)[0],
        r.normal(size=5),
        r.normal(size=5),
        gust_controls(r),
        GUST_LINEAR.A,
        GUST_LINEAR.B,
        np.ascontiguousarray(GUST_LINEAR.C[:5]),
        r.normal(size=(9, 5)),
        0.02,
        z(5, 9),
    ],
}
