"""Height above the ground in DISTANCE_SENSOR: a radar that looks down, whole centimetres up to what they can say."""

from __future__ import annotations

import math

from flightsw.icd.stamps import boot_ms

RADAR, DOWN = 3, 25  # MAV_DISTANCE_SENSOR_RADAR, MAV_SENSOR_ROTATION_PITCH_270
MOST_CM, BEYOND_CM = 65500, 65535  # the field ends there: a distance above the most says that it is beyond
NOT_SAID = 0xFF


def distance(t_us: int, height_m: float) -> tuple[float, ...]:
    """Fields of DISTANCE_SENSOR in wire order of a height [m] measured at t_us [us]; below 0: 0; above MOST_CM: BEYOND_CM."""
    cm = BEYOND_CM if height_m * 100.0 > MOST_CM else max(0, round(height_m * 100.0))
    return boot_ms(t_us), 0, MOST_CM, cm, RADAR, 0, DOWN, NOT_SAID, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0


def height(fields: tuple[float, ...]) -> float | None:
    """Height [m] in the fields of a DISTANCE_SENSOR in wire order, infinite beyond its range; None: of another kind of sensor."""
    _, least, most, cm, kind, _, orientation, *_ = fields
    if kind != RADAR or orientation != DOWN:
        return None
    return cm * 0.01 if least <= cm <= most else math.inf
