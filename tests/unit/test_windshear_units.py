"""A unit of which one reading is refused is believed in nothing; a drifting gyro is learnt; what looks like an engine is none."""

from __future__ import annotations

from functools import cache

import pytest

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.units import kept_out
from hil_scripts.studies.jing.sensor_faults import FAULTS
from hil_scripts.studies.jing.sensor_flight import CLEAN, OTHER_AIRCRAFT, SensorFlight

INERTIAL = (k.Y_Q, k.Y_XDD, k.Y_HDD)
TO_S = 85.0


def bits(*channels: int) -> int:
    return sum(1 << c for c in channels)


def test_readings_of_one_unit_stand_or_fall_together() -> None:
    for c in INERTIAL:
        assert kept_out(bits(c)) == bits(*INERTIAL) & ~bits(c)
    assert kept_out(bits(*INERTIAL)) == 0  # each of them goes on being judged
    assert kept_out(bits(k.Y_TH)) == bits(k.Y_XDD, k.Y_HDD)  # turned by it
    assert kept_out(bits(k.Y_HD)) == bits(k.Y_VG) and kept_out(bits(k.Y_VG)) == bits(k.Y_HD)
    assert kept_out(bits(k.Y_VA, k.Y_AL, k.Y_H)) == 0


@cache
def sound(seed: int, *air: str) -> SensorFlight:
    """25 s without a fault."""
    f = SensorFlight("windshear", seed, (*OTHER_AIRCRAFT, *air))
    f.fly(25.0)
    return f


def faulty(name: str, seed: int, *air: str) -> SensorFlight:
    """Flight with a fault from 25 s on."""
    f = sound(seed, *air).branch()
    f.inject(FAULTS[name].event(f.t_s))
    f.fly(110.0 if not air else TO_S, "safe" if not air else "far")
    return f


def test_a_gyro_that_drifts_is_learnt() -> None:
    """0.03 deg/s each second, through the severe microburst: as a state without noise it took the attitude for wrong, and ended
    on the ground."""
    f = faulty("gyro_drift", 1)
    drift = 5e-4 * (f.t_s - 25.0)
    assert f.mission.nav.x[k.B_Q] == pytest.approx(drift, abs=3e-3)
    assert not f.seen.lost and f.figures()["height_min_m"] > 25.0
    assert not any("refused" in text for _, _, text in f.seen.texts)


@pytest.mark.parametrize(("name", "seed"), [("imu_frozen", 1), ("gnss_frozen", 2), ("attitude_frozen", 1)])
def test_a_unit_that_freezes_is_given_up_and_left_by_climbing(name: str, seed: int) -> None:
    """The first two ended on the ground, half a minute after they had been said; the last was taken for an engine."""
    f = faulty(name, seed, *CLEAN)
    assert f.given_up and not f.seen.lost and f.figures()["height_min_m"] > 150.0
    assert f.seen.first("estimate not trusted: without") < 35.0
    taken_back = f.seen.first("engine back") - f.seen.first("engine out")
    assert f.seen.first("engine out") == float("inf") or taken_back < 2.0


def test_an_airspeed_that_freezes_is_no_engine() -> None:
    f = faulty("airspeed_frozen", 2)
    assert f.seen.first("estimate not trusted: airspeed and incidence contradict the lift") < 45.0
    assert f.seen.first("engine out") == float("inf") and not f.seen.lost
