"""Each place of an airframe in its own air: slopes of known fields, the lag along the body, and what its probes meet."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.wind.config import Dryden
from sim_plant.wind.extent import Field, places
from sim_plant.wind.gusts import RING, Gusts
from sim_plant.wind.span import Across
from sim_plant.world import World

Arr = NDArray[np.float64]
V, DT, SPAN = 195.0, 0.01, 40.0
PROBES = np.array([[18.0, 0.0, 0.0], [-2.0, -20.0, 0.0]])
PLACES = places(SPAN, 0.5, 17.0, -20.0, PROBES)
LINES = (0.0, *sorted({float(y) for y in PLACES.points[:, 1].round(6)} - {0.0}))


def felt(gust: Arr, k: int = 500, heading: float = 0.0) -> tuple[Arr, Arr]:
    """Effective wind [NW] and probes' air less the centre's, in a field gust[line, row] = (n, e, d) laid beforehand."""
    g = Gusts("test", Dryden(sigma_mps=1.0, over="field"), 1, DT, 0, 7010.0, Across(LINES), 20)
    g.rings[:] = gust
    s, wind, probe = np.zeros(n.NS), np.zeros(n.NW), np.zeros((len(PROBES), 3))
    s[0], s[3] = math.cos(0.5 * heading), math.sin(0.5 * heading)
    Field(PLACES, g, V * DT).turn(s, k, 0.0, wind, probe)
    return wind, probe


def test_air_alike_everywhere_adds_nothing() -> None:
    wind, probe = felt(np.broadcast_to(np.array([1.0, -2.0, 3.0]), (len(LINES), RING, 3)))
    assert not wind.any() and not probe.any()


def test_slopes_of_a_field_linear_in_place_are_its_rates() -> None:
    """w = a x + b y, v = c x: p = b, q = -a, r = c exactly, nothing in the mean but at the wing's and fuselage's middles."""
    a, b, c, k = 0.01, -0.02, 0.03, 500
    x = (np.arange(RING) - k) * V * DT  # row k is met at the centre, later ones ahead
    field = np.zeros((len(LINES), RING, 3))
    field[:, :, 1] = c * x
    field[:, :, 2] = a * x + b * np.array(LINES)[:, None]
    wind, probe = felt(field, k)
    assert np.allclose(wind[n.W_ROT :], (b, -a, c))
    off = 0.8 * 0.5 + 0.1 * (17.0 - 20.0)  # of the weighted places ahead of the centre [m]
    assert np.allclose(wind[:3], (0.0, c * off, a * off))
    assert np.allclose(probe[:, 2], a * PROBES[:, 0] + b * PROBES[:, 1])
    east, _ = felt(field[:, :, [1, 0, 2]] * np.array([-1.0, 1.0, 1.0]), k, 0.5 * math.pi)  # the same, heading east
    assert np.allclose(east[n.W_ROT :], wind[n.W_ROT :])


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_three_stations_are_enough_for_an_elliptic_load(degree: int) -> None:
    """Mean of w = (2y/b)^n over an elliptic load, Wallis: 0 for odd n; 1/4 for n = 2, 1/8 for n = 4."""
    field = np.zeros((len(LINES), RING, 3))
    field[:, :, 2] = (2.0 * np.array(LINES)[:, None] / SPAN) ** degree
    assert felt(field)[0][2] == pytest.approx(0.8 * {2: 0.25, 4: 0.125}.get(degree, 0.0), abs=1e-6)


def test_a_follower_beyond_what_is_kept_meets_the_oldest_air_and_not_what_is_laid_ahead() -> None:
    """3 km behind in gusts that grow by 1 m/s a tick: the centre's is from the far end of the buffer."""
    sets = {"wind.dryden.over": "field", "wind.wake.source": "", "aircraft.receiver.start.xi_m": [-3000.0, 0.0, 8.5]}
    w = World(load_scenario("refueling", sets))
    g = w.air._gusts["receiver"]
    w.sense()
    rows = np.arange(RING)
    g.rings[:, rows % RING, 2] = (g.ahead - (g.ahead - rows) % RING).astype(float)  # row k + ahead, ..., the oldest
    w.air.step(w.members[1], 0)
    gust = w.members[1].free[2] - w.members[1].calm[2]
    assert gust == pytest.approx(-g.most) and g.most == RING - 2 - 2 * g.ahead > 950


def test_probes_in_flight_meet_the_gusts_of_their_own_places() -> None:
    """Receiver, a second of light turbulence: what the nose meets the centre does x / V later; tips differ; and without
    extent all meet the same."""
    for over in ("field", "point"):
        sets = {"wind.dryden.sigma_mps": 2.0, "wind.dryden.over": over, "wind.wake.source": ""}
        w = World(load_scenario("refueling", sets))
        m, rows = w.members[1], []
        for _ in range(100):
            w.sense()
            rows.append(np.vstack([m.free, m.free + m.probe_wake]))
            w.step([w.trim_cmd(0), w.trim_cmd(1)])
        x = np.array(rows)
        if over == "point":
            assert np.array_equal(x[:, 0], x[:, 1]) and not m.wind[n.W_ROT :].any()
            continue
        ticks = m.probes[0, 0] / (V * DT)
        shifted = np.interp(np.arange(10.0, 90.0), np.arange(100) + ticks, x[:, 1, 2])
        assert np.corrcoef(shifted, x[10:90, 0, 2])[0, 1] > 0.999
        assert np.sqrt(np.mean((shifted - x[10:90, 0, 2]) ** 2)) < 0.02
        assert np.std(x[:, 2, 2] - x[:, 3, 2]) > 0.05  # tip from tip
        assert m.wind[n.W_ROT :].all()
