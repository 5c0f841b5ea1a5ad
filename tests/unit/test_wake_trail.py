"""A wake where it was flown: against the straight horseshoe, the circle flown, the pair's descent, its air's drift and decay."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft, load_airframe
from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.wind.config import Wake
from sim_plant.wind.trail import AWAY, RING, Trail, lifespan
from sim_plant.wind.trail_kernel import trail_on_airframe, trail_velocity
from sim_plant.wind.vortex import K_NU, K_TAIL, K_WING, source_strength, wake_on_airframe
from sim_plant.wind.wake import source_vector
from sim_plant.world import World

Arr = NDArray[np.float64]
V, DT, CALM = 195.0, 0.01, np.zeros(3)
FLOWN = Wake(source="tanker", path="flown")
STRAIGHT = Wake(source="tanker", path="flown", sink=False)
TANKER = load_airframe("kc135r")
assert isinstance(TANKER, Aircraft)
SRC = source_vector(TANKER, 1.2, 0.6, 1.0, -0.05)
B = float(SRC[K_WING + 3])
LEVEL = np.array([1.0, 0.0, 0.0])  # weight of a point: all of its air in the mean, nothing in the slopes


def tanker() -> tuple[Arr, Arr]:
    """State and observation of 120 t heading north, level, at 7010 m."""
    s, obs = np.zeros(n.NS), np.zeros(n.NO)
    s[0], s[n.S_V], s[n.S_P + 2] = 1.0, V, -7010.0
    obs[n.O_V], obs[n.O_RHO], obs[n.O_MASS], obs[n.O_LIFT] = V, 0.59, 120e3, 120e3 * n.G0
    return s, obs


def begun(cfg: Wake, calm: Arr = CALM) -> tuple[Trail, Arr, Arr, float]:
    """A trail of always level flight, who shed it, and the sink rate of its pair far behind [m/s]."""
    s, obs = tanker()
    t = Trail(cfg, SRC, DT)
    s[n.S_V : n.S_V + 3] += calm
    t.begin(s, obs, calm)
    return t, s, obs, source_strength(obs, SRC)[0] / (2.0 * math.pi * B)


def met(t: Trail | None, s: Arr, obs: Arr, at: tuple[float, float, float]) -> Arr:
    """Velocity [3] (m/s, NED) at a point [m] of the shedder's axes."""
    r, wind, probe = s.copy(), np.zeros(n.NW), np.zeros((0, 3))
    r[n.S_P : n.S_P + 3] += at
    one = np.zeros((1, 3)), LEVEL[None, :], 0, 1
    if t is None:
        wake_on_airframe(s, obs, SRC, r, *one, wind, probe)
    else:
        trail_on_airframe(s, obs, SRC, t.parts, r, *one, wind, probe)
    return wind[:3]


REGION = [(x, y, z) for x in (-42.0, -36.0, -30.0) for y in (-4.0, 0.0, 4.0) for z in (5.5, 8.5, 11.5)]


@pytest.mark.parametrize("cfg", [STRAIGHT, FLOWN, Wake(source="tanker", path="flown", edr_m2ps3=1e-3)])
def test_level_flight_leaves_the_contact_region_as_the_horseshoe_has_it(cfg: Wake) -> None:
    """Its mean within 0.05 m/s, every point of it within 0.1; without sinking nothing differs but the ageing of a piece."""
    t, s, obs, _ = begun(cfg)
    d = np.array([met(t, s, obs, at) - met(None, s, obs, at) for at in REGION])
    assert np.abs(d.mean(axis=0)).max() < (0.01 if cfg is STRAIGHT else 0.05)
    assert np.abs(d).max() < (0.03 if cfg is STRAIGHT else 0.1)
    assert np.linalg.norm(met(None, s, obs, REGION[13])) > 2.0


def test_the_pair_sinks_at_its_own_speed() -> None:
    """Gamma / (2 pi b) once rolled up; nothing at the wing; 0.3 m where receivers fly."""
    t, _, _, w0 = begun(FLOWN)
    z, age = t.nodes[0, :, 2], t.nodes[0, :, 3]
    assert z[0] == pytest.approx(SRC[K_WING + 2])
    rate = (z[-1] - z[-3]) / (age[-1] - age[-3])
    assert rate == pytest.approx(w0, rel=0.02)
    assert 0.0 < z[4] - z[0] < 0.3
    still = begun(STRAIGHT)[0]
    assert np.allclose(still.nodes[0, :, 2], SRC[K_WING + 2])


