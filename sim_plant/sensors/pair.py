"""Sensors between two aircraft: relative navigation and the boom signal."""

from __future__ import annotations

import math

from flightsw.types import UPD_BOOM, UPD_REL, SensorFrame
from sim_plant.kernels import layout as n
from sim_plant.sensors.bank_kernel import AT_BOOM, PLAIN
from sim_plant.sensors.base import Sensor, View

Six = tuple[float, float, float, float, float, float]


class RelSensor(Sensor):
    """Own cg in the leader's body axes, xi [m], and d(xi)/dt [m/s]; silent beyond range_max_m."""

    group, bit, form = "rel", UPD_REL, PLAIN
    range_max_m = 0.0  # 0: no limit

    def sample(self, view: View, e: list[float]) -> Six | None:
        r = view.rel
        if 0.0 < self.range_max_m < math.hypot(r[0], r[1], r[2]):
            return None
        return (r[0] + e[0], r[1] + e[1], r[2] + e[2], r[3] + e[3], r[4] + e[4], r[5] + e[5])

    def made(self, row: tuple[float, ...], view: View) -> tuple[float, ...] | None:
        return None if 0.0 < self.range_max_m < math.hypot(*view.rel[:3]) else row

    def fill(self, frame: SensorFrame, t_us: int, value: Six) -> None:
        frame.rel_pos_t, frame.rel_vel_t, frame.rel_t_us, frame.rel_valid = value[0:3], value[3:6], t_us, True


class BoomSensor(Sensor):
    """Boom signal: contact, inside the envelope, elevation and azimuth [rad], extension [m]. Error row: the last three."""

    group, bit, form, exact = "boom", UPD_BOOM, AT_BOOM, 3

    def sample(self, view: View, e: list[float]) -> tuple[bool, bool, float, float, float]:
        r = view.boom
        if not e:
            return view.contact, view.inside, r[n.R_EL], r[n.R_AZ], r[n.R_EXT]
        return view.contact, view.inside, r[n.R_EL] + e[0], r[n.R_AZ] + e[1], r[n.R_EXT] + e[2]

    def made(self, row: tuple[float, ...], view: View) -> tuple[bool, bool, float, float, float]:
        return view.contact, view.inside, row[0], row[1], row[2]

    def row(self, view: View) -> list[float]:
        return view.boom[n.R_EL : n.R_EXT + 1]

    def fill(self, frame: SensorFrame, t_us: int, value: tuple[bool, bool, float, float, float]) -> None:
        frame.boom_contact, frame.boom_inside, frame.boom_elevation, frame.boom_azimuth, frame.boom_extension_m = value
        frame.boom_t_us = t_us
