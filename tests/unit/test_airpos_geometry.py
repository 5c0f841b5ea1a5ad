"""Contours and intersections IM-1, IM-2 against plain linear algebra, scipy distances and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.distance import cdist

from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.intersect import im1, im2
from flightsw.missions.receiver.airdata.contour.lines import Lines
from flightsw.missions.receiver.airdata.contour.wake_map import load_map


def polyline(*parts: list[tuple[float, float]]) -> Lines:
    at = np.cumsum([0, *map(len, parts)]).astype(np.int64)
    return Lines(np.array([p for part in parts for p in part], dtype=float), at)


def by_linear_algebra(a: Lines, b: Lines) -> list[np.ndarray]:
    """Every proper crossing of two segments, by numpy.linalg.solve."""
    found = []
    for i in range(len(a.xy) - 1):
        for j in range(len(b.xy) - 1):
            p, r, q, s = a.xy[i], a.xy[i + 1] - a.xy[i], b.xy[j], b.xy[j + 1] - b.xy[j]
            M = np.stack([r, -s], axis=1)
            if abs(np.linalg.det(M)) < 1e-9:
                continue
            t, u = np.linalg.solve(M, q - p)
            if 0 <= t <= 1 and 0 <= u <= 1:
                found.append(p + t * r)
    return found


random_line = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=2, max_size=8)


@given(st.integers(0, 10**6))
@settings(max_examples=60)
def test_im1_finds_every_crossing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = polyline(rng.uniform(-5, 5, (7, 2)).tolist()), polyline(rng.uniform(-5, 5, (9, 2)).tolist())
    got, want = im1(a, b), by_linear_algebra(a, b)
    assert len(got) == len(want)
    if want:
        assert np.abs(got - np.array(want)).max() < 1e-9  # the same order, too: along a, then along b


@given(random_line, random_line)
@settings(max_examples=60)
def test_im1_is_symmetric_as_a_set(a: list, b: list) -> None:
    p, q = im1(polyline(a), polyline(b)), im1(polyline(b), polyline(a))
    if len(p) and len(q):
        d = cdist(p, q)
        assert d.min(axis=1).max() < 1e-3 and d.min(axis=0).max() < 1e-3


def test_im1_counts_a_shared_vertex_once_and_closed_ends() -> None:
    """Trap 12.1: two polylines through one common vertex cross once, not four times; touching ends count."""
    a = polyline([(-1, -1), (0, 0), (1, 1)])
    b = polyline([(-1, 1), (0, 0), (1, -1)])
    assert im1(a, b).tolist() == [[0.0, 0.0]]
    assert im1(polyline([(0, 0), (1, 0)]), polyline([(1, 0), (2, 3)])).tolist() == [[1.0, 0.0]]


def test_im1_drops_zero_length_segments_and_parallels() -> None:
    a = polyline([(0, 0), (0, 0), (2, 0)])
    b = polyline([(1, -1), (1, 1)])
    assert im1(a, b).tolist() == [[1.0, 0.0]]
    assert len(im1(polyline([(1, 0), (1, 0)]), b)) == 0
    assert len(im1(polyline([(0, 0), (1, 0)]), polyline([(0, 1), (1, 1)]))) == 0


def test_im1_never_joins_separate_polylines() -> None:
    """Trap 12.2: the gap between two polylines of one level is no segment."""
    gap = polyline([(-2, 0), (-1, 0)], [(1, 0), (2, 0)])
    assert len(im1(gap, polyline([(0, -1), (0, 1)]))) == 0
    assert len(im1(gap, polyline([(1.5, -1), (1.5, 1)]))) == 1


@given(st.integers(0, 10**6))
@settings(max_examples=40)
def test_im2_is_the_closest_pair_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(6, 2)), rng.normal(size=(8, 2))
    d = cdist(a, b)
    i, j = np.unravel_index(d.argmin(), d.shape)
    middle, apart = im2(a, b)
    assert apart == pytest.approx(d.min(), rel=1e-12)
    assert middle == pytest.approx((a[i] + b[j]) / 2, rel=1e-12)
    d = cdist(a, a) + 1e9 * np.eye(6)
    assert im2(a, a, same=True)[1] == pytest.approx(d.min(), rel=1e-12)


def test_im2_without_a_pair_is_infinitely_far() -> None:
    one, none = np.ones((1, 2)), np.zeros((0, 2))
    assert im2(one, none)[1] == im2(one, one, same=True)[1] == float("inf")


def test_e11_im2_is_the_cheaper_method_and_answers_without_a_crossing() -> None:
    """Erratum E11: "IM-2 is faster than IM-2" means than IM-1: one distance for a pair of vertices against the solution
    of two equations for a pair of segments. It answers even where the contours do not cross, and only once."""
    above, below = polyline([(0, 1), (1, 1.5), (2, 1)]), polyline([(0, 0), (1, 0.5), (2, 0)])
    assert len(im1(above, below)) == 0
    middle, apart = im2(above.xy, below.xy)
    assert (middle.tolist(), apart) == ([0.0, 0.5], 1.0)
    zigzag = polyline([(0, -1), (1, 1), (2, -1), (3, 1)])
    axis = polyline([(-1, 0), (4, 0)])
    assert len(im1(zigzag, axis)) == 3


@pytest.mark.parametrize("channel", range(9))
def test_contour_vertices_lie_on_the_level(channel: int) -> None:
    """The maps interpolated by scipy at the contour's vertices give the level back (linear along cell edges)."""
    m = load_map("small")
    f = RegularGridInterpolator((m.z, m.y), m.readings[channel])
    level = float(f((8.63, 0.37)))
    lines = Contours(m).lines(channel, level)
    inside = lines.xy.clip((-2, 6.5), (2, 10.5))
    assert not lines.empty
    scale = np.ptp(m.readings[channel])
    assert np.abs(f(inside[:, ::-1]) - level).max() < 1e-9 * scale


def test_e10_contour_of_a_variable_is_cut_at_that_variable() -> None:
    """Erratum E10 (Table 4.1 names the variables crosswise): A^beta passes the true position at the measured sideslip."""
    m = load_map("small")
    r, cut = m.readings[:, 12, 7], Contours(m)
    here = np.array([[m.y[7], m.z[12]]])
    for c in range(3, 9):
        assert cdist(cut.lines(c, r[c]).xy, here).min() < 1e-9
        other = c + 3 if c < 6 else c - 3
        crosswise = cut.lines(c, r[other])
        assert crosswise.empty or cdist(crosswise.xy, here).min() > 0.05


@pytest.mark.parametrize("level", [float("nan"), float("inf"), 99.0, -99.0])
def test_no_contour_where_the_level_is_not_reached(level: float) -> None:
    lines = Contours(load_map("small")).lines(4, level)
    assert lines.empty
    assert len(im1(lines, lines)) == 0
