"""Velocity gained by the own accelerometers: what is summed, and when there is none to tell."""

from __future__ import annotations

import math

import pytest
from scipy.spatial.transform import Rotation

from flightsw.health import HealthMonitor, HealthParams
from flightsw.kernels.atmosphere import G0
from flightsw.process.gained import Gained
from flightsw.types import NO_GAIN, UPD_FIX, UPD_IMU, Gain, PeerFix, SensorFrame

TURNED = Rotation.from_euler("ZYX", (0.7, 0.1, -0.4))  # body to NED


def frame(k: int, acc: tuple[float, float, float], updated: int = UPD_IMU, late_us: int = 20_000) -> SensorFrame:
    """Tick k of 100 Hz with inertial acceleration acc [3] m/s^2 NED, felt in the turned aircraft."""
    x, y, z, w = TURNED.as_quat().tolist()
    force = TURNED.inv().apply([acc[0], acc[1], acc[2] - G0]).tolist()
    t = 1_000_000 + 10_000 * k
    return SensorFrame(t_us=t, updated=updated, att_t_us=t - late_us, att_q_nb=(w, x, y, z), acc_b=tuple(force))


def test_it_is_the_sum_of_the_inertial_acceleration_since_the_last() -> None:
    g = Gained()
    assert g.take() == NO_GAIN
    for k in range(31):
        g.add(frame(k, (0.01 * k, -2.0, 0.5)))
        if k == 20:
            first = g.take()
    rest = g.take()
    assert (first.t_us, rest.t_us) == (1_200_000, 1_300_000) and first.span_s == pytest.approx(0.2)
    assert first.vel_n == pytest.approx((0.01 * 210 * 0.01, -0.4, 0.1), abs=1e-12)
    assert rest.span_s == pytest.approx(0.1) and rest.vel_n == pytest.approx((0.01 * 255 * 0.01, -0.2, 0.05), abs=1e-12)
    assert g.take() == NO_GAIN


@pytest.mark.parametrize("gap", [{"updated": 0}, {"late_us": 300_000}], ids=["no IMU", "attitude is old"])
def test_what_is_missing_ends_the_sum(gap: dict[str, int]) -> None:
    g = Gained()
    for k in range(10):
        g.add(frame(k, (1.0, 0.0, 0.0)))
    g.add(frame(10, (1.0, 0.0, 0.0), **gap))
    assert g.take() == NO_GAIN
    for k in range(11, 20):
        g.add(frame(k, (1.0, 0.0, 0.0)))
    assert g.take() == Gain(1_190_000, pytest.approx(0.08), pytest.approx((0.08, 0.0, 0.0)))  # type: ignore[arg-type]


@pytest.mark.parametrize("gain", [15.1, -1e6, math.nan])
def test_a_gain_no_aircraft_flies_refuses_the_fix(gain: float) -> None:
    """150 m/s^2 are believed of any reading."""
    f = SensorFrame(t_us=1_000_000, updated=UPD_FIX)
    f.fix = PeerFix(t_us=900_000, gain=Gain(950_000, 0.1, (0.0, gain, 0.0)))
    assert not HealthMonitor(HealthParams(), 0).step(f)[0].updated & UPD_FIX
    f.fix.gain = Gain(950_000, 0.1, (0.0, 14.9, 0.0))
    assert HealthMonitor(HealthParams(), 0).step(f)[0].updated & UPD_FIX
