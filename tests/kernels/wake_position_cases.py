"""Seeded inputs of the wake-position kernels for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.missions.receiver.airdata.expected import expected
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector

Rng = np.random.Generator
Args = list
WAKE = wake_vector(WakeParams(nu_m2ps=5.0))
PROBES = np.array([[6.5, 0.0, 0.0], [-0.5, -5.2, 0.0], [-0.5, 5.2, 0.0]])
SIG = np.array([0.447, 7.8e-4, 7.8e-4])
N = 28


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def point(r: Rng) -> np.ndarray:
    return np.array(
        [*r.uniform(2, 9, 2), *r.normal(size=2), *r.uniform(0.9, 1.1, 2), r.normal() * 0.2, *r.normal(size=3)]
    )


def frame(r: Rng) -> np.ndarray:
    return np.array([r.uniform(-60, -35), *r.normal(size=7) * 0.02, 200.0, 0.59, 0.5])


def readings(r: Rng) -> np.ndarray:
    return np.array([*r.normal(195.0, 1.0, 3), *r.normal(0.0, 0.01, 3), *r.normal(0.03, 0.01, 3)])


def flags(r: Rng) -> np.ndarray:
    ok = np.ones(9, dtype=np.int64)
    ok[r.integers(9)] = 0
    return ok


def state(r: Rng) -> np.ndarray:
    return np.concatenate((r.uniform(2, 9, 2), r.normal(size=14) * 0.1, r.normal(size=N - 16) * 1e-3))


def considered() -> np.ndarray:
    """Circulations, height and offsets keep their values."""
    return np.array([0] * 4 + [1] * 3 + [0] * 9 + [1] * 9 + [0] * 3)


def cov(r: Rng, n: int = N) -> np.ndarray:
    a = r.normal(size=(n, n)) * 0.2
    return a @ a.T + 0.1 * np.eye(n)


def gauss(r: Rng) -> Args:
    """Arguments the weighted residual starts with, after the point."""
    return [readings(r), flags(r), SIG, np.array([0.4, 0.003, 0.002])]


def model(r: Rng) -> Args:
    return [frame(r), PROBES, WAKE]


def slopes(r: Rng) -> np.ndarray:
    """Jacobian [9,9] of the readings near contact, where they tell the place."""
    g, p, J = frame(r), point(r), z(9, 9)
    g[0], p[:2] = -35.6, (r.normal() * 0.5, 8.9)
    expected(p, g, PROBES, WAKE, True, z(9), J)
    return J


def idx(r: Rng) -> np.ndarray:
    return np.sort(r.permutation(9)[:7])


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.receiver.airdata.expected.surface_wind": lambda r: [*r.uniform(-40, 10, 3), WAKE, 6, -57.0, 200.0],
    "missions.receiver.airdata.expected.expected": lambda r: [point(r), *model(r), True, z(9), z(9, 9)],
    "missions.receiver.airdata.least_squares.weigh": lambda r: [r.normal(size=9), *gauss(r)[1:]],
    "missions.receiver.airdata.least_squares.weighted_cost": lambda r: [point(r), *gauss(r), *model(r), z(9)],
    "missions.receiver.airdata.least_squares.scan": lambda r: [
        point(r),
        *gauss(r),
        *model(r),
        np.linspace(-2, 12, 4),
        np.linspace(6, 10, 3),
        1,
        11,
        z(12),
    ],
    "missions.receiver.airdata.least_squares.information": lambda r: [
        point(r),
        *gauss(r)[1:],
        *model(r),
        r.uniform(0, 1, 4),
        z(9),
        z(4, 4),
        z(9, 4),
    ],
    "missions.receiver.airdata.least_squares.descend": lambda r: [
        point(r),
        *gauss(r),
        *model(r),
        np.array([0.0, 8.0, 1.0, 1.0]),
        np.array([0.01, 0.01, 100.0, 4.0]),
        4,
        8,
    ],
    "missions.receiver.airdata.state.propagate": lambda r: [
        state(r),
        cov(r),
        *r.normal(size=2),
        0.05,
        r.uniform(0.01, 0.1, 7),
        r.uniform(2, 300, 6),
        r.uniform(0.1, 2, 6),
    ],
    "missions.receiver.airdata.state.point_of": lambda r: [state(r), z(10)],
    "missions.receiver.airdata.state.linearise": lambda r: [state(r), *model(r), z(9), z(9, N)],
    "missions.receiver.airdata.iekf.common_noise": lambda r: [*(int(i) for i in r.integers(9, size=2)), 3e-4],
    "missions.receiver.airdata.iekf.heard": lambda r: [r.integers(2, size=9), np.zeros(9, dtype=np.int64)],
    "missions.receiver.airdata.iekf.spread": lambda r: [
        cov(r),
        r.normal(size=(9, N)),
        idx(r),
        7,
        SIG,
        3e-4,
        1e-8 * cov(r, 9),
        z(N, 9),
        z(9, 9),
        z(9, 9),
    ],
    "missions.receiver.airdata.iekf.foresee": lambda r: [state(r), cov(r), frame(r), 3e-4, PROBES, WAKE, z(9), z(9, 9)],
    "missions.receiver.airdata.iekf.correct": lambda r: [
        state(r),
        cov(r),
        readings(r),
        flags(r),
        SIG,
        frame(r),
        3e-4,
        PROBES,
        WAKE,
        3,
        0.01,
        1e9,
        considered(),
        1e-8 * cov(r, 9),
        z(2),
    ],
    "missions.receiver.airdata.state.be_taught": lambda r: [state(r), cov(r), r.normal(size=12) * 1e-3, 0.1 * cov(r, 12)],
    "missions.receiver.airdata.witness_kernel.choose": lambda r: [idx(r), slopes(r), np.repeat(SIG**2, 3), z(2, 9)],
    "missions.receiver.airdata.witness_kernel.noise": lambda r: [r.normal(size=(2, 9)), r.uniform(0, 1, 9), cov(r, 9), z(2)],
    "missions.receiver.airdata.witness_kernel.tell": lambda r: [
        r.normal(size=(2, 9)),
        slopes(r),
        r.normal(size=9),
        r.normal(size=3) * 10,
        r.normal(size=(3, 3)),
        r.uniform(0, 1, 9),
        r.uniform(0, 1, 3),
        z(2),
        z(2, 3),
        z(2),
    ],
}  # fmt: skip