def test_a_trail_lies_on_the_circle_flown() -> None:
    """3 deg/s in still air: the middle of the pair on the circle of the wing, behind it by the arc flown; in wind displaced by
    the wind times its age."""
    rate, turns = math.radians(3.0), {}
    for wind in (CALM, np.array([3.0, -12.0, 0.0])):
        s, obs = tanker()
        t = Trail(STRAIGHT, SRC, DT)
        radius = V / rate
        for k in range(RING):
            psi = rate * k * DT
            s[0], s[3] = math.cos(0.5 * psi), math.sin(0.5 * psi)
            s[n.S_V : n.S_V + 3] = V * np.array([math.cos(psi), math.sin(psi), 0.0]) + wind
            s[n.S_P : n.S_P + 2] = radius * np.array([math.sin(psi), 1.0 - math.cos(psi)]) + wind[:2] * k * DT
            if k:
                t.shed(s, obs, wind, wind)
            else:
                t.begin(s, obs, wind)
        centre = radius * np.array([-math.sin(psi), math.cos(psi)])  # from the aircraft
        middle = 0.5 * (t.nodes[0] + t.nodes[1])
        off = middle[:, :2] - centre
        turns[float(wind[1])] = middle
        want = math.hypot(radius, float(SRC[K_WING]))
        assert np.allclose(np.hypot(*off.T), want, atol=0.02)
        arc = np.arctan2(off[:, 1], off[:, 0]) - np.arctan2(off[0, 1], off[0, 0])
        assert np.allclose(np.unwrap(arc), -rate * t.nodes[0, :, 3], atol=1e-4)
    assert np.allclose(turns[0.0], turns[-12.0], atol=0.02)  # the air carries all of it alike
    bent = np.hypot(*(turns[0.0][8, :2] - turns[0.0][0, :2] + AWAY[8] * np.array([math.cos(psi), math.sin(psi)])))
    assert bent > 5.0


def test_elements_drift_with_the_gusts_of_their_places() -> None:
    """One second of 2 m/s down, met two to one seconds ago: what was laid there goes with its share of it, the rest does not."""
    share, gust = 0.5, np.array([0.0, 0.0, 2.0])
    t, s, obs, _ = begun(Wake(source="tanker", path="flown", sink=False, meander=share))
    for k in range(1, 301):
        s[n.S_P] += V * DT
        t.shed(s, obs, CALM, gust if 101 <= k <= 200 else CALM)
    age, z = t.nodes[2, :, 3], t.nodes[2, :, 2] - t.nodes[2, 0, 2]
    inside = (age > 1.02) & (age < 1.98)
    assert inside.any() and np.allclose(z[inside], share * 2.0 * age[inside])
    assert np.allclose(z[(age < 0.98) | (age > 2.02)], 0.0)


def test_decay_is_the_published_one() -> None:
    """Sarpkaya's life times at the joints of his three laws; what is met far behind falls by exp(-0.45 t/T)."""
    assert lifespan(0.2535) == pytest.approx(2.25, abs=0.01) and lifespan(0.26) == pytest.approx(2.2077, abs=1e-3)
    assert lifespan(0.01211) == pytest.approx(lifespan(0.01209), abs=0.02)
    assert lifespan(0.0005) == 9.0
    eps = np.array([lifespan(e) for e in (0.02, 0.1, 0.2)])
    assert np.allclose(eps**0.25 * np.exp(-0.70 * eps), (0.02, 0.1, 0.2), rtol=1e-9)
    edr = 0.01
    t, _, obs, w0 = begun(Wake(source="tanker", path="flown", sink=False, edr_m2ps3=edr))
    life = lifespan((edr * B) ** (1.0 / 3.0) / w0) * B / w0  # [s]
    assert t.fade == pytest.approx(0.45 / life)
    gamma, x = np.array(source_strength(obs, SRC)), -0.5 * (AWAY[-3] + AWAY[-2])
    z = float(t.nodes[0, 0, 2])
    full, faded = (np.array(trail_velocity(x, 0.0, z, q.parts, *gamma, SRC)) for q in (begun(STRAIGHT)[0], t))
    assert faded[2] / full[2] == pytest.approx(math.exp(t.fade * x / V), rel=0.01)
    spans, cores = SRC[[K_WING + 3, K_TAIL + 3]], SRC[[K_WING + 4, K_TAIL + 4]]
    half, up = 0.5 * spans, np.array([0.0, t.nodes[2, 0, 2] - t.nodes[0, 0, 2]])  # the tail's lie higher
    h2 = half**2 + up**2
    aged = 1.0 - np.exp(-h2 * V / (4.0 * SRC[K_NU] * -x))
    pair = float(np.sum(gamma / np.pi * half / (h2 + cores**2) * aged))  # midway between two lines, both pairs
    assert full[2] == pytest.approx(pair, rel=0.02)


def test_a_receiver_behind_a_level_tanker_feels_the_same_air() -> None:
    """In flight, at contact, with everything of the trail at work: effective wind within 0.05 m/s after a second."""
    winds = []
    for flown in ({}, {"wind.wake.path": "flown", "wind.wake.meander": 1.0, "wind.wake.edr_m2ps3": 1e-3}):
        at = {"aircraft.receiver.start.xi_m": [-36.0, 0.0, 8.5], "wind.dryden.sigma_mps": 0.0}
        w = World(load_scenario("refueling", at | flown))
        for _ in range(100):
            w.sense()
            w.step([w.trim_cmd(0), w.trim_cmd(1)])
        w.sense()
        winds.append(w.members[1].wind.copy())
    assert np.abs(winds[0] - winds[1])[:3].max() < 0.05
    assert not np.array_equal(*winds)


def test_what_only_a_flown_path_obeys_is_refused_on_a_straight_one() -> None:
    for key, value in (("sink", False), ("meander", 0.5), ("edr_m2ps3", 0.01)):
        with pytest.raises(ConfigError, match=rf"wind\.wake\.{key}.*straight"):
            load_scenario("refueling", {f"wind.wake.{key}": value})
