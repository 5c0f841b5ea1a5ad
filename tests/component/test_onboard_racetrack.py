"""Reference segments and the tanker's racetrack. Navigation by hand, no plant."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.missions.receiver.path import Quintic, duration
from flightsw.missions.tanker.racetrack import INIT, LEG, TURN, RacetrackGuidance, RacetrackParams
from flightsw.types import NavState, SensorFrame

DT = 0.05


# --- segments -------------------------------------------------------------------------------------------------------
coord = st.tuples(*[st.floats(-100, 100)] * 3)


@settings(deadline=None, derandomize=True)
@given(coord, st.tuples(*[st.floats(-5, 5)] * 3), coord, st.floats(1.0, 100.0))
def test_quintic_meets_its_boundary_values(p0: tuple, v0: tuple, p1: tuple, T: float) -> None:
    q = Quintic(p0, v0, p1, T)
    assert np.allclose(q.at(0.0)[0], p0, atol=1e-12) and np.allclose(q.at(0.0)[1], v0, atol=1e-12)
    end, rest = q.at(T * (1 - 1e-12))
    assert np.allclose(end, p1, atol=1e-8) and np.allclose(rest, 0, atol=1e-8)
    assert q.at(T) == (p1, (0.0, 0.0, 0.0)) == q.at(T + 5.0)
    # acceleration is zero at both ends: the velocity leaves its end values with the square of time
    h = 1e-4 * T
    scale = (np.abs(np.subtract(p1, p0)).max() + np.abs(v0).max() * T + 1.0) / T
    for t, v in ((h, v0), (T - h, (0.0, 0.0, 0.0))):
        assert np.abs(np.subtract(q.at(t)[1], v)).max() < 400 * scale * 1e-8
    # velocity is the derivative of position
    t = 0.37 * T
    d = (np.array(q.at(t + h)[0]) - np.array(q.at(t - h)[0])) / (2 * h)
    assert np.abs(d - q.at(t)[1]).max() < 1e-5 * scale


@settings(deadline=None, derandomize=True)
@given(coord, coord, st.floats(0.1, 5.0))
def test_rest_to_rest_duration_keeps_the_peak_speed(p0: tuple, p1: tuple, v: float) -> None:
    T = duration(p0, p1, v, 4.0)
    q = Quintic(p0, (0.0, 0.0, 0.0), p1, T)
    peak = max(math.hypot(*q.at(s * T / 200)[1]) for s in range(201))
    assert peak <= v * (1 + 1e-9)
    if T > 4.0:
        assert peak == pytest.approx(v, rel=1e-9)


# --- racetrack ------------------------------------------------------------------------------------------------------
class Pattern:
    """A tanker that turns exactly as commanded."""

    def __init__(self, **params: float) -> None:
        self.g = RacetrackGuidance(RacetrackParams(first_leg_s=20.0, leg_s=30.0, **params))
        self.f, self.psi = SensorFrame(), 0.3
        self.nav = NavState(valid=True, V=195.0, euler=(self.psi, 0.05, 0.0))
        self.log: list[tuple[int, float, float, float]] = []

    def step(self, n: int, shift: float = 0.0) -> None:
        for _ in range(n):
            self.f.t_us += round(DT * 1e6)
            out = self.g.step(self.f, self.nav, DT)
            self.psi += out.psi_dot * DT
            self.nav.euler = (self.psi + shift, 0.05, 0.0)
            self.log.append((out.phase, self.psi, out.psi_dot, out.V))


@pytest.mark.parametrize("rate", [1.7, -1.7, 3.0])
def test_turns_are_half_circles_at_the_commanded_rate(rate: float) -> None:
    p = Pattern(turn_rate_degps=rate)
    p.step(9000)
    log = np.array(p.log)
    legs = log[:-1][(log[:-1, 0] == LEG) & (log[1:, 0] == TURN), 1]
    assert len(legs) >= 3
    turned = np.degrees(np.diff(legs))
    assert np.abs(turned - math.copysign(180.0, rate)).max() < 0.1
    assert np.abs(np.degrees(log[:, 2])).max() == pytest.approx(abs(rate), rel=1e-9)
    # most of the half circle is flown at the full rate
    assert (np.abs(np.abs(np.degrees(log[:, 2])) - abs(rate)) < 1e-9).sum() * DT > 0.7 * 180 / abs(rate) * (
        len(legs) - 1
    )


def test_turn_rate_never_changes_faster_than_its_limit() -> None:
    p = Pattern()
    p.step(6000)
    step = np.abs(np.diff([r[2] for r in p.log])).max()
    assert step <= math.radians(0.15) * DT * (1 + 1e-9)


def test_a_heading_shifted_by_whole_turns_changes_nothing() -> None:
    """An estimator that restarts may count its heading from another turn."""
    a, b = Pattern(), Pattern()
    for p, shift in ((a, 0.0), (b, 2 * math.pi)):
        p.step(900)
        p.step(4000, shift)
    assert np.allclose([r[2] for r in a.log], [r[2] for r in b.log], atol=1e-9)


def test_a_leg_brings_the_heading_back() -> None:
    p = Pattern()
    p.step(20)
    p.psi += math.radians(2.0)
    p.g.p = RacetrackParams(first_leg_s=1e4)
    p.step(3000)
    assert abs(math.degrees(p.psi - 0.3)) < 0.1
    assert max(abs(r[2]) for r in p.log) <= math.radians(0.3) * (1 + 1e-9)


def test_speed_orders_are_checked_and_ramped() -> None:
    p = Pattern()
    p.step(10)
    assert p.g.set_speed(149.0, 150.0, 235.0) == (False, "speed 149 m/s, allowed 150 to 235")
    assert p.g.set_speed(math.nan, 150.0, 235.0)[0] is False
    assert p.g.set_speed(200.0, 150.0, 235.0) == (True, "")
    p.step(1200)
    V = np.array([r[3] for r in p.log])
    assert V[-1] == pytest.approx(200.0)
    assert np.abs(np.diff(V)).max() <= 0.15 * DT * (1 + 1e-9)


def test_it_waits_for_navigation_and_starts_on_the_heading_flown() -> None:
    p = Pattern()
    p.nav.valid = False
    p.step(5)
    assert p.g.out.phase == INIT and p.g.out.psi_dot == 0.0
    p.nav.valid = True
    p.step(1)
    assert p.g.out.phase == LEG and p.g.psi_ref == pytest.approx(0.3)
