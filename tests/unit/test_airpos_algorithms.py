"""Algorithms 1-16: the corrected table, every rule on made-up candidates, errata E9, E12, E17, E19, metrics."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from flightsw.missions.receiver.airdata.contour.algorithms import ALGORITHMS, Crossings, decide, locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.intersect import MERGE_M, im1
from flightsw.missions.receiver.airdata.contour.lines import Lines
from flightsw.missions.receiver.airdata.contour.wake_map import load_map
from hil_scripts.studies.sevil.metrics import evaluate, weights
from hil_scripts.studies.sevil.wake_map import make_map

NONE = np.zeros((0, 2))
ONE = np.array([[1.0, 7.0]])
MANY = np.array([[1.0, 7.0], [2.0, 8.0], [2.0, 8.04], [-1.0, 9.0]])
CLOSEST = (2.0, 8.02)
FIRST, LAST = (1.0, 7.0), (-1.0, 9.0)

# Table 4.2: contours, intersection method, rule for several from one set, rule for one from one set
TABLE = """
1 b 23 IM-1 first keep | 2 b 23 IM-1 last keep | 3 a 23 IM-1 first keep | 4 a 23 IM-1 last keep
5 b 23 IM-1 discard keep | 6 a 23 IM-1 discard keep | 7 ba 23 IM-1 discard discard | 8 ba 23 IM-1 first keep
9 ba 123 IM-1 last keep | 10 ba 123 IM-1 first keep | 11 ba 123 IM-1 closest keep | 12 ba 1 IM-1 first keep
13 ba 1 IM-1 last keep | 14 ba 123 IM-2 first keep | 15 ba 123 IM-1 closest discard | 16 ba 123 IM-1 first discard
"""


def test_table_of_algorithms() -> None:
    rows = [row.split() for row in TABLE.replace("\n", "|").split("|") if row.strip()]
    assert [int(r[0]) for r in rows] == list(ALGORITHMS) == list(range(1, 17))
    for number, variables, probes, method, several, single in rows:
        a = ALGORITHMS[int(number)]
        assert (a.beta, a.alpha) == ("b" in variables, "a" in variables)
        assert "".join(map(str, a.probes)) == probes
        assert (a.method, a.several, a.single) == (method, several, single)


RESULT = {"first": FIRST, "last": LAST, "closest": CLOSEST, "discard": None}


@pytest.mark.parametrize("number", range(1, 17))
def test_rule_for_candidates_from_one_set(number: int) -> None:
    a = ALGORITHMS[number]
    for beta, alpha in ((MANY, NONE), (NONE, MANY)):
        got = decide(a, beta, alpha)
        want = RESULT[a.several]
        assert got == (None if want is None else pytest.approx(want))
    for beta, alpha in ((ONE, NONE), (NONE, ONE)):
        assert decide(a, beta, alpha) == (FIRST if a.single == "keep" else None)
    assert decide(a, NONE, NONE) is None


@pytest.mark.parametrize("number", [8, 9, 10, 11, 14, 15, 16])
def test_both_sets_give_the_middle_of_the_closest_pair(number: int) -> None:
    alpha = np.array([[5.0, 5.0], [-1.0, 9.6]])
    assert decide(ALGORITHMS[number], MANY, alpha) == pytest.approx((-1.0, 9.3))
    assert decide(ALGORITHMS[number], MANY, alpha, gate=0.1) is None
    assert decide(ALGORITHMS[number], MANY, alpha, gate=0.7) is not None


def test_algorithm_7_wants_the_two_sets_to_coincide() -> None:
    assert decide(ALGORITHMS[7], MANY, np.array([[-1.0, 9.05]])) == pytest.approx((-1.0, 9.025))
    assert decide(ALGORITHMS[7], MANY, np.array([[-1.0, 9.2]])) is None


@pytest.mark.parametrize("number", [11, 15])
def test_closest_of_one_set_only_below_epsilon(number: int) -> None:
    assert decide(ALGORITHMS[number], MANY, NONE, epsilon=0.03) is None
    assert decide(ALGORITHMS[number], MANY, NONE, epsilon=0.05) == pytest.approx(CLOSEST)


def test_e12_algorithms_8_and_9_follow_the_table() -> None:
    """Erratum E12: the text of Algorithms 8 and 9 says nothing of candidates from one variable only; Table 4.2 does:
    keep one; of several the first (8) or the last (9) found. By the text alone both would give nothing."""
    assert decide(ALGORITHMS[8], ONE, NONE) == decide(ALGORITHMS[9], NONE, ONE) == FIRST
    assert decide(ALGORITHMS[8], MANY, NONE) == FIRST
    assert decide(ALGORITHMS[9], MANY, NONE) == LAST


def test_e19_three_pairwise_loops_give_what_the_triple_loop_gives() -> None:
    """Erratum E19: the printed triple loop over the segments of three contours finds each crossing of a pair once per
    segment of the third contour; three loops over pairs find the same set with the work of the pairs alone."""
    m = load_map("small")
    cut, r, here = Contours(m), m.readings[:, 9, 6], np.array([m.y[6], m.z[9]])
    near = []
    for q in range(3):
        c = cut.lines(3 + q, float(r[3 + q]))
        parts = [c.xy[i : i + 2] for k in range(len(c.at) - 1) for i in range(c.at[k], c.at[k + 1] - 1)]
        parts = sorted(parts, key=lambda s: float(np.hypot(*(s.mean(axis=0) - here))))[:10]
        near.append([Lines(np.ascontiguousarray(s), np.array([0, 2])) for s in parts])
    triple: list[np.ndarray] = []
    for segments in itertools.product(*near):
        for p, q2 in itertools.combinations(segments, 2):
            triple += [x for x in im1(p, q2) if all(np.hypot(*(x - y)) > MERGE_M for y in triple)]
    pairwise: list[np.ndarray] = []
    for s, t in itertools.combinations(near, 2):
        for p, q2 in itertools.product(s, t):
            pairwise += [x for x in im1(p, q2) if all(np.hypot(*(x - y)) > MERGE_M for y in pairwise)]
    assert len(pairwise) >= 1
    assert np.array(sorted(map(tuple, pairwise))) == pytest.approx(np.array(sorted(map(tuple, triple))))
    union = Crossings(cut, r).union(3, ALGORITHMS[11])
    assert np.hypot(*(union - here).T).min() < 1e-9
    assert len(union) >= 3  # the node is a crossing of each of the three pairs: not merged across pairs


def test_planar_maps_are_inverted_exactly() -> None:
    """Maps that are planes have straight contours: every algorithm that crosses them returns the point itself."""
    m = load_map("small")
    Y, Z = np.meshgrid(m.y, m.z)
    rng = np.random.default_rng(4)
    k = rng.normal(size=(9, 2))
    m = type(m)(m.spec, m.y, m.z, np.ascontiguousarray(np.stack([a * Y + b * Z for a, b in k])))
    cut = Contours(m)
    for y, z in rng.uniform((-1, 7.5), (1, 9.5), (20, 2)):
        found = Crossings(cut, k @ (y, z))
        for number in (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 16):
            assert locate(number, found) == pytest.approx((y, z), abs=1e-9)


@pytest.mark.parametrize("number", [6, 7, 9, 11, 12, 15])
def test_mirrored_readings_give_the_mirrored_position(number: int) -> None:
    m = make_map(load_map("small").spec)
    cut = Contours(m)
    r = 0.7 * m.readings[:, 12, 14] + 0.3 * m.readings[:, 13, 15]
    mirrored = r[[0, 2, 1, 3, 5, 4, 6, 8, 7]] * np.array([1, 1, 1, -1, -1, -1, 1, 1, 1])
    a, b = locate(number, cut, r), locate(number, cut, mirrored)
    assert a is not None and b is not None
    assert b == pytest.approx((-a[0], a[1]), abs=1e-6)


def test_readings_that_are_not_finite_give_no_position() -> None:
    cut = Contours(load_map("small"))
    for number in ALGORITHMS:
        assert locate(number, cut, np.full(9, np.nan)) is None


def test_same_readings_same_bytes() -> None:
    m = load_map("small")
    r = m.readings[:, 3, 5] * 1.01
    runs = [[locate(n, Contours(m), r) for n in ALGORITHMS] for _ in range(2)]
    assert runs[0] == runs[1]
    assert runs[0] == [locate(n, m, r) for n in ALGORITHMS]


def test_errors_name_value_and_what_is_allowed() -> None:
    cut = Contours(load_map("small"))
    with pytest.raises(ValueError, match="algorithm = 17: allowed 1 to 16"):
        locate(17, cut, np.zeros(9))
    with pytest.raises(ValueError, match="readings: 6 values; allowed: 9"):
        locate(11, cut, np.zeros(6))
    with pytest.raises(ValueError, match="estimate: shape"):
        evaluate(np.zeros((3, 2)), np.zeros((2, 2)))


def test_metrics_by_hand() -> None:
    truth = np.array([[0.0, 8.5], [2.0, 8.5], [1.0, 9.0]])
    guess = np.array([[0.3, 8.9], [math.nan, math.nan], [1.0, 8.0]])
    m = evaluate(truth, guess)
    assert (m.n, m.estimated) == (3, 2)
    assert m.ce_m == pytest.approx(1.5)
    assert m.wce_m == pytest.approx(0.5 * 1.0 + 1.0 * 0.55)
    assert m.rms_m == pytest.approx(math.sqrt(1.25 / 2))
    assert (m.median_m, m.worst_m) == pytest.approx((0.75, 1.0))


def test_e09_estimation_ratio_is_best_at_one_its_complement_at_zero() -> None:
    """Erratum E9: equation 4.2 is M / N, best at 1; the figures and their text ("best at 0") are 1 - ER. Both are kept."""
    truth = np.zeros((4, 2)) + (0.0, 8.5)
    part = np.vstack([truth[:3], np.full((1, 2), np.nan)])
    assert (evaluate(truth, truth).er, evaluate(truth, truth).none) == (1.0, 0.0)
    assert (evaluate(truth, part).er, evaluate(truth, part).none) == (0.75, 0.25)
    assert evaluate(truth, np.full((4, 2), np.nan)).none == 1.0


def test_e17_weighted_ratio_over_n_cannot_reach_one() -> None:
    """Erratum E17: with every point estimated the printed WER is the mean weight, 0.3714 on the 441 nodes, and so not 1;
    over the sum of the weights it is 1. With unit weights both are ER."""
    nodes = load_map("small").nodes()
    full = evaluate(nodes, nodes)
    assert full.wer == pytest.approx(0.3714, abs=5e-5)
    assert full.wer_normalised == 1.0
    part = nodes.copy()
    part[::3] = np.nan
    m = evaluate(nodes, part, np.ones(441))
    assert m.wer == m.wer_normalised == m.er


def test_weights_fall_from_one_at_contact_to_a_tenth_at_the_edge() -> None:
    p = np.array([[0.0, 8.5], [2.0, 8.5], [0.0, 6.5], [2.0, 10.5], [1.0, 8.5], [50.0, 0.0]])
    assert weights(p) == pytest.approx([1.0, 0.1, 0.1, 0.1, 0.55, 0.1])
