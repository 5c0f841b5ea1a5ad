"""Sensors of the own aircraft: inertial unit, barometer, magnetometer, attitude reference, GNSS, fuel gauge."""

from __future__ import annotations

import math

from flightsw.types import (
    UPD_ATT,
    UPD_BARO,
    UPD_FUEL,
    UPD_GNSS,
    UPD_IMU,
    UPD_MAG,
    UPD_RADALT,
    Quat,
    SensorFrame,
)
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.sensors.bank_kernel import ATTITUDE, HEIGHT, PLAIN, POSITIVE, turn
from sim_plant.sensors.base import Sensor, View

Six = tuple[float, float, float, float, float, float]


class ImuSensor(Sensor):
    """Gyro [rad/s] and accelerometer (specific force at the cg) [m/s^2]."""

    group, bit, form = "imu", UPD_IMU, PLAIN

    def sample(self, view: View, e: list[float]) -> Six:
        s, o = view.s, view.o
        return (s[4] + e[0], s[5] + e[1], s[6] + e[2], o[0] + e[3], o[1] + e[4], o[2] + e[5])

    def fill(self, frame: SensorFrame, t_us: int, value: Six) -> None:
        frame.gyro_b = value[0:3]
        frame.acc_b = value[3:6]


class BaroSensor(Sensor):
    """Pressure altitude [m] and the static pressure [Pa] that belongs to it in the standard atmosphere."""

    group, bit, form = "baro", UPD_BARO, HEIGHT

    def sample(self, view: View, e: list[float]) -> tuple[float, float]:
        h = -view.s[n.S_P + 2] + e[0]
        return h, isa(h)[1]

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float, float]) -> None:
        frame.baro_alt_m, frame.pressure_pa = value


class MagSensor(Sensor):
    """Earth's field in body axes [gauss]."""

    group, bit, form = "mag", UPD_MAG, PLAIN

    def sample(self, view: View, e: list[float]) -> tuple[float, float, float]:
        o = view.o
        return o[n.O_MAG] + e[0], o[n.O_MAG + 1] + e[1], o[n.O_MAG + 2] + e[2]

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float, float, float]) -> None:
        frame.mag_b = value


def turned(q: list[float], e: list[float]) -> Quat:
    """Quaternion q (first four entries) followed by the rotation vector e [rad] about the body axes."""
    return turn(q[0], q[1], q[2], q[3], e[0], e[1], e[2])


class AttitudeSensor(Sensor):
    """Attitude reference: the true quaternion turned by a small angle about each body axis."""

    group, bit, form = "att", UPD_ATT, ATTITUDE

    def sample(self, view: View, e: list[float]) -> Quat:
        return turned(view.s, e)

    def fill(self, frame: SensorFrame, t_us: int, value: Quat) -> None:
        frame.att_q_nb, frame.att_t_us = value, t_us


class GnssSensor(Sensor):
    """Position [m] and inertial velocity [m/s] in the local navigation frame."""

    group, bit, form = "gnss", UPD_GNSS, PLAIN

    def sample(self, view: View, e: list[float]) -> Six:
        s = view.s
        return (s[10] + e[0], s[11] + e[1], s[12] + e[2], s[7] + e[3], s[8] + e[4], s[9] + e[5])

    def fill(self, frame: SensorFrame, t_us: int, value: Six) -> None:
        frame.gnss_pos_n, frame.gnss_vel_n, frame.gnss_t_us = value[0:3], value[3:6], t_us


class FuelSensor(Sensor):
    """Fuel on board [kg], with the transfer flow [kg/s]."""

    group, bit, form = "fuel", UPD_FUEL, POSITIVE

    def sample(self, view: View, e: list[float]) -> tuple[float, float]:
        return max(0.0, view.s[n.S_FUEL] + e[0]), view.transfer_kgps

    def made(self, row: tuple[float, ...], view: View) -> tuple[float, float]:
        return row[0], view.transfer_kgps

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float, float]) -> None:
        frame.fuel_kg, frame.fuel_flow_kgps, frame.fuel_t_us = value[0], value[1], t_us


class RadaltSensor(Sensor):
    """Radio altimeter: height above the ground [m], which is level at height 0; silent beyond its range, and never below 0."""

    group, bit, form = "radalt", UPD_RADALT, POSITIVE
    range_max_m = math.inf

    def sample(self, view: View, e: list[float]) -> tuple[float] | None:
        h = -view.s[n.S_P + 2]
        return (max(0.0, h + e[0]),) if h <= self.range_max_m else None

    def made(self, row: tuple[float, ...], view: View) -> tuple[float, ...] | None:
        return row if -view.s[n.S_P + 2] <= self.range_max_m else None

    def row(self, view: View) -> list[float]:
        return [-view.s[n.S_P + 2]]

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[float]) -> None:
        (frame.radalt_m,), frame.radalt_t_us = value, t_us
