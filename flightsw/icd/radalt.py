"""Height above the ground in DISTANCE_SENSOR: a radar that looks down, whole centimetres up to what they can say."""

from __future__ import annotations

from flightsw.icd.stamps import boot_ms

RADAR, DOWN = 3, 25  # MAV_DISTANCE_SENSOR_RADAR, MAV_SENSOR_ROTATION_PITCH_270
MOST_CM = 65500  # the field ends at 65535
NOT_SAID = 0xFF


def distance(t_us: int, height_m: float) -> tuple[float, ...]:
    """Fields of DISTANCE_SENSOR in wire order of a height [m] measured at t_us [us]; held within 0 and MOST_CM."""
    cm = max(0, min(MOST_CM, round(height_m * 100.0)))
    return boot_ms(t_us), 0, MOST_CM, cm, RADAR, 0, DOWN, NOT_SAID, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0


def height(fields: tuple[float, ...]) -> float | None:
    """Height [m] in the fields of a DISTANCE_SENSOR in wire order; None: of another kind of sensor, or beyond its range."""
    _, least, most, cm, kind, _, orientation, *_ = fields
    return cm * 0.01 if kind == RADAR and orientation == DOWN and least <= cm <= most else None
