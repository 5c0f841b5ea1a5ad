"""Kernels of the air, compiled and interpreted, agree to the bit on seeded inputs."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.wind.air import lay_gusts, linear_mix, meet
from sim_plant.wind.extent_kernel import field_gusts, filtered_gusts, met
from sim_plant.wind.span_kernel import correlate
from sim_plant.wind.trail import AWAY, ROLL_UP
from sim_plant.wind.trail_kernel import NHIST, cut, lay_trail, lie, note, trail_on_airframe, trail_velocity
from sim_plant.wind.vortex import NK, feel, oval
from sim_plant.wind.warmth import warmed

R = np.random.default_rng(5)
RINGS, STATE = R.normal(size=(3, 64, 3)), R.normal(size=n.NS)
STATE[:4] /= np.sqrt(np.sum(STATE[:4] ** 2))
OBS, SRC = np.abs(R.normal(size=n.NO)) + 1.0, np.abs(R.normal(size=NK)) + 0.5
NODES = np.cumsum(R.normal(size=(4, len(AWAY), 4)), axis=1)
NODES[:, :, 3] = np.arange(len(AWAY))
PARTS = np.zeros((4, len(AWAY) - 1, 9))
cut(NODES, 0.01, PARTS)
WEIGHT, POINTS = R.normal(size=(6, 3)), R.normal(size=(8, 3)) * 10.0
WARM = warmed(np.zeros(n.P_TABLES), np.array([[0.0, 3.0], [5000.0, -2.0], [9000.0, 4.0]]))
ON, HIST = np.array([0, 1, 2, 0, 0, 0, 1, 2]), R.normal(size=(32, NHIST))
CASES: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
    (air, (6500.0, WARM)),
    (linear_mix, (R.normal(size=(3, 3, 3, 5)), R.normal(size=(3, 3, 18)), np.zeros((10, 3, 3)))),
    (lay_gusts, (0.6, 0.8, R.normal(size=(4, 3, 3)), 2, RINGS, 70)),
    (
        meet,
        (
            0.6, 0.8, R.normal(size=(4, 3, 3)), 1, 3, 6500.0, np.array([[0.0, 1.0, 2.0], [9000.0, 7.0, -4.0]]),
            R.normal(size=(5, 3)), 2, RINGS, 70, 4.3, np.zeros(3), np.zeros(3), np.zeros(6), np.ones((2, 3)),
        ),
    ),
    (met, (RINGS[0], 5, 7.3)),
    (field_gusts, (STATE, RINGS, 70, 9.4, ON, R.normal(size=8), WEIGHT, np.zeros(6), np.zeros((2, 3)))),
    (filtered_gusts, (STATE, RINGS[0], 70, 9.4, 0.01, R.normal(size=(2, 4)), np.full((3, 3), np.nan), np.zeros(6))),
    (correlate, (True, np.array([0.0, 14.1]), 1.95, 762.0, np.zeros((3, 2, 40)))),
    (correlate, (False, np.array([0.0, 14.1]), 1.95, 533.4, np.zeros((3, 2, 40)))),
    (note, (STATE, SRC, R.normal(size=3), R.normal(size=3), np.zeros(NHIST))),
    (cut, (NODES, 0.01, np.zeros_like(PARTS))),
    (lie, (HIST, 40, 0.01, AWAY, OBS, SRC, True, ROLL_UP, 0.01, 0.7, np.zeros_like(NODES), np.zeros_like(PARTS))),
    (
        lay_trail,
        (
            STATE, R.normal(size=3), R.normal(size=3), HIST, 40, 0.01, AWAY, OBS, SRC, True, ROLL_UP, 0.01, 0.7,
            np.zeros_like(NODES), np.zeros_like(PARTS),
        ),
    ),
    (trail_velocity, (1.0, -2.0, 3.0, PARTS, 300.0, -20.0, SRC)),
    (trail_on_airframe, (STATE, OBS, SRC, PARTS, R.normal(size=n.NS), POINTS, WEIGHT, 3, 6, np.zeros(6), np.zeros((2, 3)))),
    (feel, (1, 3, WEIGHT, 0.1, 0.2, 0.3, 0.4, 0.5, np.zeros(6))),
    (oval, (7.0, 0.5, -2.0, 300.0, 5.0, -5.0, 0.1)),
]  # fmt: skip


@pytest.mark.parametrize(("kernel", "args"), CASES, ids=lambda x: getattr(x, "__name__", ""))
def test_compiled_and_interpreted_agree_to_the_bit(kernel: Callable[..., Any], args: tuple[Any, ...]) -> None:
    one, two = copy.deepcopy(args), copy.deepcopy(args)
    assert kernel(*one) == getattr(kernel, "py_func", kernel)(*two)
    for a, b, before in zip(one, two, args, strict=True):
        assert np.array_equal(a, b, equal_nan=True)
        if isinstance(a, np.ndarray) and not before.any():
            assert a.any(), "an output nothing was written to"
