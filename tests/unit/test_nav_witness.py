"""Witnesses of disputed readings: closed forms of lift and side force, and the difference of GNSS fixes."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.missions.receiver.aids import GnssWitness
from flightsw.sixdof.witness import AGAINST, FOR, UNDECIDED, Forces, verdict

G = 9.81


STILL = (0.0, 0.0, 0.0)  # [m/s] wind


def learnt(scale: float = 1.08, side: float = 0.1) -> Forces:
    """After 60 s of an aircraft with `scale` times the model's lift and `side` m/s^2 more side force."""
    w = Forces(0.04, 0.25, 0.2)
    for _ in range(60):
        w.step((0.0, 0.5 + side, -scale * G), (0.0, 0.5, -G), STILL, 1.0, True)
    return w


def test_a_verdict_needs_evidence_and_a_standing_one_half_of_it() -> None:
    assert verdict([(4.0, 0.0)]) == AGAINST
    assert verdict([(2.0, 0.0)]) == UNDECIDED
    assert verdict([(2.5, 0.0)]) == UNDECIDED and verdict([(2.5, 0.0)], AGAINST) == AGAINST
    assert verdict([(0.0, 3.5)]) == UNDECIDED and verdict([(0.0, 4.5)]) == FOR
    assert verdict([(100.0, 0.0), (0.0, 6.0)]) == UNDECIDED  # nobody is believed beyond five sigma
    assert verdict([]) == UNDECIDED


def test_lift_knows_how_the_aircraft_differs_from_its_model() -> None:
    w = learnt()
    sensor, estimate = w.lift(1.0, 0.0)
    assert sensor == estimate == pytest.approx(0.0, abs=1e-9)
    # an airspeed 30 m/s below 195: the model would have (165/195)^2 of the lift
    share = (165.0 / 195.0) ** 2
    sensor, estimate = w.lift(share, 0.0)
    assert sensor == pytest.approx((1.0 / share - 1.0) / 0.04) and estimate == pytest.approx(0.0, abs=1e-9)
    assert verdict([(sensor, estimate)]) == AGAINST


def test_a_true_change_of_airspeed_shows_in_the_lift() -> None:
    """The air really slows the aircraft by 30 m/s: lift drops although the estimate has not followed."""
    w, share = learnt(), (165.0 / 195.0) ** 2
    for _ in range(100):
        w.step((0.0, 0.6, -1.08 * G * share), (0.0, 0.5, -G), STILL, 0.05, False)
    sensor, estimate = w.lift(share, 0.0)
    assert sensor == pytest.approx(0.0, abs=0.1)
    assert verdict([(sensor, estimate)]) == FOR
    # an estimate that knows itself uncertain by as much is no proof
    assert verdict([w.lift(share, 1.0 - share)]) == UNDECIDED


def test_the_airspeed_that_bears_the_lift() -> None:
    """The estimate has been led 30 m/s below 195: the model there has (165/195)^2 of the lift that is felt."""
    w, share = learnt(), (165.0 / 195.0) ** 2
    assert w.faster == pytest.approx(0.0, abs=1e-9)
    for _ in range(200):
        w.step((0.0, 0.6, -1.08 * G), (0.0, 0.5, -G * share), (20.0, 0.0, 0.0), 0.05, False)
    assert 165.0 * (1.0 + w.faster) == pytest.approx(195.0, abs=0.1)
    assert 1.0 + w.more == pytest.approx(1.0 / share, abs=1e-3)
    assert w.wind == STILL  # nothing is learnt of a wind that goes with doubtful air data
    w.borne()
    assert w.faster == pytest.approx(0.0, abs=1e-9) and w.lift(1.0, 0.0)[1] == pytest.approx(0.0, abs=1e-9)


def test_lift_before_it_has_learnt_is_believed_to_a_quarter() -> None:
    w = Forces(0.04, 0.25, 0.2)
    assert w.plausible  # nothing measured yet
    assert w.lift(0.5, 0.0) == (0.0, 0.0)
    w.step((0.0, 0.0, -1.2 * G), (0.0, 0.0, -G), STILL, 0.05, True)
    assert w.plausible and w.lift(1.0, 0.0)[1] == pytest.approx(0.2 / 0.25)
    w.reset()
    w.step((0.0, 0.0, -1.4 * G), (0.0, 0.0, -G), STILL, 0.05, True)
    assert not w.plausible


@pytest.mark.parametrize(
    "pair", [((0.0, 0.0, 3.0), (0.0, 0.0, -G)), ((0.0, 0.0, np.nan), (0.0, 0.0, -G)), ((0, 0, -G), (0, 0, 0))]
)
def test_no_lift_no_witness(pair: tuple[tuple[float, float, float], tuple[float, float, float]]) -> None:
    w = learnt()
    before = vars(w).copy()
    w.step(*pair, STILL, 1.0, True)
    assert vars(w) == before


def test_side_force_judges_sideslip() -> None:
    w = learnt(side=0.3)
    assert w.sideways(0.0, 0.0) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert w.sideways(1.0, 0.0)[0] == pytest.approx(-5.0)
    assert w.sideways(1.0, 0.2)[1] == pytest.approx(0.0, abs=1e-9)
    assert Forces(0.04, 0.25, 0.2).sideways(1.0, 0.0) == (0.0, 0.0)


class Fixes:
    """GNSS difference with a lasting error, a relative sensor and an estimate, 2 Hz in use and 20 Hz kept out."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.w = GnssWitness(0.5, 0.03)
        self.offset = self.rng.normal(size=3) * 1.5
        self.t_us = 0

    def run(self, seconds: float, rate_hz: float, sensor: np.ndarray, estimate: np.ndarray, held: bool) -> int:
        xi = np.array([-35.0, 2.0, 8.0])
        for _ in range(round(seconds * rate_hz)):
            self.t_us += round(1e6 / rate_hz)
            gnss = xi + self.offset + 0.5 * self.rng.normal(size=3)
            self.w.step(gnss, xi + sensor + 0.5 * self.rng.normal(size=3), xi + estimate, self.t_us, held)
        return self.w.verdict()


NONE, STEP = np.zeros(3), np.array([0.0, 0.0, 4.0])


@pytest.mark.parametrize("seed", range(5))
def test_the_gnss_difference_says_whose_position_jumped(seed: int) -> None:
    f = Fixes(seed)
    assert f.run(30.0, 2.0, NONE, NONE, False) == UNDECIDED  # nobody asked
    assert f.run(2.0, 20.0, STEP, NONE, True) == AGAINST
    g = Fixes(seed)
    g.run(30.0, 2.0, NONE, NONE, False)
    assert g.run(2.0, 20.0, NONE, STEP, True) == FOR
    h = Fixes(seed)
    h.run(1.0, 2.0, NONE, NONE, False)
    assert h.run(2.0, 20.0, STEP, NONE, True) == UNDECIDED  # not calibrated yet


def test_a_spike_of_one_fix_does_not_enter_the_calibration() -> None:
    f = Fixes(1)
    f.run(20.0, 2.0, NONE, NONE, False)
    before = f.w.offset.copy()
    f.w.step(np.array([500.0, 0.0, 0.0]), NONE, NONE, f.t_us + 500_000, False)
    assert np.array_equal(f.w.offset, before)
