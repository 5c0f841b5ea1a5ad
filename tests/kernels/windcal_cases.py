"""Seeded inputs of the wind estimate's kernels for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rng = np.random.Generator
Args = list
N = 25


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def body(r: Rng) -> np.ndarray:
    return np.linalg.qr(r.normal(size=(3, 3)))[0].ravel()


def state(r: Rng, n: int = N) -> np.ndarray:
    x = r.normal(size=n) * 1e-3
    x[:6] = r.normal(size=6) * 5.0
    return x


def cov(r: Rng) -> np.ndarray:
    a = r.normal(size=(N, N))
    return a @ a.T + 0.1 * np.eye(N)


def ring(r: Rng, columns: int) -> np.ndarray:
    return np.c_[0.05 * np.arange(12), r.uniform(0.1, 1.0, (12, columns - 1))]


def velocity(r: Rng) -> np.ndarray:
    return np.array([190.0, 10.0, 2.0]) + r.normal(size=3)


def air(r: Rng) -> np.ndarray:
    return np.array([195.0, *r.normal(size=2) * 0.05])


def factors(r: Rng) -> Args:
    return [r.uniform(0.5, 1.0, N), r.uniform(0.0, 1.0, N)]


CASES: dict[str, Callable[[Rng], Args]] = {
    "sixdof.windcal.kernel.push": lambda r: [ring(r, 4), r.normal(size=5)],
    "sixdof.windcal.kernel.between": lambda r: [ring(r, 4), r.uniform(0.0, 0.6), 0.05, z(5)],
    "sixdof.windcal.kernel.aligned": lambda r: [
        ring(r, 4), ring(r, 5), ring(r, 4), r.normal(size=3), r.uniform(0.1, 0.5), 0.05, z(5), z(3), z(9), air(r)
    ],
    "sixdof.windcal.kernel.raw_wind": lambda r: [air(r), velocity(r), body(r), z(3)],
    "sixdof.windcal.kernel.model": lambda r: [0.05, np.r_[1e9, r.uniform(1, 100, N - 1)], r.uniform(0, 1, N), 0.1, z(N), z(N)],
    "sixdof.windcal.kernel.predict": lambda r: [state(r), cov(r), *factors(r)],
    "sixdof.windcal.kernel.expected": lambda r: [state(r), velocity(r), body(r), z(3), z(3, N)],
    "sixdof.windcal.kernel._derivative": lambda r: [velocity(r), velocity(r), state(r), body(r), True, z(3, N)],
    "sixdof.windcal.kernel.correct": lambda r: [
        state(r), cov(r), r.normal(size=(3, N)), r.normal(size=3), r.uniform(0.5, 1.0, 3), np.array([1, 0, 1]), 6.0, z(N)
    ],
    "sixdof.windcal.kernel.total": lambda r: [state(r), cov(r), *factors(r), body(r), z(3), z(3, 3)],
    "sixdof.windcal.kernel.gust_size": lambda r: [np.c_[0.05 * np.arange(21), r.normal(size=(21, 3))], 500.0, 195.0, 0.99, z(2)],
}  # fmt: skip
