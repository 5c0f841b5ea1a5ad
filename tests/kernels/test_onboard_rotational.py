"""Kernels of the receiver's variants: against plain Python to the bit, finite differences, and vector formulas."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import dcm_from_euler, rotate_dcm
from flightsw.missions.receiver import rotational
from flightsw.sixdof.measure import average_probes, measure_relative
from flightsw.sixdof.motion import air_velocity, propagate_relative, relative_rates
from flightsw.sixdof.params import parameter_vector

AC = load_aircraft("learjet24")
P = parameter_vector(AC, 5200.0)
PROBES = np.array([q.position_m for q in AC.probe])


def state(r: np.random.Generator) -> np.ndarray:
    x = np.zeros(18)
    x[:3] = r.uniform(185, 205), *r.uniform(-0.03, 0.03, 2)
    x[3:6], x[6:9] = r.uniform(-0.05, 0.05, 3), r.uniform(-0.2, 0.2, 3)
    x[9:12], x[12:15], x[15:18] = r.uniform(-40, 40, 3), r.uniform(-15, 15, 3), r.uniform(-0.05, 0.05, 3)
    return x


def stage(r: np.random.Generator) -> np.ndarray:
    R = np.zeros(9)
    dcm_from_euler(r.uniform(-3, 3), r.uniform(-0.2, 0.2), r.uniform(-0.5, 0.5), R)
    v = R.reshape(3, 3).T @ np.array([195.0, 0.0, 10.0])
    return np.concatenate((R, r.uniform(-0.05, 0.05, 3), np.zeros(3), v))


def controls(r: np.random.Generator) -> np.ndarray:
    return np.array([*r.uniform(-0.05, 0.05, 3), 6000.0])


def points(r: np.random.Generator) -> np.ndarray:
    return np.array([state(r) for _ in range(37)])


CASES: dict[str, Any] = {
    "probe_flow": lambda r: [state(r), True, stage(r)[:9], stage(r), PROBES[1], np.zeros(3)],
    "measure_local": lambda r: [
        points(r), True, 18 + np.arange(12), 0, 12, stage(r), PROBES, np.zeros((37, 12)),
    ],
    "differenced_relative": lambda r: [
        points(r), 18, np.arange(18), 18, controls(r), 0.59, P, stage(r), r.normal(size=3), 0.9, 0.1, np.zeros((37, 18)),
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_compiled_and_plain_python_agree_to_the_bit(name: str) -> None:
    f = getattr(rotational, name)
    for seed in range(3):
        a = CASES[name](np.random.default_rng(seed))
        b = copy.deepcopy(a)
        f(*a)
        getattr(f, "py_func", f)(*b)
        assert a[-1].any()
        assert a[-1].tobytes() == b[-1].tobytes()


def test_rotational_wind_is_taken_off_the_aerodynamic_rates_and_nothing_else() -> None:
    """The moment of (w, w_eff) less that of (w, 0) is the damping of -w_eff; no rotational wind: fifteen states to the bit."""
    r = np.random.default_rng(4)
    R, fm, d, e, z = np.zeros(9), np.zeros(9), np.zeros(15), np.zeros(15), np.zeros(15)
    for _ in range(20):
        x, u, tk = state(r), controls(r), stage(r)
        tk[9:12] = 0.0
        calm = x.copy()
        calm[15:] = 0.0
        relative_rates(calm, u, 0.59, P, tk, R, fm, d)
        relative_rates(x[:15].copy(), u, 0.59, P, tk, R, fm, e)
        assert d.tobytes() == e.tobytes()
        relative_rates(x, u, 0.59, P, tk, R, fm, z)
        assert np.array_equal(z[6:], d[6:])
        # air at rest in the rotating air mass: same aerodynamics as not turning at all, gyroscopic terms aside
        x[15:18] = x[3:6]
        relative_rates(x, u, 0.59, P, tk, R, fm, z)
        still = x.copy()
        still[3:6] = still[15:18] = 0.0
        moved = fm[3:6].copy()
        relative_rates(still, u, 0.59, P, tk, R, fm, e)
        assert fm[3] == pytest.approx(moved[0], abs=1e-6 * P[4])
        assert fm[5] == pytest.approx(moved[2], abs=1e-6 * P[6])


def test_differenced_rows_are_the_rates_of_change_of_the_plain_ones() -> None:
    """cf = 1, cx = 0 against central differences of h along the modelled motion of both aircraft."""
    r = np.random.default_rng(7)
    codes, h = np.arange(18), 1e-3
    worst = 0.0
    for _ in range(10):
        x, u, tk, a_t = state(r), controls(r), stage(r), r.uniform(-2, 2, 3)

        def moved(dt: float, tk: np.ndarray = tk, a_t: np.ndarray = a_t) -> np.ndarray:
            out = tk.copy()
            rotate_dcm(tk[:9], tk[9:12], dt, out[:9])
            out[15:18] += a_t * dt
            return out

        Y = np.zeros((2, 18))
        for i, s in enumerate((-h, h)):
            X = x[None, :].copy()
            propagate_relative(X, u, 0.59, P, np.array([tk, moved(s / 2), moved(s)]), s, np.zeros((5, 18)))
            measure_relative(X, codes, 18, moved(s), Y[i : i + 1])
        got = np.zeros((1, 18))
        rotational.differenced_relative(x[None, :], 18, codes, 18, u, 0.59, P, tk, a_t, 1.0, 0.0, got)
        worst = max(worst, float(np.abs(got[0] - (Y[1] - Y[0]) / (2 * h)).max()))
        plain = np.zeros((1, 18))
        measure_relative(x[None, :], codes, 18, tk, plain)
        rotational.differenced_relative(x[None, :], 18, codes, 18, u, 0.59, P, tk, a_t, 0.0, 1.0, got)
        assert np.abs(got - plain).max() < 1e-9
    assert worst < 2e-4


def test_single_probes_average_to_the_effective_air_data_when_the_wind_is_uniform() -> None:
    r = np.random.default_rng(9)
    R, v, out = np.zeros(9), np.zeros(3), np.zeros(3)
    for _ in range(20):
        x, tk = state(r), stage(r)
        dcm_from_euler(x[6], x[7], x[8], R)
        w = x[3:6] + R.reshape(3, 3) @ tk[9:12]
        rows = []
        for pos in PROBES:
            rotational.probe_flow(x, False, R, tk, pos, v)
            rows.append(v.copy())
            flow = np.array(air_velocity(*v)) - np.array(air_velocity(*x[:3])) - np.cross(w, pos)
            assert np.abs(flow).max() < 1e-9
            # with rotational wind: the linear wind field of one gradient per surface comes off
            p, q, rr = x[15:18]
            field = np.array([0.0, rr * pos[0], p * pos[1] - q * pos[0]])
            rotational.probe_flow(x, True, R, tk, pos, v)
            assert np.abs(np.array(air_velocity(*v)) - np.array(air_velocity(*rows[-1])) + field).max() < 1e-9
        V, b, a = np.array(rows).T.copy()
        assert average_probes(V, a, b, np.ones(3, dtype=np.int64), PROBES, w, out) == 3
        assert np.abs(out - x[:3]).max() < 1e-9
