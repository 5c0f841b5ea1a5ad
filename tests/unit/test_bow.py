"""The bow wave of a follower: its body against the Rankine oval, its lift against the horseshoe, and what a leader feels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from flightsw.aircraft import Aircraft, load_airframe
from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.wind.vortex import K_BODY, K_WING, wake_velocity
from sim_plant.wind.vortex import oval as induced
from sim_plant.wind.wake import bow_vector, oval
from sim_plant.world import World

RECEIVER = load_airframe("learjet24")
assert isinstance(RECEIVER, Aircraft)
V = 195.0


@pytest.mark.parametrize(("half", "radius"), [(6.35, 0.75), (6.35, 1.2), (2.0, 1.5)])
def test_the_oval_is_as_long_and_thick_as_it_is_said(half: float, radius: float) -> None:
    """The air stands still at its nose and tail, and the source's flux fills its middle, by quadrature."""
    area, a = oval(half, radius)
    for x in (half, -half):
        assert induced(x, 0.0, 0.3, V * area, a, -a, 0.3)[0] == pytest.approx(V, rel=1e-4)
    through = quad(lambda y: 2.0 * math.pi * y * (V - induced(0.0, y, 0.0, V * area, a, -a, 0.0)[0]), 0.0, radius)[0]
    assert through == pytest.approx(V * area, rel=1e-4)


def test_ahead_of_the_nose_it_is_the_blunt_bodys_source() -> None:
    """A long oval's nose is half a radius ahead of its source: V (R / 2 d)^2 at distance d from that (Rankine half-body)."""
    area, a = oval(60.0, 0.75)
    assert 60.0 - a == pytest.approx(0.375, rel=0.01)
    for d in (1.0, 3.0, 9.0):
        assert induced(a + d, 0.0, 0.0, V * area, a, -a, 0.0)[0] == pytest.approx(V * (0.375 / d) ** 2, rel=0.02)
        _, v, w = induced(a, d * 0.6, -d * 0.8, V * area, a, -a, 0.0)
        assert math.hypot(v, w) == pytest.approx(V * (0.375 / d) ** 2, rel=0.02) and v / w == pytest.approx(-0.75)


def test_far_ahead_lift_is_an_upwash_of_its_moment() -> None:
    """Of a horseshoe of moment Gamma b, at x ahead on its axis: the bound vortex less the trailing ones, Gamma b / (8 pi x^2) far
    away; the body's part apart."""
    src, obs = bow_vector(RECEIVER, 1e-3, 0.0), np.zeros(n.NO)
    assert src[K_BODY] > 0.0 and src[K_WING + 3] == pytest.approx(math.pi / 4.0 * 10.363)
    obs[n.O_V], obs[n.O_RHO], obs[n.O_MASS] = V, 0.59, 5000.0
    obs[n.O_LIFT] = 5000.0 * n.G0
    body = np.array(wake_velocity(60.0, 0.0, 0.0, obs * np.where(np.arange(n.NO) == n.O_LIFT, 0.0, 1.0), src))
    up = body[2] - wake_velocity(60.0, 0.0, 0.0, obs, src)[2]
    moment = obs[n.O_LIFT] / (0.59 * V)  # gamma b
    x, half = 60.0, 0.5 * float(src[K_WING + 3])
    r = math.hypot(x, half)
    assert up == pytest.approx(moment / (4.0 * math.pi * half) * (half / (x * r) - (1.0 - x / r) / half), rel=1e-3)
    assert up == pytest.approx(moment / (8.0 * math.pi * x**2), rel=0.01)


def test_a_leader_feels_it_and_only_when_it_is_asked_for() -> None:
    """At contact: a few hundredths of upwash in the mean, more at the tail; a follower far behind is not felt."""
    felt = {}
    for key, xi in (("near", [-36.0, 0.0, 8.5]), ("far", [-400.0, 0.0, 8.5])):
        for on in ("", "receiver"):
            w = World(load_scenario("refueling", {"aircraft.receiver.start.xi_m": xi, "wind.bow.source": on}))
            w.sense()
            felt[key, on] = np.concatenate([w.members[0].wind, w.members[0].probe_wake.ravel()])
    near, far = (felt[k, "receiver"] - felt[k, ""] for k in ("near", "far"))
    assert -0.1 < near[2] < -0.01 and near[n.W_ROT + 1] < -1e-3
    assert np.abs(far).max() < 1e-3
    assert near[n.NW :].any() and not felt["near", ""][n.NW :].any()


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        ({"wind.bow.source": "tanker"}, r"wind\.bow\.source.*receiver"),
        ({"wind.bow.radius_m": 1.0}, r"wind\.bow\.radius_m.*without wind\.bow\.source"),
        ({"wind.bow.source": "receiver", "wind.bow.radius_m": 20.0}, r"wind\.bow\.radius_m = 20.*allowed: above 0"),
    ],
)
def test_what_cannot_be_is_refused(sets: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        World(load_scenario("refueling", sets))
