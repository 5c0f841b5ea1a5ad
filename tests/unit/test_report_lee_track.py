"""The trajectory of the tanker: turns as often as asked, the way through the air a racetrack, its picture in the report."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ground.report.lee import track
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee import study as lee

RATE, RAMP = math.radians(1.7), math.radians(0.15)  # [rad/s], [rad/s^2]


@pytest.fixture(scope="module")
def flight() -> fl.Flight:
    """Two half turns, 20 s of straight flight between them."""
    return fl.fly("ecwm", 370.0, 5, leg_s=20.0)


def test_a_second_turn_brings_it_back_through_the_air(flight: fl.Flight) -> None:
    """Heading once round; across track the integral of V sin(psi) over a turn rate that rises, stays and falls."""
    once = fl.fly("ecwm", 370.0, 5)
    assert abs(once.x[-1, 6] - once.x[0, 6]) == pytest.approx(math.pi, abs=0.01)
    assert abs(flight.x[-1, 6] - flight.x[0, 6]) == pytest.approx(2.0 * math.pi, abs=0.01)
    way = track.through_air(flight.t, flight.x[:, 9:11], flight.x[:, 12:14])
    t = np.linspace(0.0, math.pi / RATE + RATE / RAMP, 4001)
    rate = np.minimum(RATE, RAMP * np.minimum(t, t[-1] - t))
    psi = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (rate[1:] + rate[:-1]))])
    across = float(190.0 * np.trapezoid(np.sin(psi), t))
    assert psi[-1] == pytest.approx(math.pi, abs=1e-6)
    straight = flight.t < 99.0
    first = way[straight][-1] - way[0]
    along = first / np.linalg.norm(first)
    side = way @ np.array([-along[1], along[0]])
    print(f"across the racetrack {side.max():.0f} m, by the turn rate {across:.0f} m, at the end {side[-1]:.0f} m")
    assert side.max() == pytest.approx(across, rel=0.02)
    assert abs(side[-1]) < 0.02 * across
    over = flight.x[:, 9:11] - flight.x[0, 9:11]
    assert np.linalg.norm(over[-1] - way[-1]) > 3000.0  # the wind's own way: that over the ground does not close


def test_the_way_through_the_air_of_a_known_wind() -> None:
    t = np.linspace(0.0, 50.0, 101)
    wind = np.stack([3.0 + 0.2 * t, -5.0 + 0.0 * t], axis=1)  # linear: the trapezium is exact
    circle = 1000.0 * np.stack([np.sin(0.1 * t), 1.0 - np.cos(0.1 * t)], axis=1)
    over = circle + np.stack([3.0 * t + 0.1 * t * t, -5.0 * t], axis=1) + np.array([40.0, -7.0])
    assert np.allclose(track.through_air(t, over, wind), circle, atol=1e-9)


@pytest.mark.usefixtures("small_pictures")
def test_only_a_case_of_several_turns_is_drawn(flight: fl.Flight) -> None:
    cases = {c.name: c.params for c in lee.TABLE.cases}
    drawn: dict[str, str] = {}

    class Keeper:
        def add(self, name: str, png: bytes, caption: str) -> str:
            assert png.startswith(b"\x89PNG")
            drawn[name] = caption
            return "picture"

    tr = {"t": flight.t[::4], "state_true": flight.x[::4, :12], "wind_true": flight.x[::4, 12:15]}
    c = SimpleNamespace(cases=list(cases), meta={"cases": cases}, traces=lambda case: tr)
    assert "Trajectory" in track.chapter(c, Keeper())  # type: ignore[arg-type]
    assert list(drawn) == ["tanker_II_racetrack_track"] and "Figure 7.1 " in drawn["tanker_II_racetrack_track"]
    c.traces = lambda case: {}
    assert track.chapter(c, Keeper()) == ""  # type: ignore[arg-type]
