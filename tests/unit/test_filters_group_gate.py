"""Sensors judged as groups: against the normal law, with steps, ramps, garbage and rough air made by hand."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy import stats

from flightsw.filters.gating import BENCH
from flightsw.filters.group_gate import GroupGate, sift

GROUP = np.array([0, 1, 1, 1, 2])  # a scalar sensor, a vector of three, an aid nobody misses
M = len(GROUP)
SIGMA = np.array([0.3, 1.0, 2.0, 0.5, 1.0])
SLACK = np.zeros(M)
STEP_US = 50_000


class Feed:
    """A gate fed with consistent innovations, to which a test adds."""

    def __init__(self, seed: int = 1, false_alarm: float = 1e-6) -> None:
        self.gate = GroupGate(3, M, false_alarm, watched=2)
        self.gate.restart(0)
        self.rng = np.random.default_rng(seed)
        A = self.rng.normal(size=(M, M))
        L = np.linalg.cholesky(A @ A.T + 0.3 * np.eye(M))
        self.Sy = SIGMA[:, None] * (L / np.linalg.norm(L, axis=1)[:, None])
        self.t_us = 0

    def step(self, add: np.ndarray | float = 0.0) -> tuple[list[int], bool]:
        """Positions kept, and whether the gate finds all as it should be."""
        self.t_us += STEP_US
        nu = self.Sy @ self.rng.normal(size=M) + add
        keep, quiet = self.gate.kept(GROUP, nu, self.Sy, SLACK, M, self.t_us)
        return (list(range(M)) if keep is None else keep.tolist()), quiet


def one(i: int, value: float) -> np.ndarray:
    out = np.zeros(M)
    out[i] = value
    return out


def test_sound_readings_are_refused_as_often_as_stated() -> None:
    """The recent mean takes a little of the innovation's own scatter in: sqrt(1 + a / (2 - a)) sigma, a the share of a sample."""
    p, n, refused = 0.01, 20_000, 0
    f = Feed(false_alarm=p)
    for _ in range(n):
        f.gate.groups[:, 0:2] = 0.0  # no memory of refusals: each sample by itself
        kept, _ = f.step()
        refused += 0 not in kept
    wide = np.sqrt(1.0 + 0.3 / 1.7)
    expected = 2.0 * stats.norm.sf(stats.norm.isf(0.5 * p) / wide)
    assert refused / n == pytest.approx(expected, abs=5.0 * np.sqrt(expected / n))


@pytest.mark.parametrize("wild", [50.0, -50.0, np.nan, np.inf])
def test_a_spike_takes_its_whole_sensor_out_for_one_sample_and_no_other(wild: float) -> None:
    f = Feed()
    for _ in range(50):
        assert f.step() == (list(range(M)), True)
    assert f.step(one(2, wild)) == ([0, 4], False)
    assert f.step()[0] == list(range(M))
    assert f.gate.groups[:, 2].tolist() == [0.0, 1.0, 0.0]
    assert not f.gate.held(1)
    for _ in range(25):
        quiet = f.step()[1]
    assert quiet  # forgotten


def test_a_step_is_kept_out_however_long_it_lasts_and_comes_back_by_agreement() -> None:
    f = Feed()
    for _ in range(50):
        f.step()
    for k in range(400):
        f.Sy[0] *= 1.005 if k > 4 else 1.0  # ignorance grows: that is no agreement
        assert 0 not in f.step(one(0, 6.0))[0]
        assert f.gate.held(0) == (k + 1 >= BENCH)
    assert f.gate.offsets(0)[0] == pytest.approx(6.0, abs=4.0) and f.gate.disagrees(0)
    f.Sy[0] *= SIGMA[0] / np.linalg.norm(f.Sy[0])
    back = next(k for k in range(400) if 0 in f.step()[0])
    assert 90 < back < 110


def test_how_steady_a_disagreement_is() -> None:
    step, garbage = Feed(), Feed()
    for _ in range(200):
        step.step(one(0, 6.0))
        garbage.step(one(0, float(garbage.rng.uniform(-20.0, 20.0))))
    assert step.gate.held(0) and garbage.gate.held(0)
    assert step.gate.steady(0)[0] and not garbage.gate.steady(0)[0]
    assert step.gate.offsets(0)[0] == pytest.approx(6.0, abs=0.3)


