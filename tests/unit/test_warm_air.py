"""Density at an ascent's temperature: the kernel and an aircraft in flight against levels of the file worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.kernels.atmosphere import isa
from sim_plant.lost import Watch
from sim_plant.scenario import load_scenario
from sim_plant.wind.prevailing import read_sounding
from sim_plant.wind.warmth import warmed, warmth
from sim_plant.world import World

OUN = "sounding_oun_20181222_12z_uwyo.txt"
PLAIN = np.zeros(n.P_TABLES)


def test_at_its_levels_the_air_has_the_ascents_temperature_at_the_standards_pressure() -> None:
    par = warmed(PLAIN, warmth(OUN))
    for h, _, t in read_sounding(OUN).air[::7].tolist():
        got, (t0, p0, rho0, _) = air(h, par), isa(h)
        assert got[0] == pytest.approx(t, abs=1e-9) and got[1] == p0
        assert got[2] == pytest.approx(rho0 * t0 / t, rel=1e-12)
        assert got[3] == pytest.approx(math.sqrt(1.4 * 287.05287 * t), rel=1e-6)


def test_between_levels_the_warmth_is_linear_and_beyond_them_held() -> None:
    par = warmed(PLAIN, np.array([[1000.0, 4.0], [3000.0, -6.0]]))
    for h, warm in ((0.0, 4.0), (1000.0, 4.0), (1500.0, 1.5), (3000.0, -6.0), (9000.0, -6.0)):
        assert air(h, par)[0] - isa(h)[0] == pytest.approx(warm)
    assert air(7010.0, PLAIN) == isa(7010.0)


def test_an_aircraft_flies_in_it() -> None:
    """At 7010 m: the density it meets, and the pressure its barometer does, which stays the standard's."""
    obs = {}
    for density in ("isa", "sounding"):
        obs[density] = World(load_scenario("refueling", {"wind.density": density})).members[0].obs.copy()
    levels = read_sounding(OUN).air
    warm = np.interp(7010.0, levels[:, 0], [t - isa(h)[0] for h, _, t in levels.tolist()])
    ratio = obs["sounding"][n.O_RHO] / obs["isa"][n.O_RHO]
    assert ratio == pytest.approx(isa(7010.0)[0] / (isa(7010.0)[0] + warm), rel=1e-9)
    assert 0.002 < abs(ratio - 1.0) < 0.1
    assert obs["sounding"][n.O_PRESS] == obs["isa"][n.O_PRESS]
    assert obs["sounding"][n.O_ALPHA] != obs["isa"][n.O_ALPHA]  # trimmed at it


def test_mach_at_which_it_breaks_up_is_that_of_its_air() -> None:
    """Between the limit by the ascent's speed of sound and by the standard's, high enough for Mach to come first."""
    m, h = World(load_scenario("refueling", {"wind.density": "sounding"})).members[0], 11_000.0
    levels, watch = read_sounding(OUN).air, Watch(m, 0.01)
    warm = np.interp(h, levels[:, 0], [t - isa(x)[0] for x, _, t in levels.tolist()])
    true, standard = math.sqrt(1.4 * 287.05287 * (isa(h)[0] + warm)), isa(h)[3]
    assert abs(true / standard - 1.0) > 1e-3
    m.view.s[n.S_P + 2] = -h
    m.view.o[n.O_V] = m.ac.structure.dive_mach * 0.5 * (true + standard)
    assert ("Mach" in watch.step()) == (true < standard)


@pytest.mark.parametrize(
    ("scenario", "sets", "says"),
    [
        ("gust", {"wind.density": "sounding"}, r"wind\.density = 'sounding': allowed with .*isa"),
        ("refueling", {"wind.dryden.level": "light"}, r"wind\.dryden\.sigma_mps = 0\.39.*level = 'light'"),
        ("refueling", {"wind.dryden.level": "heavy"}, r"wind\.dryden\.level.*light"),
        ("gust", {"wind.dryden.level": "light"}, r"wind\.dryden\.V_mps = 195 with .*level.*of the 19\.7 m/s"),
        ("windshear", {"wind.dryden.over": "field"}, r"wind\.dryden\.over = 'field'"),
    ],
)
def test_what_cannot_be_obeyed_is_refused(scenario: str, sets: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        World(load_scenario(scenario, sets))
