"""Readings of level flight, to run every code path once before the clock starts."""

from __future__ import annotations

from collections.abc import Iterator

from flightsw.types import (
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_FIX,
    UPD_GNSS,
    UPD_IMU,
    UPD_PEER,
    UPD_RADAR,
    UPD_REL,
    UPD_TACAN,
    PeerFix,
    PeerState,
    SensorFrame,
)


def level_flight(ticks: int, probes: int, V: float, h: float, period_us: int) -> Iterator[SensorFrame]:
    """`ticks` frames, one each `period_us` [us], of flight north at V [m/s] and h [m] with another aircraft ahead. One frame,
    renewed at each step."""
    n = probes
    f = SensorFrame(
        acc_b=(0.0, 0.0, -9.8), gnss_pos_n=(0.0, 0.0, -h), gnss_vel_n=(V, 0.0, 0.0), air_mask=(1 << n) - 1,
        air_V=(V,) * n, air_alpha=(0.03,) * n, air_beta=(0.0,) * n, baro_alt_m=h, rel_valid=True,
        rel_pos_t=(-59.0, 56.0, 0.0), fuel_kg=1800.0,
    )  # fmt: skip
    f.peer = PeerState(vel_n=(V, 0.0, 0.0))
    f.fix = PeerFix(pos_n=(59.0, -56.0, -h))
    for k in range(ticks):
        f.t_us = f.gnss_t_us = f.air_t_us = f.att_t_us = f.rel_t_us = f.peer.t_us = f.fix.t_us = (k + 1) * period_us
        f.updated = UPD_IMU | UPD_BARO | UPD_AIR | UPD_ATT | UPD_GNSS | UPD_REL | UPD_PEER | UPD_FIX
        # a sensor that repeats itself is refused as stuck: let the readings move
        e = 1e-4 * (k % 7)
        f.gyro_b, f.gnss_vel_n = (e, e, e), (V + e, e, e)
        f.air_V, f.air_alpha, f.air_beta = (V + e,) * n, (0.03 + e,) * n, (e,) * n
        f.tacan_t_us, f.tacan_range_m = f.t_us, 55e3 - 4.0 * k
        f.radar_t_us, f.radar_sigma_m = f.t_us, 1852.0
        if k % 10 == 0:
            f.updated |= UPD_TACAN | (UPD_RADAR if k == 0 else 0)
        f.att_q_nb, f.rel_vel_t, f.peer.vel_n = (1.0, 0.0, 0.015 + e, 0.0), (e, e, e), (V, e, e)
        f.fix.vel_n = f.gnss_vel_n
        yield f
