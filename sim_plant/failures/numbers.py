"""Numbers of MAV_CMD_INJECT_FAILURE, what an aircraft has that can fail, and the plant's answer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from sim_plant.failures.schedule import CLEAR
from sim_plant.failures.script import Event

UNIT_AIRSPEED = 8  # FAILURE_UNIT_SENSOR_AIRSPEED
UNIT_FUEL, UNIT_MOTOR, UNIT_SERVO, UNIT_LINK = (
    100,
    101,
    102,
    105,
)  # FAILURE_UNIT_SYSTEM_BATTERY, _MOTOR, _SERVO, _MAVLINK_SIGNAL
UNIT_ATT, UNIT_GAUGE, UNIT_BOOM, UNIT_RADALT = 64, 65, 66, 67  # of the house's own
GROUPS = {
    0: "imu",
    1: "imu",
    2: "mag",
    3: "baro",
    4: "gnss",
    6: "rel",
    7: "tacan",
    UNIT_AIRSPEED: "air",
    UNIT_ATT: "att",
    UNIT_GAUGE: "fuel",
    UNIT_BOOM: "boom",
    UNIT_RADALT: "radalt",
}  # FAILURE_UNIT_SENSOR_*
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = range(8)  # FAILURE_TYPE
SPIKE, SCALE, FROZEN, STAMP, HARDOVER, FLOAT, PLAY, BLOCKED, ICED = range(64, 73)  # of the house's own
KIND = {
    OK: CLEAR,
    OFF: "off",
    STUCK: "stuck",
    GARBAGE: "garbage",
    WRONG: "bias",
    SLOW: "drift",
    DELAYED: "delayed",
    INTERMITTENT: "intermittent",
    SPIKE: "spike",
    SCALE: "scale",
    FROZEN: "frozen",
    STAMP: "stamp",
    BLOCKED: "blocked",
    ICED: "iced",
}
NO_VALUE = (OK, OFF, STUCK, FROZEN, BLOCKED)  # types of a sensor's failure that have no size
_DEG = math.radians(1.0)
# per channel V, alpha, beta: what a type does if no value is given (the source's fault sizes; the rest our choice)
AIR_DEFAULT = {
    WRONG: (3.0, _DEG, _DEG),  # [m/s, rad]
    SLOW: (0.1, _DEG / 30.0, _DEG / 30.0),  # [m/s^2, rad/s]
    GARBAGE: (50.0, 10.0 * _DEG, 10.0 * _DEG),
    SPIKE: (30.0, 10.0 * _DEG, 10.0 * _DEG),
    SCALE: (1.1, 1.1, 1.1),  # [-]
}
# the other sensors, column by column of their error row; per second where it drifts
_WRONG = {
    "imu": (0.5 * _DEG,) * 3 + (0.5,) * 3,  # [rad/s, m/s^2]
    "mag": (0.05,) * 3,  # [gauss]
    "baro": (10.0,),  # [m]
    "gnss": (5.0,) * 3 + (0.5,) * 3,  # [m, m/s]
    "att": (_DEG,) * 3,  # [rad]
    "rel": (3.0,) * 3 + (0.3,) * 3,  # [m, m/s]
    "fuel": (100.0,),  # [kg]
    "tacan": (500.0,),  # [m]
    "radalt": (5.0,),  # [m]
    "boom": (_DEG, _DEG, 0.5),  # [rad, m]
}
SIZES = {WRONG: 1.0, SLOW: 0.05, GARBAGE: 10.0, SPIKE: 10.0}  # [-] of those
DELAY_S = STAMP_S = 1.0
SHARE = 0.5


def default(group: str, kind: int) -> tuple[float, ...]:
    """What a type of failure does to each column of a sensor, other than air data, if no value is given."""
    row = _WRONG.get(group, ())
    return (1.1,) * len(row) if kind == SCALE else tuple(SIZES[kind] * x for x in row)


@dataclass(frozen=True)
class Verdict:
    """Answer to one command: MAV_RESULT, why or what in words, and the fault it makes (kind "clear...": ends faults)."""

    result: int
    text: str
    event: Event | None = None


@dataclass(frozen=True)
class Fitted:
    """What of an aircraft can fail: probes and rate [Hz] of its air data, rates of its other sensors and columns of their error
    rows, surfaces, a radio, engines, tanks."""

    probes: int = 0
    air_rate_hz: float = 0.0
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    surfaces: tuple[str, ...] = ()
    radio: bool = False
    columns: Mapping[str, int] = field(default_factory=dict)
    engines: int = 0
    tanks: bool = False

    def units(self) -> list[str]:
        """FAILURE_UNITs it has, in words."""
        have = [f"{u} ({g})" for u, g in GROUPS.items() if (self.probes if g == "air" else g in self.rates_hz)]
        parts = (
            (UNIT_FUEL, "fuel", self.tanks), (UNIT_MOTOR, "engine", self.engines), (UNIT_SERVO, "surface", self.surfaces),
            (UNIT_LINK, "radio", self.radio),
        )  # fmt: skip
        return have + [f"{u} ({word})" for u, word, has in parts if has]

    def has(self, unit: int) -> bool:
        """Whether it has that unit."""
        return any(x.split(" ")[0] == str(unit) for x in self.units())
