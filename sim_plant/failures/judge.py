"""MAV_CMD_INJECT_FAILURE as the plant understands it: which failures it can make, and what it answers.

param1 FAILURE_UNIT, param2 FAILURE_TYPE, param3 instance (probe 1 .. n, 0 = all; surface), and in the parameters the standard
reserves, of the air data: param4 channel (1 V, 2 alpha, 3 beta, 0 = all), param5 value (SI; 0 = the default), param6 duration [s]
(0 = until cleared). Types: OFF off; STUCK stuck at the last value; GARBAGE uniform within +-value; WRONG bias; SLOW drift,
value per second; DELAYED by value [s]; INTERMITTENT a share `value` of the samples lost; OK clears the channels named.
The other sensors fail as a whole (OFF, STUCK, DELAYED, INTERMITTENT), a surface jams (STUCK), the radio goes dead (OFF).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED
from sim_plant.failures.schedule import CLEAR
from sim_plant.failures.script import CHANNELS, CMD_INJECT_FAILURE, Event

UNIT_AIRSPEED = 8  # FAILURE_UNIT_SENSOR_AIRSPEED
UNIT_SERVO, UNIT_LINK = 102, 105  # FAILURE_UNIT_SYSTEM_SERVO, _MAVLINK_SIGNAL
GROUPS = {
    0: "imu",
    1: "imu",
    2: "mag",
    3: "baro",
    4: "gnss",
    6: "rel",
    7: "tacan",
    UNIT_AIRSPEED: "air",
}  # FAILURE_UNIT_SENSOR_*
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


@dataclass(frozen=True)
class Fitted:
    """What of an aircraft can fail: probes and rate [Hz] of its air data, rates of its other sensors, surfaces, a radio."""

    probes: int = 0
    air_rate_hz: float = 0.0
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    surfaces: tuple[str, ...] = ()
    radio: bool = False

    def units(self) -> list[str]:
        """FAILURE_UNITs it has, in words."""
        have = [f"{u} ({g})" for u, g in GROUPS.items() if (self.probes if g == "air" else g in self.rates_hz)]
        have += [f"{UNIT_SERVO} (surface)"] if self.surfaces else []
        return have + ([f"{UNIT_LINK} (radio)"] if self.radio else [])


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
    known = probes if group == "air" else group in fitted.rates_hz
    if not (known or (unit == UNIT_SERVO and fitted.surfaces) or (unit == UNIT_LINK and fitted.radio)):
        return Verdict(UNSUPPORTED, f"failure unit {unit}: {aircraft} has {', '.join(fitted.units()) or 'none'}")
    if kind not in KIND:
        return Verdict(UNSUPPORTED, f"failure type {kind}: allowed 0 to {INTERMITTENT}")
    if group != "air":
        return _whole(group, unit, kind, instance, value, for_s, aircraft, fitted)
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


def _whole(
    group: str, unit: int, kind: int, instance: int, value: float, for_s: float, aircraft: str, fitted: Fitted
) -> Verdict:
    """A sensor as a whole, a surface or the radio."""
    if for_s < 0.0:
        return Verdict(DENIED, f"duration {for_s:g} s: 0 or more")
    lasts = f" for {for_s:g} s" if for_s else ""
    if unit == UNIT_SERVO:
        names = ", ".join(f"{k} {s}" for k, s in enumerate(fitted.surfaces, 1))
        if kind not in (OK, STUCK):
            return Verdict(UNSUPPORTED, f"failure type {kind} of a surface: allowed {OK} ok, {STUCK} stuck")
        if not 1 <= instance <= len(fitted.surfaces):
            return Verdict(DENIED, f"instance {instance}: {aircraft} has {names}")
        surface = fitted.surfaces[instance - 1]
        what = CLEAR if kind == OK else "jam"
        return Verdict(ACCEPTED, f"{surface}: {what}{lasts}", Event(0.0, what, aircraft, for_s, surface=surface))
    if unit == UNIT_LINK:
        if kind not in (OK, OFF):
            return Verdict(UNSUPPORTED, f"failure type {kind} of the radio: allowed {OK} ok, {OFF} off")
        what = CLEAR if kind == OK else "link_loss"
        return Verdict(ACCEPTED, f"radio: {what}{lasts}", Event(0.0, what, aircraft, for_s))
    if kind in DEFAULT:
        why = "its readings have different units; a scenario gives each its own"
        return Verdict(UNSUPPORTED, f"failure type {kind} of {group}: {why}")
    rate, samples = fitted.rates_hz[group], 0
    values: tuple[float, ...] = ()
    if kind == DELAYED:
        samples = round((value or DELAY_S) * rate)
        if not 1 <= samples <= 10000:
            return Verdict(DENIED, f"delay {value:g} s: allowed {1.0 / rate:g} to {10000.0 / rate:g} s")
    elif kind == INTERMITTENT:
        if not 0.0 <= value < 1.0:
            return Verdict(DENIED, f"share {value:g}: allowed above 0 and below 1")
        values = (float(value or SHARE),)
    event = Event(0.0, KIND[kind], aircraft, for_s, group, value=values, samples=samples)
    return Verdict(ACCEPTED, f"{group}: {KIND[kind]}{lasts}", event)
