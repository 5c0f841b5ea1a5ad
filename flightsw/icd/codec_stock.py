"""What only other people's ground stations need of a Snapshot: GNSS and inertial sensors as received, home, mode, fuel, time.
They find the aircraft, call it healthy and draw its track by these; the house's own messages say more.
"""

from __future__ import annotations

import math

from flightsw.icd.context import MODE_BASE, Context, Encoder
from flightsw.icd.dialect import VALUES
from flightsw.icd.radalt import distance
from flightsw.icd.scaling import FUEL_KG_PER_ML
from flightsw.icd.stamps import EPOCH_US, boot_ms
from flightsw.icd.wire import BY_NAME
from flightsw.types import Snapshot

_S = BY_NAME
U16, U8 = 0xFFFF, 0xFF
NO_GPS, NO_FIX, FIX = (VALUES[f"GPS_FIX_TYPE_{n}"] for n in ("NO_GPS", "NO_FIX", "3D_FIX"))
IN_AIR, NOT_KNOWN = VALUES["MAV_LANDED_STATE_IN_AIR"], VALUES["MAV_LANDED_STATE_UNDEFINED"]
IMU, MAG, BARO = 0x3F, 0x1C0, 0xA00  # HIGHRES_IMU_UPDATED_FLAGS
GNSS_OLD_US = 1_000_000  # [us] a fix older than that is none
RADALT_OLD_US = 500_000  # [us] a height older than that is not sent again
NAN = math.nan


def _time(s: Snapshot, c: Context) -> bytes:
    return c.send.pack(_S["SYSTEM_TIME"], EPOCH_US + s.t_us, boot_ms(s.t_us))


def _gps(s: Snapshot, c: Context) -> bytes:
    f = s.sensors
    if c.gnss_us < 0:
        return c.send.named(
            "GPS_RAW_INT", time_usec=s.t_us, fix_type=NO_GPS, eph=U16, epv=U16, vel=U16, cog=U16, satellites_visible=U8
        )
    lat, lon, alt = c.geo.encode(f.gnss_pos_n)
    vn, ve, _ = f.gnss_vel_n
    return c.send.named(
        "GPS_RAW_INT", time_usec=s.t_us, fix_type=FIX if s.t_us - c.gnss_us < GNSS_OLD_US else NO_FIX, lat=lat, lon=lon,
        alt=round(alt * 1000.0), eph=U16, epv=U16, vel=min(round(math.hypot(vn, ve) * 100.0), U16 - 1),
        cog=round(math.degrees(math.atan2(ve, vn)) * 100.0) % 36000, satellites_visible=U8,
    )  # fmt: skip


def _imu(s: Snapshot, c: Context) -> bytes:
    f = s.sensors
    seen = (IMU if c.imu_us >= 0 else 0) | (MAG if c.mag_us >= 0 else 0) | (BARO if c.baro_us >= 0 else 0)
    return c.send.pack(
        _S["HIGHRES_IMU"], s.t_us, *f.acc_b, *f.gyro_b, *f.mag_b, f.pressure_pa * 0.01, 0.0, f.baro_alt_m, 0.0, seen, 0
    )


def _pressure(s: Snapshot, c: Context) -> bytes:
    if c.baro_us < 0:
        return b""
    return c.send.pack(_S["SCALED_PRESSURE"], boot_ms(s.t_us), s.sensors.pressure_pa * 0.01, NAN, 0, 0)


def _home(s: Snapshot, c: Context) -> bytes:
    lat, lon, alt = c.geo.encode((0.0, 0.0, 0.0))
    return c.send.named(
        "HOME_POSITION", latitude=lat, longitude=lon, altitude=round(alt * 1000.0), q=(NAN,) * 4, time_usec=s.t_us
    )


def _extended(s: Snapshot, c: Context) -> bytes:
    return c.send.named("EXTENDED_SYS_STATE", landed_state=IN_AIR if s.cmd.armed else NOT_KNOWN)


def _fuel(s: Snapshot, c: Context) -> bytes:
    kg, full = s.sensors.fuel_kg, c.capacity_kg
    if full <= 0.0 or c.fuel_us < 0:
        return b""
    return c.send.named(
        "FUEL_STATUS", maximum_fuel=full / FUEL_KG_PER_ML, consumed_fuel=NAN, remaining_fuel=kg / FUEL_KG_PER_ML,
        percent_remaining=max(0, min(100, round(100.0 * kg / full))),
        flow_rate=s.sensors.fuel_flow_kgps / FUEL_KG_PER_ML, temperature=NAN, fuel_type=1,
    )  # fmt: skip


def _mode(s: Snapshot, c: Context) -> bytes:
    mode = MODE_BASE + s.guid.phase
    return c.send.named("CURRENT_MODE", custom_mode=mode, intended_custom_mode=mode)


def _radalt(s: Snapshot, c: Context) -> bytes:
    if s.health.radalt_bad or c.radalt_us < 0 or s.t_us - c.radalt_us > RADALT_OLD_US:
        return b""
    return c.send.pack(_S["DISTANCE_SENSOR"], *distance(s.sensors.radalt_t_us, s.sensors.radalt_m))


ENCODERS: dict[str, Encoder] = {
    "SYSTEM_TIME": _time,
    "GPS_RAW_INT": _gps,
    "HIGHRES_IMU": _imu,
    "SCALED_PRESSURE": _pressure,
    "HOME_POSITION": _home,
    "EXTENDED_SYS_STATE": _extended,
    "FUEL_STATUS": _fuel,
    "CURRENT_MODE": _mode,
    "DISTANCE_SENSOR": _radalt,
}
