"""Outcomes of the fault matrix on tracks made by hand, at their edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil_scripts.studies.integrity.honest import Bounds, honest
from hil_scripts.studies.integrity.judge import KEEP_OUT_M, Outcome, Track, judge, longest

T = np.arange(0.0, 20.0, 0.05)
LIMIT = 2.0


def track(
    off: float = 0.3, at: float = math.inf, said: float = math.inf, left: float = math.inf, **more: object
) -> Track:
    """`off` m from the station, 3 m from `at` s on."""
    away = np.where(at <= T, 3.0, off)
    none = np.zeros(len(T), dtype=bool)
    parts: dict[str, object] = {"gap": np.full(len(T), 11.1), "over": none, "beyond": none, "lost": False}
    return Track(T, away, announced_s=said, left_s=left, **(parts | more))  # type: ignore[arg-type]


def during(start: float, stop: float) -> np.ndarray:
    return (start - 0.01 <= T) & (stop + 0.01 >= T)


@pytest.mark.parametrize(
    ("flown", "outcome"),
    [
        (track(), Outcome.KEPT),
        (track(off=LIMIT), Outcome.KEPT),  # at the limit is not beyond it
        (track(said=3.0), Outcome.KEPT),  # said, and flown through
        (track(said=3.0, left=3.0), Outcome.LEFT),
        (track(at=5.0, said=3.0, left=4.0), Outcome.LEFT),
        (track(at=5.0, said=5.0, left=5.0), Outcome.LEFT),  # in the same moment
        (track(at=5.0, said=3.0, left=6.0), Outcome.LEFT),  # said before, left within the time to alert
        (track(at=5.0, said=3.0, left=6.5), Outcome.LATE),  # said before, left too late
        (track(at=5.0, said=3.0), Outcome.LATE),  # said before, never left
        (track(at=5.0, said=5.05, left=5.05), Outcome.LATE),
        (track(at=5.0, said=6.0, left=6.0), Outcome.LATE),  # within the time to alert
        (track(at=5.0, said=6.05, left=6.05), Outcome.SILENT),
        (track(at=5.0), Outcome.SILENT),
        (track(at=19.5), Outcome.LATE),  # the flight ends before the time to alert is over
        (track(gap=np.where(T < 3.0, 11.1, KEEP_OUT_M)), Outcome.KEPT),
        (track(gap=np.where(T < 3.0, 11.1, KEEP_OUT_M - 0.01)), Outcome.KEEP_OUT),
        (track(over=during(3.0, 3.0), said=1.0, left=1.0), Outcome.KEEP_OUT),
        (track(beyond=during(3.0, 3.95)), Outcome.KEPT),
        (track(beyond=during(3.0, 4.05)), Outcome.UPSET),
        (track(beyond=during(3.0, 3.6) | during(4.0, 4.6)), Outcome.KEPT),  # not a second without a break
        (track(lost=True), Outcome.LOST),
    ],
)
def test_outcome(flown: Track, outcome: Outcome) -> None:
    assert judge(flown, LIMIT) is outcome


def test_the_worst_of_several_counts() -> None:
    """Silent in the keep-out is a keep-out violated; upset besides: upset; lost besides: lost."""
    near = np.full(len(T), 1.0)
    assert judge(track(at=5.0, gap=near), LIMIT) is Outcome.KEEP_OUT
    assert judge(track(at=5.0, gap=near, beyond=during(6.0, 9.0)), LIMIT) is Outcome.UPSET
    assert judge(track(at=5.0, gap=near, beyond=during(6.0, 9.0), lost=True), LIMIT) is Outcome.LOST


def test_longest_time_without_a_break() -> None:
    assert longest(T, during(2.0, 5.0) | during(7.0, 8.0)) == pytest.approx(3.0)
    assert longest(T, np.zeros(len(T), dtype=bool)) == 0.0


def test_a_bound_is_honest_that_holds_until_it_is_announced() -> None:
    """Errors over the bound, pos 0.5 m from a truth that moves: of the worst axis, at the bound's time; after the announcement
    nothing is asked of it, and without bounds nothing is said."""
    b = Bounds()
    assert honest(*b.ratios(), math.inf) == {}
    for k in range(5):
        b.see(1_000_000 * k, (1.0 * k, 0.0, -2.0))
    for t, pl in ((0.5, 1.0), (1.5, 0.5), (2.5, 0.4), (9.0, 0.1)):
        b.hear({"time_usec": round(1e6 * t), "pos": (t, 0.2, -2.5), "pl": (9.0, 1.0, pl)})
    t, ratio = b.ratios()
    assert t.tolist() == [0.5, 1.5, 2.5] and ratio == pytest.approx([0.5, 1.0, 1.25])
    assert honest(t, ratio, 2.0) == {"honest": 1.0, "bound.held_pct": 100.0, "bound.ratio_max": pytest.approx(1.0)}
    assert honest(t, ratio, math.inf)["honest"] == 0.0 and honest(t, ratio, math.inf)[
        "bound.held_pct"
    ] == pytest.approx(200 / 3)
