"""Turbulence that each probe meets for itself: its covariance, its intensity learnt, and a monitor that goes by it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsw.missions.receiver.airdata.fdi.monitor import Fdi, FdiParams
from flightsw.missions.receiver.airdata.own_air import OwnAir, changes, parting, spread, tensor
from hil_scripts.studies.sevil.point_gusts import dryden_tensor, point_gusts

V, L, DT = 195.0, 533.4, 0.05
PROBES = np.array([(6.0, 0.0, 0.0), (1.5, -5.4, 0.2), (1.5, 5.4, 0.2)])
NOISE = (0.447, 7.8e-4, 7.8e-4)
ALL = 0b111111111
FLOW = np.repeat([V, 0.0, 0.0], 3)  # readings in still air
SINGLE = np.repeat([1.0, 1.0 / V, 1.0 / V], 3)


def air(sigma: float, seed: int, count: int, own: bool = True) -> np.ndarray:
    """Readings [count,9] less expected ones: gusts of this intensity at the probes, and their noise."""
    g = point_gusts(seed, V, L, sigma, DT, PROBES, count)
    if not own:
        g[:] = g[:, :1]
    y = -np.transpose(g, (0, 2, 1)).reshape(count, 9) * SINGLE
    return y + np.random.default_rng(seed).standard_normal((count, 9)) * np.repeat(NOISE, 3)


@pytest.fixture(scope="module")
def field() -> np.ndarray:
    """Gusts [60000,3,3] of 1 m/s at the probes."""
    return point_gusts(3, V, L, 1.0, DT, PROBES, 60_000)


def test_covariance_is_that_of_isotropic_turbulence() -> None:
    for r in ((0.0, 0.0, 0.0), (4.5, 5.4, -0.2), (0.0, 10.8, 0.0)):
        assert np.allclose(tensor(r, L), dryden_tensor(np.array(r), L, 1.0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [1, 5])
def test_what_probes_differ_by_in_a_window_is_what_they_meet(field: np.ndarray, n: int) -> None:
    """Against the means of n readings in a frozen field of its own making."""
    m = field[: len(field) // n * n].reshape(-1, n, 3, 3).mean(axis=1)
    m -= m.mean(axis=1, keepdims=True)
    y = -np.transpose(m, (0, 2, 1)).reshape(-1, 9) * SINGLE
    want, C = np.cov(y.T), spread(PROBES, V, L, n)
    root = np.sqrt(np.diag(C))
    assert np.allclose(C / np.outer(root, root), want / np.outer(root, root), rtol=0, atol=0.06)
    assert np.allclose(C[:3].sum(axis=0), 0.0, atol=1e-15)


def test_changes_of_the_common_gust_and_of_what_parts_two_probes(field: np.ndarray) -> None:
    g = field
    assert np.allclose(np.mean((g[6:, 0] - g[:-6, 0]) ** 2, axis=0), changes(L, 6 * V * DT), rtol=0.08)
    d = g[:, 1] - g[:, 2]
    r = tuple(PROBES[1] - PROBES[2])
    assert np.allclose(np.mean((d[3:] - d[:-3]) ** 2, axis=0), parting((r[0], r[1], r[2]), L, 3 * V * DT), rtol=0.08)


def heard(y: np.ndarray, use: int = ALL) -> OwnAir:
    a = OwnAir(PROBES, L, V, NOISE, 0.39, 10.0)
    for row in y:
        a.hear(row, use, np.zeros(3))
    return a


@pytest.mark.parametrize("sigma", [1.5, 3.0])
def test_intensities_are_learnt(sigma: float) -> None:
    learnt = [heard(air(sigma, seed, 600)) for seed in range(4)]
    assert np.mean([a.own for a in learnt]) == pytest.approx(sigma, rel=0.15)
    assert np.mean([a.sigma for a in learnt]) == pytest.approx(sigma, rel=0.2)


def test_where_all_meet_the_same_gusts_they_differ_by_nothing() -> None:
    assert heard(air(1.5, 1, 600, own=False)).own < 0.3
    assert heard(air(0.1, 2, 600)).sigma < 0.6


@pytest.mark.parametrize("probe", range(3))
def test_a_probe_that_rattles_is_no_turbulence(probe: int) -> None:
    y = air(0.39, 7, 600, own=False)
    y[:, probe + 3 :: 3] += math.radians(2.0) * np.random.default_rng(8).standard_normal((600, 2))
    assert heard(y).own < 0.5


def monitored(y: np.ndarray, by_own_air: bool) -> tuple[float, float]:
    """Shares [%] of samples in alarm of one variable, the worst, and in which a channel is out, after three seconds."""
    fdi, a = Fdi(FdiParams()), OwnAir(PROBES, L, V, NOISE, 0.39, 10.0)
    D = spread(PROBES, V, L, 5)
    alarm, out = np.zeros(3), np.zeros(9)
    for i, row in enumerate(y):
        S = a.own**2 * D if by_own_air else np.zeros((9, 9))
        st = fdi.step(row + FLOW, ALL, FLOW, S, None, None)
        a.hear(row, ALL, np.zeros(3))
        if i >= 60:
            alarm += [st.alarm >> v & 1 for v in range(3)]
            out += [st.excluded >> c & 1 for c in range(9)]
    return 100.0 * alarm.max() / (len(y) - 60), 100.0 * out.max() / (len(y) - 60)


def test_probes_in_air_of_their_own_raise_no_alarm() -> None:
    """1.5 m/s for three minutes: windowed alarms at most 0.05 % of the samples; without the air in the expectation, many."""
    y = air(1.5, 11, 3600)
    wrong, out = monitored(y, by_own_air=True)
    assert wrong <= 0.05 and out <= 1.0
    wrong, out = monitored(y, by_own_air=False)
    assert wrong > 1.0 and out > 10.0


# --- pairs that lie alike ---------------------------------------------------------------------------------------------------


def asked(fault: dict[int, float], common: float, p_alike: float = 0.01) -> tuple[int, int, int]:
    """Masks of beta's probes blamed, unresolved and out at the end of half a second of faults [rad] after one without."""
    fdi = Fdi(replace(FdiParams(), p_alike=p_alike))
    g = np.random.default_rng(1)
    st = None
    for i in range(30):
        y = g.standard_normal(9) * np.repeat(NOISE, 3) * 0.5 + FLOW
        if i >= 20:
            for probe, size in fault.items():
                y[3 + probe] += size
        s = (0.3, common, common)
        st = fdi.step(y, ALL, FLOW, np.zeros((9, 9)), (0.0, 0.0, 0.0), s)
    assert st is not None
    return st.isolated >> 3 & 7, fdi.unresolved >> 3 & 7, st.excluded >> 3 & 7


def test_one_that_differs_is_blamed_where_the_prediction_bears_it_out() -> None:
    assert asked({1: math.radians(0.5)}, 1.2e-3) == (0b010, 0, 0b010)


def test_two_that_lie_alike_are_found_by_the_prediction() -> None:
    assert asked({1: math.radians(0.5), 2: math.radians(0.5)}, 1.2e-3) == (0b110, 0, 0b110)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_the_prediction_cannot_tell_nobody_is_blamed_and_none_is_used(sign: float) -> None:
    pair = {1: sign * math.radians(0.3), 2: sign * math.radians(0.3)}
    assert asked(pair, 5e-3) == (0, 0b111, 0b111)
    blamed, unresolved, out = asked(pair, 5e-3, p_alike=0.0)  # not asked, the healthy third is blamed
    assert (blamed, unresolved, out) == (0b001, 0, 0b001)
