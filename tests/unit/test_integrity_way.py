"""What carries the bank on when the tanker's accelerometers are not heard: the own ones, and the tanker as it is taken to fly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.receiver.integrity import way_kernel
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.horizon import Horizon
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.way import KEPT, Way
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import UPD_IMU, Gain, PeerState, SensorFrame


def told(bank_deg: float) -> PeerTracker:
    """A tanker heard once at 1 s, at 200 m/s to the north, banked to the right."""
    peer, half = PeerTracker(), math.radians(bank_deg) / 2.0
    peer.take(PeerState(t_us=1_000_000, vel_n=(200.0, 0.0, 0.0), q_nb=(math.cos(half), math.sin(half), 0.0, 0.0)))
    return peer


def test_measured_by_both_it_is_the_difference() -> None:
    way, peer = Way(), told(0.0)
    way.own(1_000_000, 1_050_000, (1.0, 2.0, 3.0))
    way.other(Gain(1_050_000, 0.05, (0.05, 0.0, -0.05)))
    assert way.over(1_000_000, 1_050_000, peer) == pytest.approx((0.0, 2.0, 4.0))
    assert way.known


@pytest.mark.parametrize("bank_deg", [0.0, 25.0])
def test_a_silent_tanker_flies_on_and_the_own_motion_counts(bank_deg: float) -> None:
    way, peer = Way(), told(bank_deg)
    peer.coast(1_500_000)
    peer.coast(1_550_000)
    way.own(1_500_000, 1_550_000, (1.0, 2.0, 3.0))
    turn = 9.80665 * math.tan(
        math.radians(bank_deg)
    )  # of a steady turn, to the right of north; it rolls out from there
    north, east, down = way.over(1_500_000, 1_550_000, peer)
    assert not way.known
    assert (north, down) == pytest.approx((1.0, 3.0), abs=0.05)
    assert east == pytest.approx(2.0 - turn, abs=0.1)


def test_means_over_any_part_of_the_last_steps() -> None:
    """Every step counts by the time it shares with the part asked for, more of them than are kept or not."""
    rng, way, peer = np.random.default_rng(1), Way(), told(0.0)
    ends = np.cumsum(rng.integers(40_000, 60_000, 2 * KEPT))
    own, gained = rng.normal(size=(len(ends), 3)), rng.normal(size=(len(ends), 3))
    for k in range(1, len(ends)):
        way.own(int(ends[k - 1]), int(ends[k]), tuple(own[k].tolist()))
        span = float(ends[k] - ends[k - 1]) * 1e-6
        way.other(Gain(int(ends[k]), span, tuple(gained[k].tolist())))
    acc = own[1:] - gained[1:] / (np.diff(ends) * 1e-6)[:, None]
    for _ in range(100):
        a, b = np.sort(rng.choice(np.arange(ends[-KEPT + 1], ends[-1]), 2, replace=False)).tolist()
        shared = np.clip(np.minimum(ends[1:], b) - np.maximum(ends[:-1], a), 0, None)
        assert way.over(a, b, peer) == pytest.approx(tuple(shared @ acc / shared.sum()), abs=1e-9)
        assert way.known and way.felt


def test_what_the_tanker_gained_holds_for_a_while() -> None:
    way, peer = Way(), told(0.0)
    way.other(Gain(1_050_000, 0.05, (0.05, 0.0, -0.05)))
    way.other(Gain(1_040_000, 0.05, (9.0, 9.0, 9.0)))  # older: not taken
    for end in range(1_100_000, 1_500_000, 50_000):
        way.own(end - 50_000, end, (0.0, 0.0, 0.0))
        wanted = (-1.0, 0.0, 1.0) if end <= 1_350_000 else (0.0, 0.0, 0.0)  # as transmitted
        assert way.over(end - 50_000, end, peer) == pytest.approx(wanted)
        assert way.known == (end <= 1_350_000)


def test_the_way_ahead_is_a_parabola_between_whose_steps_it_is_straight() -> None:
    rng, way, peer = np.random.default_rng(2), Way(), told(0.0)
    acc = rng.normal(size=3)
    way.own(1_000_000, 1_200_000, tuple(acc.tolist()))
    path, X = np.zeros((5, way_kernel.PATH)), rng.normal(size=(2, 30))
    rows, felt, known = way_kernel.build(
        *way.arrays, peer.acceleration, peer.coasting, 1_030_000, 1_180_000, 50_000, X, path
    )
    d, u = X[0, :3], X[0, 3:6]
    t = np.array([0.0, 0.05, 0.1, 0.15])
    pos, vel = d + np.outer(t, u) + 0.5 * np.outer(t * t, acc), u + np.outer(t, acc)
    for s in (-0.02, 0.0, 0.013, 0.05, 0.12, 0.15, 0.4):
        got = way_kernel.at(path, rows, round(1_030_000 + s * 1e6))
        for part, wanted in zip((got[:3], got[3:]), (pos, vel), strict=True):
            assert part == pytest.approx([np.interp(s, t, row) for row in wanted.T], abs=1e-12)
    assert rows == 4 and felt and not known


def test_without_own_accelerometers_nothing_is_known() -> None:
    way, peer = Way(), told(0.0)
    way.own(1_000_000, 1_050_000, None)
    assert way.over(1_000_000, 1_050_000, peer) == (0.0, 0.0, 0.0)
    assert not way.known and not way.felt
    way.own(1_050_000, 1_100_000, (1.0, 2.0, 3.0))
    way.over(1_050_000, 1_100_000, peer)
    assert way.felt


@pytest.mark.parametrize("new", [0, UPD_IMU])
def test_the_horizon_knows_whether_the_own_acceleration_is_known(new: int) -> None:
    p = IntegrityParams(on=True)
    horizon = Horizon(p, Bank(p, (12.19, -0.52)))
    f = SensorFrame(t_us=50_000, gyro_count=5, att_t_us=50_000, att_q_nb=(1.0, 0.0, 0.0, 0.0))
    horizon.feel(f, new)
    assert horizon.felt == bool(new)


def test_a_way_that_was_not_felt_is_known_least() -> None:
    p = IntegrityParams(on=True)
    horizon, peer = Horizon(p, Bank(p, (12.19, -0.52))), told(0.0)
    horizon._way.own(0, 50_000, None)
    horizon._way.over(0, 50_000, peer)
    assert horizon._blind == p.accel_most
    horizon._way.own(50_000, 100_000, (0.0, 0.0, 0.0))
    horizon._way.over(50_000, 100_000, peer)
    assert horizon._blind == max(p.accel_blind, horizon.unrest.density)
