"""The sixteen algorithms over whole grids: the table of sevil.md section 8.1, on and off the nodes; disturbed readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flightsw.missions.receiver.airdata.contour.algorithms import ALGORITHMS, Algorithm, Crossings, locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.wake_map import load_map
from hil_scripts.studies.sevil.metrics import Metrics, evaluate
from hil_scripts.studies.sevil.wake_map import expected_readings

SMALL, EXTENDED = load_map("small"), load_map("extended")
CUT = {"small": Contours(SMALL), "extended": Contours(EXTENDED)}


def run(
    name: str, points: np.ndarray, readings: np.ndarray, algorithms: list[int | Algorithm], gate: float = np.inf
) -> list[Metrics]:
    est = np.full((len(algorithms), len(points), 2), np.nan)
    for i, r in enumerate(readings):
        found = Crossings(CUT[name], r)
        for k, a in enumerate(algorithms):
            if (p := locate(a, found, gate=gate)) is not None:
                est[k, i] = p
    return [evaluate(points, e) for e in est]


def on_nodes(name: str, algorithms: list[int | Algorithm], gate: float = np.inf) -> list[Metrics]:
    m = SMALL if name == "small" else EXTENDED
    return run(name, m.nodes(), m.readings.reshape(9, -1).T, algorithms, gate)


def off_nodes(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-2, 6.5), (2, 10.5), (n, 2))


def test_small_grid_on_its_own_nodes() -> None:
    """Cumulative error [m] and points without a position, all sixteen (sevil.md section 8.1)."""
    got = on_nodes("small", list(range(1, 17)))
    ce = [42.0, 22.6, 6.4, 6.4, 0, 0, 0, 3.0, 3.06, 3.06, 3.06, 0, 0, 3.0, 3.06, 3.06]
    none = [4, 4, 4, 4, 97, 14, 6, 2, 0, 0, 0, 5, 5, 0, 2, 2]
    assert [m.n - m.estimated for m in got] == none
    assert [m.ce_m for m in got] == pytest.approx(ce, abs=0.05)
    assert got[10].worst_m == pytest.approx(1.53, abs=0.01)  # the two corners at z = 10.5


def test_extended_grid_on_its_own_nodes() -> None:
    """Algorithms 11 and 15: exact but for four nodes, 53 m in all; Algorithm 1 is of no use (sevil.md section 8.1)."""
    a1, a8, a11, a12, a15 = on_nodes("extended", [1, 8, 11, 12, 15])
    assert (a11.estimated, a11.ce_m, a11.worst_m) == pytest.approx((1533, 53.0, 20.51), abs=0.05)
    assert a15.ce_m == a11.ce_m
    assert (a1.ce_m, a8.ce_m, a12.ce_m) == pytest.approx((44034, 215.2, 41058), rel=1e-3)
    strict = replace(ALGORITHMS[11], several="discard", single="discard")
    (both,) = on_nodes("extended", [strict])
    (gated,) = on_nodes("extended", [strict], gate=0.1)
    assert both.n - both.estimated == 3  # as many as the source reports
    assert (gated.n - gated.estimated, gated.worst_m) == (7, pytest.approx(0.0, abs=1e-6))


def test_e18_off_the_nodes_the_ranking_is_another() -> None:
    """Erratum E18: at a node every contour passes through the node, so the error there is zero by construction. Between
    nodes Algorithms 11 and 15 keep a millimetre, IM-2 (14) and two-contour algorithms (1, 2) do not."""
    points = off_nodes(441)
    a1, a11, a14, a15 = run("small", points, expected_readings(SMALL.spec, points), [1, 11, 14, 15])
    on11, on14 = on_nodes("small", [11, 14])
    assert on11.median_m < 1e-9 and on14.median_m < 1e-9
    assert 1e-4 < a11.median_m < 1e-3 and a11.rms_m < 2e-3
    assert a11.ce_m == pytest.approx(0.32, abs=0.05) and a15.ce_m == pytest.approx(a11.ce_m, abs=0.05)
    assert a14.ce_m == pytest.approx(19, abs=2)
    assert a1.ce_m == pytest.approx(27, abs=8)


def test_disturbance_trends() -> None:
    """Noise takes positions away and makes the rest worse; 15 estimates fewer points than 11; a longer mean helps against
    noise and not against wind (sevil.md section 8.2)."""
    points, rng = off_nodes(300, 3), np.random.default_rng(8)
    clean, noise = expected_readings(SMALL.spec, points), np.zeros((300, 9))
    noise[:, 3:] = rng.normal(size=(300, 6)) * np.radians(np.sqrt(0.002))
    short = run("small", points, clean + noise / np.sqrt(20), [11, 15])
    long = run("small", points, clean + noise / np.sqrt(500), [11, 15])
    assert short[0].none < short[1].none < 0.2
    assert 0.3 < short[0].rms_m < 0.7
    assert long[0].none < 0.5 * short[0].none and long[0].rms_m < 0.5 * short[0].rms_m
    windy = expected_readings(SMALL.spec, points, np.array([0.0, 1.0, 0.0]))
    across = run("small", points, windy, [11, 15])
    assert across[0].rms_m == pytest.approx(1.1, abs=0.1)  # one metre per second across: a metre off, and no sign of it
    assert across[0].none < 0.01
