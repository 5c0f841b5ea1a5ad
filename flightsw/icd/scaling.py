"""Scalings shared by both ends of the plant link."""

from __future__ import annotations

import math

from flightsw.aircraft import Airframe

COMP_AUTOPILOT = 1  # component id of flightsw
COMP_PLANT = 190  # component id of the plant
GROUND_SYSID = 255
STATIONS = (240, 255)  # system ids of ground stations, from and to: 245 MAVSDK, 255 nearly everybody
FUEL_KG_PER_ML = 0.8e-3  # [kg/ml] fixed conversion of the gauge: FUEL_STATUS carries volume
PROBES = 4  # entries of AIR_DATA


class ControlScale:
    """Largest travel of each surface [rad]: the wire carries deflection over this. 1 for a surface the aircraft has not."""

    __slots__ = ("aileron", "elevator", "flap", "rudder")

    def __init__(self, aircraft: Airframe) -> None:
        c = aircraft.controls
        self.aileron, self.elevator, self.rudder, self.flap = (
            math.radians(max(map(abs, pair))) or 1.0
            for pair in (c.aileron_deg, c.elevator_deg, c.rudder_deg, c.flap_deg)
        )