def test_what_comes_by_and_by_is_told_and_taken() -> None:
    """Innovations that grow to ten sigma within 5 s, as where another sensor is wrong: the sensor stays in use."""
    f, loud = Feed(), 0
    for k in range(300):
        kept, quiet = f.step(one(0, min(k, 100) * 0.1 * SIGMA[0]))
        loud += not quiet
        assert 0 in kept
    assert loud > 150


def test_a_group_is_taken_back_on_request_and_all_by_a_restart() -> None:
    f = Feed()
    for _ in range(20):
        f.step(one(0, 9.0) + one(3, 9.0))
    assert f.gate.held(0) and f.gate.held(1)
    f.gate.admit(0)
    assert not f.gate.held(0) and f.gate.held(1)
    counts = f.gate.groups[:, 2].copy()
    f.gate.restart(f.t_us)
    assert not f.gate.held(1) and (f.gate.groups[:, 2] == counts).all()
    assert f.step() == (list(range(M)), True)


def test_a_silent_sensor_is_missed_after_a_second_an_aid_is_not() -> None:
    f = Feed()
    f.step()
    f.t_us += 900_000
    for group, missed in ((np.array([0, 1, 1, 1]), False), (np.array([1, 1, 1, 2]), True)):
        t_us = f.t_us + STEP_US
        _, quiet = copy.deepcopy(f.gate).kept(group, np.zeros(4), np.eye(4), np.zeros(4), 4, t_us)
        assert quiet
        _, quiet = copy.deepcopy(f.gate).kept(group, np.zeros(4), np.eye(4), np.zeros(4), 4, t_us + 200_000)
        assert quiet == (not missed)


def rough(gust: float, fault: float, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """(share of the readings [3] refused, 1-sigma allowed [3]) after 30 s of three sensors in correlated gusts, the first one
    with white garbage on top."""
    rng, gate = np.random.default_rng(seed), GroupGate(3, 3, 1e-6, watched=3)
    own = np.array([0.25, 0.7, 0.9])
    for g in range(3):
        gate.share(g, 1.0)
    gate.restart(0)
    x, group, refused = np.zeros(3), np.arange(3), np.zeros(3)
    for k in range(600):
        x = 0.6 * x + 0.8 * gust * rng.normal(size=3)  # correlated by 0.6 from sample to sample
        nu = x + own * rng.normal(size=3) + np.array([fault * rng.uniform(-1.0, 1.0), 0.0, 0.0])
        kept, _ = gate.kept(group, nu, np.diag(own), np.zeros(3), 3, k * STEP_US)
        refused += 0.0 if kept is None else 1.0 - np.isin(np.arange(3), kept)
    return refused / 600.0, np.sqrt(gate.groups[:, 8])


def test_rough_air_opens_the_gate_and_garbage_of_one_sensor_does_not() -> None:
    calm, allowed = rough(0.0, 0.0)
    assert (calm == 0.0).all() and (allowed < 1.0).all()
    storm, allowed = rough(3.0, 0.0)
    assert (storm < 0.03).all() and (allowed > 1.5).all()
    garbage, _ = rough(0.0, 30.0)
    assert garbage[0] > 0.9 and (garbage[1:] == 0.0).all()


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, np.nan])
def test_a_false_alarm_probability_is_one(p: float) -> None:
    with pytest.raises(ValueError, match="false_alarm"):
        GroupGate(3, M, p, 2)


def test_compiled_and_interpreted_agree_to_the_bit() -> None:
    a, b = Feed(), Feed()
    plain = getattr(sift, "py_func", sift)
    for k in range(120):
        add = one(0, 5.0) if 20 <= k < 60 else one(3, float("nan")) if k == 80 else 0.0
        a.step(add)
        b.t_us += STEP_US
        g, nu = b.gate, b.Sy @ b.rng.normal(size=M) + add
        plain(
            GROUP, nu, b.Sy, SLACK, M, float(b.t_us), g._limit2, 2, False, g._state, g.bad, g._var, g._channel, g._keep
        )
    assert np.array_equal(a.gate._state, b.gate._state)
