"""Attitude references that do not turn with the aircraft: found in a turn, by gyro and GNSS velocity, and only then."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import dcm_from_euler, quat_from_euler, to_child, vec3
from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.motion import AGREES_S, LENGTH_S, angle
from flightsw.sixdof.recovery.protection import Protection
from flightsw.types import UPD_AIR, UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, Health, NavState, SensorFrame, Vec3

FELT = Felt(np.zeros(4), None)
DT, V, H, G = 0.05, 195.0, 7010.0, 9.80665
TURN = math.radians(1.7)  # [rad/s]
NEW = UPD_IMU | UPD_BARO | UPD_AIR | UPD_ATT | UPD_GNSS
STRAIGHT: Vec3 = (0.0, 0.0, 0.0)


def attitude(t: float, rate: float) -> np.ndarray:
    """NED to body [9] after t [s] of a level coordinated turn."""
    R = np.zeros(9)
    dcm_from_euler(rate * t, 0.0, math.atan(V * rate / G), R)
    return R


def frame(t: float, rate: float, still_s: float = math.inf, bias: Vec3 = STRAIGHT, fixes: bool = True) -> SensorFrame:
    """Sensors at t [s] of a turn of `rate` [rad/s]; the reference stands still from still_s [s] on; gyro bias [rad/s]."""
    R, q, w, force = attitude(t, rate), np.zeros(4), np.zeros(3), np.zeros(3)
    to_child(R, np.array([0.0, 0.0, rate]), w)
    psi = rate * t
    to_child(R, np.array([-V * rate * math.sin(psi), V * rate * math.cos(psi), -G]), force)
    quat_from_euler(rate * min(t, still_s), 0.0, math.atan(V * rate / G), q)
    f = SensorFrame(updated=NEW if fixes else NEW & ~UPD_GNSS, gyro_count=5, baro_alt_m=H)
    f.gyro_mean_b, f.acc_mean_b = vec3(w + np.array(bias)), vec3(force)
    f.gnss_vel_n = (V * math.cos(psi), V * math.sin(psi), 0.0)
    f.att_q_nb = (float(q[0]), float(q[1]), float(q[2]), float(q[3]))
    f.air_mask, f.air_V, f.air_beta, f.air_alpha = 7, (V,) * 3, (0.0,) * 3, (0.05,) * 3
    return f


def fly(until_s: float, rate: float, still_s: float = math.inf, **more: object) -> tuple[Protection, float]:
    """The protection after until_s [s], and since when the reference has been doubted."""
    guard, since = Protection(load_aircraft("learjet24"), H, DT), math.inf
    for k in range(round(until_s / DT)):
        f = frame(k * DT, rate, still_s, **more)  # type: ignore[arg-type]
        guard.step(f, NavState(), f.updated, Health(), Rejoin(), FELT, DT)
        if guard.readings.motion.doubted:
            since = min(since, k * DT)
    return guard, since


@pytest.mark.parametrize("still_s", [0.0, 10.0, 12.0, 14.0])
@pytest.mark.parametrize("rate", [TURN, -TURN])
def test_a_reference_that_stands_still_in_a_turn_is_found_and_the_gyro_goes_on(still_s: float, rate: float) -> None:
    guard, since = fly(still_s + 3.0 * LENGTH_S, rate, still_s)
    assert still_s < since < still_s + 2.0 * LENGTH_S
    assert angle(guard.readings.R, attitude(still_s + 3.0 * LENGTH_S, rate)) < math.radians(1.0)
    assert not guard.sound(NEW) & UPD_ATT and guard.sound(NEW) & UPD_GNSS
    assert [t.text for t in guard.texts] == ["attitude reference does not turn along"]


@pytest.mark.parametrize("rate", [0.0, TURN, 3.0 * TURN])
def test_a_sound_reference_is_never_doubted(rate: float) -> None:
    guard, since = fly(40.0, rate)
    assert since == math.inf and guard.sound(NEW) == NEW


@pytest.mark.parametrize("rate", [0.0, TURN])
@pytest.mark.parametrize("bias", [(0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)])
def test_a_wrong_gyro_is_not_laid_on_the_reference(bias: Vec3, rate: float) -> None:
    assert fly(40.0, rate, bias=bias)[1] == math.inf


@pytest.mark.parametrize("rate", [TURN, -3.0 * TURN])
def test_an_imu_that_stands_still_is_not_laid_on_the_reference(rate: float) -> None:
    """Gyro and accelerometers stay at level flight while the aircraft begins to turn."""
    guard, level = Protection(load_aircraft("learjet24"), H, DT), frame(0.0, 0.0)
    for k in range(round(20.0 / DT)):
        f = frame(max(k * DT - 5.0, 0.0), rate if k * DT >= 5.0 else 0.0)
        f.gyro_mean_b, f.acc_mean_b = level.gyro_mean_b, level.acc_mean_b
        guard.step(f, NavState(), f.updated, Health(), Rejoin(), FELT, DT)
        assert not guard.readings.motion.doubted


def test_without_a_fix_nobody_can_tell() -> None:
    assert fly(30.0, TURN, 10.0, fixes=False)[1] == math.inf


def test_it_is_taken_again_by_turning_along_for_long() -> None:
    guard, _ = fly(20.0, TURN, 10.0)
    steps = round(2.0 * AGREES_S / DT)
    doubts = []
    for k in range(steps):
        f = frame(20.0 + k * DT, TURN)
        guard.step(f, NavState(), f.updated, Health(), Rejoin(), FELT, DT)
        doubts.append(guard.readings.motion.doubted)
    assert doubts[round(0.8 * AGREES_S / DT)] and not doubts[-1]
    assert guard.texts[-1].text == "attitude reference good again"
