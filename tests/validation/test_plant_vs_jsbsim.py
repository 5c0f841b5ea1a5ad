"""The plant against JSBSim: both aircraft, 60 s of doublets on every axis and a thrust step, state by state
(acceptance 5).

Bound: 5e-4 of each state's range. Halving JSBSim's step or quartering the plant's moves the differences by less than
1e-4; what remains (3e-4 in altitude) is the constants of JSBSim's atmosphere, whose density is 6e-6 higher, seen
through the phugoid. A wrong sign of Ixz or moments taken in body axes would show as 7e-3 or more, which the second
test makes sure of.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from tests.validation import jsbsim_model as jm

BOUND = 5e-4
VISIBLE = 5e-3  # what a modelling slip must at least produce


@pytest.fixture(scope="module", params=sorted(jm.MASS))
def flight(request: pytest.FixtureRequest) -> tuple[str, jm.History]:
    """Name and the plant's flight, shared by the tests of one aircraft."""
    return request.param, jm.fly_plant(load_aircraft(request.param), jm.MASS[request.param])


def test_every_state_follows_jsbsim_for_sixty_seconds(tmp_path: Path, flight: tuple[str, jm.History]) -> None:
    name, _ = flight
    ratio, table = jm.compare(tmp_path, name)
    print("\n" + table)
    assert np.isfinite(ratio).all()
    assert ratio.max() < BOUND, table


def test_the_manoeuvre_moves_every_axis(flight: tuple[str, jm.History]) -> None:
    """A comparison of states that never move would prove nothing."""
    span = dict(zip(jm.STATES, np.ptp(flight[1].states, axis=0), strict=True))
    floor = {
        "V [m/s]": 5.0, "alpha [rad]": 0.05, "beta [rad]": 0.05, "p [rad/s]": 0.1, "q [rad/s]": 0.05, "r [rad/s]": 0.05,
        "phi [rad]": 0.1, "theta [rad]": 0.05, "psi [rad]": 0.05, "altitude [m]": 50.0,
        "north [m]": 1e4, "east [m]": 10.0,
    }  # fmt: skip
    assert all(span[k] > v for k, v in floor.items()), span


@pytest.mark.parametrize(
    ("right", "wrong"),
    [('<ixz unit="SLUG*FT2">', '<ixz unit="SLUG*FT2">-'), (' frame="STABILITY"', ""), ('frame="BODY"', 'frame="WIND"')],
    ids=["sign of Ixz", "moments in body axes", "thrust along the flow"],
)
def test_a_modelling_slip_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flight: tuple[str, jm.History], right: str, wrong: str
) -> None:
    name, h = flight
    xml = jm.aircraft_xml
    assert right in xml(load_aircraft(name), jm.MASS[name])
    monkeypatch.setattr(jm, "aircraft_xml", lambda ac, mass: xml(ac, mass).replace(right, wrong))
    other = jm.fly_jsbsim(tmp_path, load_aircraft(name), jm.MASS[name], h, substeps=2)
    assert jm.differences(h.states, other)[2].max() > VISIBLE


@pytest.mark.parametrize("name", sorted(jm.MASS))
def test_the_plants_trim_is_jsbsims_trim(tmp_path: Path, name: str) -> None:
    """At the plant's trim JSBSim finds no linear or angular acceleration (1e-4 of g, 1e-4 rad/s^2)."""
    ac = load_aircraft(name)
    h = jm.fly_plant(ac, jm.MASS[name])
    first = jm.History(*(getattr(h, k)[:2] for k in ("t", "states", "surf", "surf_rate", "thrust", "thrust_rate")))
    fdm = None
    load = jm.load

    def keep(folder: Path, a, mass: float):  # type: ignore[no-untyped-def]
        nonlocal fdm
        fdm = load(folder, a, mass)
        return fdm

    with pytest.MonkeyPatch.context() as m:
        m.setattr(jm, "load", keep)
        jm.fly_jsbsim(tmp_path, ac, jm.MASS[name], first, substeps=1)
    assert fdm is not None
    for k in ("u", "v", "w"):
        assert abs(fdm[f"accelerations/{k}dot-ft_sec2"] * jm.FT) < 1e-4 * 9.80665
    for k in ("p", "q", "r"):
        assert abs(fdm[f"accelerations/{k}dot-rad_sec2"]) < 1e-4
