"""Seeded inputs of the kernels of air-data fault detection for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rng = np.random.Generator
Args = list


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


THRESHOLDS = np.array([3.0, 2.0, 4.0, 3.0, 1.0, 0.1])[:, None] * np.array([0.0, 2.0, 3.0, 4.0])


def spd(r: Rng) -> np.ndarray:
    a = r.normal(size=(3, 3))
    return a @ a.T + 0.2 * np.eye(3)


def fit_args(r: Rng) -> Args:
    return [3 * r.normal(size=3), spd(r), r.uniform(0.5, 1.5, 3), r.uniform(0.1, 2.0)]


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.receiver.airdata.fdi.parity_kernels.popcount": lambda r: [int(r.integers(8))],
    "missions.receiver.airdata.fdi.parity_kernels.null_basis": lambda r: [r.normal(size=3), z(2, 3)],
    "missions.receiver.airdata.fdi.parity_kernels.whiten": lambda r: [
        r.normal(size=3),
        spd(r),
        r.normal(size=(2, 3)),
        z(2),
        z(2, 3),
    ],
    "missions.receiver.airdata.fdi.parity_kernels.subset_fit": lambda r: [*fit_args(r), int(r.integers(1, 8))],
    "missions.receiver.airdata.fdi.parity_kernels.subset_gammas": lambda r: [*fit_args(r), 7, z(8)],
    "missions.receiver.airdata.fdi.parity_kernels.smallest_set": lambda r: [
        r.uniform(0, 20, 8),
        7,
        7,
        1,
        0,
        np.array([0.0, 3.0, 6.0, 9.0]),
    ],
    "missions.receiver.airdata.fdi.parity_kernels.collapse": lambda r: [
        r.normal(size=(6, 3)) + np.array([3.0, 0.0, 0.0]) * (np.arange(6) > 3)[:, None],
        r.normal(size=(6, 3)),
        3,
        6,
        np.array([1, 1, 0, 1, 1, 1]),
        spd(r),
        spd(r),
        7,
        np.array([0.0, 1.0, 2.0, 3.0]),
        np.array([0.0, 5.0, 6.0, 7.0]),
    ],
    "missions.receiver.airdata.fdi.parity_kernels.cusum_step": lambda r: [
        r.normal(size=2),
        r.normal(size=(2, 3)),
        2.0,
        26.0,
        r.uniform(0, 10, 6),
    ],
    "missions.receiver.airdata.fdi.parity_kernels.cusum_record": lambda r: [
        r.normal(size=(50, 2)) + 1.0,
        r.normal(size=(1, 2, 3)),
        2.0,
        13.0,
        26.0,
        bool(r.integers(2)),
        z(50, 6),
    ],
    "missions.receiver.airdata.fdi.parity_kernels.take_off_rotation": lambda r: [
        np.concatenate((r.uniform(180, 200, 3), r.uniform(-0.1, 0.1, 6))),
        r.uniform(-0.2, 0.2, 3),
        r.normal(size=(3, 3)) * 5,
        z(9),
    ],
    "missions.receiver.airdata.fdi.monitor_kernel.window_mean": lambda r: [
        r.normal(size=(5, 3)),
        r.normal(size=(5, 3)),
        r.integers(0, 2, 5),
        2,
        4,
        z(3),
        z(3),
    ],
    "missions.receiver.airdata.fdi.monitor_kernel.covariance": lambda r: [r.uniform(0, 1, 3), spd(r), 3, z(3, 3)],
    "missions.receiver.airdata.fdi.monitor_kernel.exclude": lambda r: [
        np.array([5, 40, int(r.integers(800)), 2, 0]),
        np.array([20, 640, 400, 1]),
    ],
    "missions.receiver.airdata.fdi.monitor_kernel.blame": lambda r: [
        *fit_args(r),
        7,
        int(r.integers(8)),
        THRESHOLDS,
        z(8),
    ],
    "missions.receiver.airdata.fdi.monitor_kernel.agrees": lambda r: [*fit_args(r), 7, int(r.integers(3)), THRESHOLDS],
    "missions.receiver.airdata.fdi.monitor_kernel.signs": lambda r: [*fit_args(r), 7, int(r.integers(8))],
    "missions.receiver.airdata.fdi.monitor_kernel.monitor_variable": lambda r: [
        r.normal(size=(5, 3)) + np.array([4.0, 0.0, 0.0]),
        np.ones((5, 3)),
        np.full(5, 7),
        np.zeros(5, dtype=np.int64),
        2,
        5,
        7,
        0,
        int(r.integers(8)),
        0,
        r.uniform(0.5, 1.0, 3),
        0.1 * spd(r),
        1.0,
        THRESHOLDS,
        np.array([20, 640, 400, 1]),
        np.tile(np.array([19, 20, 100, 1, 30, 1]), (3, 1)),
        z(3),
        z(3),
        z(3, 3),
        z(8),
        np.zeros(7, dtype=np.int64),
    ],
    "missions.receiver.airdata.fdi.monitor_kernel.window_record": lambda r: [
        r.normal(size=(40, 3)) + np.array([4.0, 0.0, 0.0]) * (np.arange(40) < 20)[:, None],
        np.ones((40, 3)),
        r.uniform(0.5, 1.0, 3),
        0.1 * spd(r)[None],
        5,
        THRESHOLDS,
        z(40, 3),
        z(40, 3),
        z(40, 3, 3),
        z(40),
    ],
}
