"""The one table of telemetry: message -> rate [Hz]. Tests read it too. What only one mission sends is in that mission's spec.

Messages of 10 Hz and less share the ticks of a 10 Hz grid, so a tick sends one datagram or none; the 1 Hz messages are
spread over the ten slots of a second by their offset. A faster message (command SET_MESSAGE_INTERVAL) goes on its own
ticks.
"""

from __future__ import annotations

from collections.abc import Iterable

GRID_HZ = 10  # [Hz]
MAX_RATE_HZ = 1000.0  # [Hz]

# message -> (rate [Hz], offset in slots of the grid). Order = order within a datagram: the first due one must carry a
# time.
COMMON: dict[str, tuple[float, int]] = {
    "NAV_STATE": (10.0, 0),
    "ATTITUDE_QUATERNION": (10.0, 0),
    "LOCAL_POSITION_NED": (10.0, 0),
    "RELATIVE_STATE": (10.0, 0),  # of missions that follow another aircraft
    "MISSION_STATUS": (10.0, 0),  # here follows what only the mission sends
    "WIND_COV": (5.0, 1),
    "ATTITUDE": (4.0, 0),
    "GLOBAL_POSITION_INT": (4.0, 0),
    "VFR_HUD": (2.0, 2),
    "HEARTBEAT": (1.0, 0),
    "SYS_STATUS": (1.0, 2),
    "ESTIMATOR_STATUS": (1.0, 4),
    "LOOP_TIMING": (1.0, 6),
    "HEALTH_STATUS": (1.0, 8),
    "CONTROL_TERMS": (10.0, 0),  # one packet for each law
    # for other people's ground stations
    "SYSTEM_TIME": (1.0, 5),
    "GPS_RAW_INT": (1.0, 1),
    "HIGHRES_IMU": (1.0, 3),
    "SCALED_PRESSURE": (0.5, 5),
    "HOME_POSITION": (0.5, 7),
    "EXTENDED_SYS_STATE": (0.5, 9),
    "FUEL_STATUS": (0.5, 5),
    "CURRENT_MODE": (0.5, 7),
    "DISTANCE_SENSOR": (10.0, 0),  # of aircraft with a radio altimeter, within its range
}
RELATIVE, LEADING = "RELATIVE_STATE", "MISSION_STATUS"


def table(own: Iterable[tuple[str, float, int]], relative: bool) -> dict[str, tuple[float, int]]:
    """Rate [Hz] and offset of every message of a mission, in the order of a datagram: the common ones, and its own (name, rate,
    offset). relative: whether it follows another aircraft."""
    out: dict[str, tuple[float, int]] = {}
    for name, entry in COMMON.items():
        out[name] = (0.0, entry[1]) if name == RELATIVE and not relative else entry
        if name == LEADING:
            out |= {message: (rate, offset) for message, rate, offset in own}
    return out


def due(tick: int, rate_hz: float, offset: int, base_hz: int) -> bool:
    """Is a message of this rate due on base tick `tick`? On average exactly `rate_hz` (to 0.001 Hz), at most one per
    tick.
    """
    rate = round(rate_hz * 1000.0)  # [mHz] integers: no rounding drifts in
    if rate <= 0:
        return False
    if rate > GRID_HZ * 1000:
        whole = base_hz * 1000
        rate = min(rate, whole)
        return tick * rate // whole != (tick - 1) * rate // whole
    step = base_hz // GRID_HZ
    if tick % step:
        return False
    slot, whole = tick // step - offset, GRID_HZ * 1000
    return slot * rate // whole != (slot - 1) * rate // whole


def names_due(rates: dict[str, float], offsets: dict[str, int], tick: int, base_hz: int) -> tuple[str, ...]:
    """Messages due on base tick `tick`, in the order of `rates`; repeats every ten seconds."""
    return tuple(n for n, r in rates.items() if due(tick, r, offsets[n], base_hz))
