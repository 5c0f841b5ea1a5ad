"""MAV_CMD_INJECT_FAILURE as the plant understands it: which failures it can make, and what it answers.

param1 FAILURE_UNIT, param2 FAILURE_TYPE, param3 instance (probe 1 .. n, 0 = all), and in the parameters the standard
reserves: param4 channel (1 V, 2 alpha, 3 beta, 0 = all), param5 value (SI; 0 = the default), param6 duration [s] (0 =
until cleared). Types: OFF off; STUCK stuck at the last value; GARBAGE uniform within +-value; WRONG bias; SLOW drift,
value per second; DELAYED by value [s]; INTERMITTENT a share `value` of the samples lost; OK clears the channels named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED
from sim_plant.failures.schedule import CLEAR
from sim_plant.failures.script import CHANNELS, CMD_INJECT_FAILURE, Event

UNIT_AIRSPEED = 8  # FAILURE_UNIT_SENSOR_AIRSPEED
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = range(8)  # FAILURE_TYPE
KIND = {
    OK: CLEAR,
    OFF: "off",
    STUCK: "stuck",
    GARBAGE: "garbage",
    WRONG: "bias",
    SLOW: "drift",
    DELAYED: "delayed",
    INTERMITTENT: "intermittent",
}
_DEG = math.radians(1.0)
# per channel V, alpha, beta: what a type does if no value is given (the source's fault sizes; the rest our choice)
DEFAULT = {
    WRONG: (3.0, _DEG, _DEG),  # [m/s, rad]
    SLOW: (0.1, _DEG / 30.0, _DEG / 30.0),  # [m/s^2, rad/s]
    GARBAGE: (50.0, 10.0 * _DEG, 10.0 * _DEG),
}
DELAY_S = 1.0
SHARE = 0.5


@dataclass(frozen=True)
class Verdict:
    """Answer to one command: MAV_RESULT, why or what in words, and the fault it makes (kind "clear": ends faults)."""

    result: int
    text: str
    event: Event | None = None


def judge(command: int, params: tuple[float, ...], aircraft: str, probes: int, air_rate_hz: float) -> Verdict:
    """What the plant answers to `command` for an aircraft with so many air-data probes sampled at air_rate_hz."""
    if command != CMD_INJECT_FAILURE:
        return Verdict(UNSUPPORTED, f"command {command}: the plant takes {CMD_INJECT_FAILURE} (inject failure) only")
    p = (*params, *([0.0] * (7 - len(params))))[:7]
    # what the standard reserves comes as "not used" from clients that know no more than it
    p = (*p[:3], *(0.0 if math.isnan(x) else x for x in p[3:]))
    if not all(math.isfinite(x) for x in p[:6]) or not all(x == math.floor(x) for x in p[:4]):
        return Verdict(DENIED, f"parameters {list(p[:6])}: numbers, the first four of them whole, are needed")
    unit, kind, instance, channel = (int(x) for x in p[:4])
    value, for_s = p[4], p[5]
    if unit != UNIT_AIRSPEED or not probes:
        return Verdict(
            UNSUPPORTED, f"failure unit {unit}: {aircraft} has " + ("8 (airspeed) only" if probes else "none")
        )
    if kind not in KIND:
        return Verdict(UNSUPPORTED, f"failure type {kind}: allowed 0 to {INTERMITTENT}")
    if not 0 <= instance <= probes:
        return Verdict(DENIED, f"instance {instance}: {aircraft} has probes 1 to {probes}, 0 = all")
    if not 0 <= channel <= len(CHANNELS):
        return Verdict(DENIED, f"channel {channel}: allowed 1 V, 2 alpha, 3 beta, 0 = all")
    if for_s < 0.0:
        return Verdict(DENIED, f"duration {for_s:g} s: 0 or more")
    if value and not channel and kind in DEFAULT:
        return Verdict(DENIED, f"value {value:g} without a channel: V and angles have different units")
    values: tuple[float, ...] = ()
    samples = 0
    if kind in DEFAULT:
        own = DEFAULT[kind] if not channel else (value or DEFAULT[kind][channel - 1],)
        if kind == GARBAGE and min(own) < 0.0:
            return Verdict(DENIED, f"value {value:g}: garbage needs more than 0")
        values = own if channel or instance else own * probes
    elif kind == DELAYED:
        samples = round((value or DELAY_S) * air_rate_hz)
        if not 1 <= samples <= 10000:
            return Verdict(DENIED, f"delay {value:g} s: allowed {1.0 / air_rate_hz:g} to {10000.0 / air_rate_hz:g} s")
    elif kind == INTERMITTENT:
        if not 0.0 <= value < 1.0:
            return Verdict(DENIED, f"share {value:g}: allowed above 0 and below 1")
        values = (value or SHARE,)
    name = CHANNELS[channel - 1] if channel else ""
    # values in TOML-ready form: the same event written into a scenario makes the same fault
    event = Event(
        0.0, KIND[kind], aircraft, for_s, "air", "", instance - 1, name, tuple(float(v) for v in values), samples
    )
    where = (f"probe {instance}" if instance else "all probes") + (f" {name}" if name else "")
    size = f" {samples} samples" if samples else "".join(f" {v:g}" for v in values)
    return Verdict(ACCEPTED, f"air {where}: {KIND[kind]}{size}" + (f" for {for_s:g} s" if for_s else ""), event)
