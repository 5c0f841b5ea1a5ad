"""Motion and readings with lift scale and airspeed bias: slopes against finite differences, and the nine-state model within."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.model import Turbulence, parameter_vector, published
from flightsw.missions.gust.servo_bank import states as st

P = parameter_vector(published(), Turbulence())
SIZE = np.array([0.05, 0.08, 1.5, 0.2, 0.1, 1.5, 0.1, 4.0, 0.03, 0.2, 1.5])
STEP = 1e-5 * SIZE


def state(seed: int) -> tuple[np.ndarray, np.ndarray]:
    r = np.random.default_rng(seed)
    return r.normal(size=st.NZ) * SIZE, r.normal(size=3) * np.array([0.1, 40.0, 0.2])


def differences(f: object, z: np.ndarray, rows: int) -> np.ndarray:
    out = np.zeros((rows, st.NZ))
    for i in range(st.NZ):
        hi, lo = z.copy(), z.copy()
        hi[i] += STEP[i]
        lo[i] -= STEP[i]
        out[:, i] = (f(hi) - f(lo)) / (2.0 * STEP[i])  # type: ignore[operator]
    return out


@pytest.mark.parametrize("seed", range(8))
def test_slopes_are_those_of_the_functions(seed: int) -> None:
    z, u = state(seed)
    a, S = np.zeros(g.AIR_N), np.zeros((st.S_N, st.NZ))

    def rates(x: np.ndarray) -> np.ndarray:
        out = np.zeros(st.NZ)
        st.rates(x, u, P, a, out)
        return out

    def read(x: np.ndarray) -> np.ndarray:
        out = np.zeros(g.NY)
        st.instruments(x, u, P, a, out)
        return out

    A, C = np.zeros((st.NZ, st.NZ)), np.zeros((g.NY, st.NZ))
    st.rate_slopes(z, u, P, a, S, A)
    st.instrument_slopes(z, u, P, a, S, C)
    assert pytest.approx(differences(rates, z, st.NZ), rel=1e-6, abs=1e-6) == A
    assert pytest.approx(differences(read, z, g.NY), rel=1e-6, abs=1e-6) == C


def test_with_lift_and_sensor_as_believed_it_is_the_nine_state_model() -> None:
    z, u = state(20)
    z[st.LIFT] = z[st.BIAS_V] = 0.0
    nine = z[: g.NX].copy().reshape(1, -1)
    y = np.zeros(g.NY)
    st.instruments(z, u, P, np.zeros(4), y)
    Y = np.zeros((1, g.NY))
    g.measure(nine, np.arange(g.NY), g.NY, u, P, np.zeros(4), Y)
    assert y == pytest.approx(Y[0], rel=1e-14, abs=1e-14)
    st.propagate(z, u, P, 0.02, np.zeros((g.W_N, st.NZ)))
    g.propagate(nine, u, P, 0.02, np.zeros((g.W_N, g.NX)))
    assert z[: g.NX] == pytest.approx(nine[0], rel=1e-13, abs=1e-14)


def test_lift_scale_leaves_the_lift_of_trim_alone() -> None:
    z, u, a = np.zeros(st.NZ), np.zeros(3), np.zeros(4)
    z[st.LIFT] = 0.3
    assert st.forces(z, u, P, a)[0] == pytest.approx(published().gravity)
    z[g.AK] = z[g.TH] = 0.05
    alone = 1.3 * published().lift[1] * 0.05
    assert st.forces(z, u, P, a)[0] == pytest.approx(published().gravity + alone, rel=1e-9)
