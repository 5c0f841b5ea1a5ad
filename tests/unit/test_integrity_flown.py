"""What is flown by of the relative position: the bank's, without a jump."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.missions.receiver.integrity.flown import CATCH_MPS, GAP_US, Flown

STILL = (0.0, 0.0, 0.0)
DT_US = 50_000


def test_it_begins_with_the_estimator_and_comes_to_the_bank_by_so_much_a_second() -> None:
    """|off|(t) = max(|off|(0) - CATCH t, 0) in every axis, about a bank that moves with its rate."""
    f, rate = Flown(), (0.4, -0.2, 0.1)
    off = np.array([0.9, -0.3, 0.01])
    for k in range(100):
        t = k * DT_US * 1e-6
        xi = tuple(np.array([-35.5, 0.0, 8.5]) + t * np.array(rate))
        own = tuple(np.array(xi) + off) if k == 0 else (99.0, 99.0, 99.0)  # looked at once
        left = np.sign(off) * np.maximum(np.abs(off) - CATCH_MPS * t, 0.0)
        assert np.array(f.step(k * DT_US, own, xi, rate, 3)) - xi == pytest.approx(left, abs=1e-9)


def test_the_bank_is_followed_at_once_until_its_sources_change() -> None:
    """A jump within half a second of the change is made good by so much a second; without one it is the bank's own word."""
    f, rng = Flown(), np.random.default_rng(1)
    f.step(0, STILL, STILL, STILL, 3)
    for k in range(1, 50):
        xi = tuple(rng.standard_normal(3))
        assert f.step(k * DT_US, STILL, xi, STILL, 3) == pytest.approx(xi, abs=1e-12)
    step = CATCH_MPS * DT_US * 1e-6
    there = (xi[0], xi[1], xi[2] + 2.0)
    assert f.step(50 * DT_US, STILL, xi, STILL, 7) == pytest.approx(xi, abs=1e-12)
    for k in range(51, 61):
        assert f.step(k * DT_US, STILL, there, STILL, 7)[2] == pytest.approx(xi[2] + (k - 50) * step, abs=1e-9)
    far = (there[0] - 1.0, there[1], there[2])
    out = f.step(61 * DT_US, STILL, far, STILL, 7)
    assert out == pytest.approx((far[0], far[1], xi[2] + 11 * step), abs=1e-9)


def test_after_a_gap_or_where_it_was_forgotten_it_begins_anew() -> None:
    f, far = Flown(), (5.0, 5.0, 5.0)
    f.step(0, STILL, STILL, STILL, 3)
    assert f.step(GAP_US + 1, far, STILL, STILL, 3) == far
    f.forget()
    assert f.step(GAP_US + DT_US, far, STILL, STILL, 3) == far
