"""The one table of telemetry: message -> rate [Hz]. Tests read it too.

Messages of 10 Hz and less share the ticks of a 10 Hz grid, so a tick sends one datagram or none; the 1 Hz messages are
spread over the ten slots of a second by their offset. A faster message (command SET_MESSAGE_INTERVAL) goes on its own
ticks.
"""

from __future__ import annotations

GRID_HZ = 10  # [Hz]
MAX_RATE_HZ = 1000.0  # [Hz]

# message -> (rate [Hz], offset in slots of the grid). Order = order within a datagram: the first due one must carry a
# time.
_COMMON = {
    "NAV_STATE": (10.0, 0),
    "ATTITUDE_QUATERNION": (10.0, 0),
    "LOCAL_POSITION_NED": (10.0, 0),
    "RELATIVE_STATE": (10.0, 0),
    "MISSION_STATUS": (10.0, 0),
    "FDI_STATUS": (10.0, 0),  # this and the next three: only while navigation has them
    "WAKE_POSITION": (10.0, 0),
    "RENDEZVOUS_STATE": (2.0, 1),
    "RENDEZVOUS_CLOUD": (0.5, 3),
    "GUST_STATE": (0.0, 0),  # every sample of the gust mission, none of another
    "WINDSHEAR_STATE": (0.0, 0),  # likewise of the windshear mission
    "WIND_COV": (5.0, 1),
    "ATTITUDE": (4.0, 0),
    "GLOBAL_POSITION_INT": (4.0, 0),
    "VFR_HUD": (2.0, 2),
    "HEARTBEAT": (1.0, 0),
    "SYS_STATUS": (1.0, 2),
    "ESTIMATOR_STATUS": (1.0, 4),
    "LOOP_TIMING": (1.0, 6),
    "HEALTH_STATUS": (1.0, 8),
}
DEFAULT_RATES: dict[str, float] = {name: rate for name, (rate, _) in _COMMON.items()}
OFFSETS: dict[str, int] = {name: offset for name, (_, offset) in _COMMON.items()}
_NO_RECEIVER = {"RELATIVE_STATE": 0.0, "FDI_STATUS": 0.0, "WAKE_POSITION": 0.0}
_NO_RENDEZVOUS = {"RENDEZVOUS_STATE": 0.0, "RENDEZVOUS_CLOUD": 0.0}
MISSION_RATES: dict[str, dict[str, float]] = {
    "tanker": _NO_RECEIVER | _NO_RENDEZVOUS,
    "receiver": _NO_RENDEZVOUS,
    "receiver_rendezvous": _NO_RENDEZVOUS,
    "rendezvous": _NO_RECEIVER,
    "gust": _NO_RECEIVER | _NO_RENDEZVOUS | {"GUST_STATE": 50.0},
    "windshear": _NO_RECEIVER | _NO_RENDEZVOUS | {"WINDSHEAR_STATE": 50.0},
}


def rates_for(mission: str, overrides: dict[str, float] | None = None) -> dict[str, float]:
    """Rate of every message for a mission, the configuration's overrides applied."""
    return DEFAULT_RATES | MISSION_RATES.get(mission, {}) | (overrides or {})


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


def names_due(rates: dict[str, float], tick: int, base_hz: int) -> tuple[str, ...]:
    """Messages due on base tick `tick`, in order; repeats every ten seconds."""
    return tuple(n for n, r in rates.items() if due(tick, r, OFFSETS.get(n, 0), base_hz))
