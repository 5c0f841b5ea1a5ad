"""Refusal of single readings: against the chi-square law of innovations, with wild, garbage and recovering channels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from flightsw.filters.gating import BENCH, CAP, DECAY, ChannelGate

CODES = np.arange(4)


def gate(limit: float = 6.0, most: int = 2) -> ChannelGate:
    return ChannelGate(4, limit, most)


def correlated(seed: int) -> tuple[np.ndarray, np.random.Generator]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(4, 4))
    return np.linalg.cholesky(A @ A.T + 0.1 * np.eye(4)), rng


def test_consistent_innovations_are_refused_as_often_as_the_normal_law_says() -> None:
    """Limit 2 sigma on correlated innovations: each channel's own marginal counts, whatever the correlation."""
    Sy, rng = correlated(0)
    g, refused, n = ChannelGate(4, 2.0, 4), 0, 20_000
    for _ in range(n):
        g.reset()
        keep = g.kept(CODES, Sy @ rng.normal(size=4), Sy, 4)
        assert keep is not None
        refused += 4 - len(keep)
    p = 2.0 * stats.norm.sf(2.0)
    assert refused / (4 * n) == pytest.approx(p, abs=5.0 * np.sqrt(p / (4 * n)) * 2.0)


@pytest.mark.parametrize("wild", [1e3, -1e3, np.nan, np.inf])
def test_a_wild_reading_goes_and_the_others_stay(wild: float) -> None:
    Sy, rng = correlated(1)
    nu = Sy @ rng.normal(size=4)
    nu[2] = wild
    keep = gate().kept(CODES[::-1].copy(), nu, Sy, 4)
    assert keep is not None and keep.tolist() == [0, 1, 3]


def test_too_many_at_once_are_the_filter_s_fault() -> None:
    Sy, _ = correlated(2)
    g = gate(most=2)
    assert g.kept(CODES, np.array([1e3, 1e3, 1e3, 0.0]), Sy, 4) is None
    assert not g.score.any()  # no channel is blamed
    assert g.kept(CODES, np.array([1e3, 1e3, 0.0, 0.0]), Sy, 4).tolist() == [2, 3]  # type: ignore[union-attr]


def test_garbage_is_benched_and_forgiven_after_it_has_agreed_for_long() -> None:
    g, Sy, bad = gate(), np.eye(4), np.array([0.0, 10.0, 0.0, 0.0])
    for i in range(int(BENCH)):
        assert g.benched == []
        g.kept(CODES, bad, Sy, 4)
        assert g.score[1] == -(i + 1) or abs(g.score[1]) == i + 1
    assert g.benched == [1]
    for _ in range(100):
        g.kept(CODES, bad, Sy, 4)
    calm = np.zeros(4)
    for _ in range(round(CAP / DECAY) - 2):  # agreeing by chance does not bring it back
        assert g.kept(CODES, calm, Sy, 4).tolist() == [0, 2, 3]  # type: ignore[union-attr]
    for _ in range(4):
        keep = g.kept(CODES, calm, Sy, 4)
    assert keep is not None and keep.tolist() == [0, 1, 2, 3] and g.benched == []


def test_a_single_refusal_does_not_bench() -> None:
    g, Sy = gate(), np.eye(4)
    g.kept(CODES, np.array([0.0, 10.0, 0.0, 0.0]), Sy, 4)
    assert g.kept(CODES, np.zeros(4), Sy, 4).tolist() == [0, 1, 2, 3]  # type: ignore[union-attr]
    g.reset()
    assert not g.score.any()


@pytest.mark.parametrize("bad", [(0, 6.0, 1), (4, 0.0, 1), (4, float("nan"), 1), (4, 6.0, 0)])
def test_bad_numbers_are_named(bad: tuple[int, float, int]) -> None:
    with pytest.raises(ValueError, match=f"limit = {bad[1]}"):
        ChannelGate(*bad)
