"""MAV_CMD_INJECT_FAILURE as the plant understands it: which failures it can make, and what it answers.

param1 FAILURE_UNIT, param2 FAILURE_TYPE, param3 instance (probe, engine or surface 1 .. n, 0 = all), and in the parameters the
standard reserves: param4 channel (of the air data 1 V, 2 alpha, 3 beta, of another sensor its column; 0 = all), param5 value (SI;
0 = the default), param6 duration [s] (0 = until cleared). What the types do: FAILURE_TYPE of the message ICD; numbers.py here.
"""

from __future__ import annotations

import math

from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED
from sim_plant.failures.judge_other import judge_part, judge_sensor
from sim_plant.failures.numbers import (
    AIR_DEFAULT,
    BLOCKED,
    DELAY_S,
    DELAYED,
    GARBAGE,
    GROUPS,
    ICED,
    INTERMITTENT,
    KIND,
    NO_VALUE,
    OK,
    SCALE,
    SHARE,
    SPIKE,
    STAMP,
    STAMP_S,
    Fitted,
    Verdict,
)  # fmt: skip
from sim_plant.failures.script import CHANNELS, CMD_INJECT_FAILURE, ICE_MAX, Event


def judge(command: int, params: tuple[float, ...], aircraft: str, fitted: Fitted) -> Verdict:
    """What the plant answers to `command` for an aircraft."""
    probes, air_rate_hz = fitted.probes, fitted.air_rate_hz
    if command != CMD_INJECT_FAILURE:
        return Verdict(UNSUPPORTED, f"command {command}: the plant takes {CMD_INJECT_FAILURE} (inject failure) only")
    p = (*params, *([0.0] * (7 - len(params))))[:7]
    # what the standard reserves comes as "not used" from clients that know no more than it
    p = (*p[:3], *(0.0 if math.isnan(x) else x for x in p[3:]))
    if not all(math.isfinite(x) for x in p[:6]) or not all(x == math.floor(x) for x in p[:4]):
        return Verdict(DENIED, f"parameters {list(p[:6])}: numbers, the first four of them whole, are needed")
    unit, kind, instance, channel = (int(x) for x in p[:4])
    value, for_s = p[4], p[5]
    group = GROUPS.get(unit, "")
    if not fitted.has(unit):
        return Verdict(UNSUPPORTED, f"failure unit {unit}: {aircraft} has {', '.join(fitted.units()) or 'none'}")
    if for_s < 0.0:
        return Verdict(DENIED, f"duration {for_s:g} s: 0 or more")
    if for_s and kind in (OK, SPIKE):
        return Verdict(DENIED, f"duration {for_s:g} s: failure type {kind} lasts no time")
    if not group:
        return judge_part(unit, kind, instance, value, for_s, aircraft, fitted)
    if kind not in KIND:
        allowed = f"0 to {INTERMITTENT}, {SPIKE} to {STAMP}, {BLOCKED}, {ICED} of a sensor"
        return Verdict(UNSUPPORTED, f"failure type {kind}: allowed {allowed}")
    if value and kind in NO_VALUE:
        return Verdict(DENIED, f"value {value:g}: failure type {kind} takes none")
    if group != "air":
        if instance not in (0, 1):
            return Verdict(DENIED, f"instance {instance}: {aircraft} has one {group}, 1, 0 = all")
        return judge_sensor(group, kind, channel, value, for_s, aircraft, fitted)
    if not 0 <= instance <= probes:
        return Verdict(DENIED, f"instance {instance}: {aircraft} has probes 1 to {probes}, 0 = all")
    if not 0 <= channel <= len(CHANNELS):
        return Verdict(DENIED, f"channel {channel}: allowed 1 V, 2 alpha, 3 beta, 0 = all")
    if kind == STAMP and (instance or channel):
        return Verdict(DENIED, f"failure type {kind} of the air data: of all probes and channels at once, or of none")
    if kind in (BLOCKED, ICED) and channel:
        return Verdict(DENIED, f"failure type {kind} of the air data: of a pitot tube, channel 0")
    if value and not channel and kind in AIR_DEFAULT and kind != SCALE:
        return Verdict(DENIED, f"value {value:g} without a channel: V and angles have different units")
    values: tuple[float, ...] = ()
    samples = 0
    if kind in AIR_DEFAULT:
        own: tuple[float, ...] = AIR_DEFAULT[kind] if not channel else (value or AIR_DEFAULT[kind][channel - 1],)
        if value and kind == SCALE:
            own = (value,) * len(own)
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
    elif kind == STAMP:
        values = (value or STAMP_S,)
    elif kind == ICED and value:
        if not 0.0 < value <= ICE_MAX:
            return Verdict(DENIED, f"rate {value:g} 1/s: allowed above 0, up to {ICE_MAX:g}")
        values = (value,)
    name = CHANNELS[channel - 1] if channel else ""
    # values in TOML-ready form: the same event written into a scenario makes the same fault
    event = Event(
        0.0, KIND[kind], aircraft, for_s, "air", "", instance - 1, name, tuple(float(v) for v in values), samples
    )
    where = (f"probe {instance}" if instance else "all probes") + (f" {name}" if name else "")
    size = f" {samples} samples" if samples else "".join(f" {v:g}" for v in values)
    return Verdict(ACCEPTED, f"air {where}: {KIND[kind]}{size}" + (f" for {for_s:g} s" if for_s else ""), event)
