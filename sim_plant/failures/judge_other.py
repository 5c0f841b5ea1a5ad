"""What the plant answers to a failure of a sensor other than the air data, of a surface, an engine, the fuel, the radio."""

from __future__ import annotations

from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED
from sim_plant.failures.numbers import (
    DELAY_S,
    DELAYED,
    FLOAT,
    GARBAGE,
    HARDOVER,
    INTERMITTENT,
    KIND,
    OFF,
    OK,
    PLAY,
    SCALE,
    SHARE,
    SIZES,
    SLOW,
    STAMP,
    STAMP_S,
    STUCK,
    UNIT_FUEL,
    UNIT_LINK,
    UNIT_MOTOR,
    WRONG,
    Fitted,
    Verdict,
    default,
)  # fmt: skip
from sim_plant.failures.schedule import CLEAR
from sim_plant.failures.script import PORTS, RANGES, SCALED, STAMPED, Event

LEAK_KGPS = 1.0
SURFACE = {OK: CLEAR, STUCK: "jam", SLOW: "slow", HARDOVER: "hardover", FLOAT: "float", PLAY: "play"}
ENGINE = {OK: "clear_engine", OFF: "engine_off", STUCK: "throttle_stuck", WRONG: "thrust_loss"}
FUEL = {OK: "clear_fuel", SLOW: "leak"}
RADIO = {OK: "clear_radio", OFF: "link_loss", INTERMITTENT: "link_poor"}
NO_VALUE = ("jam", "throttle_stuck", "engine_off", "link_loss")


def _lasts(for_s: float) -> str:
    return f" for {for_s:g} s" if for_s else ""


def judge_sensor(
    group: str, kind: int, channel: int, value: float, for_s: float, aircraft: str, fitted: Fitted
) -> Verdict:
    """A sensor other than the air data: as a whole, or one column of its reading."""
    rate, samples, columns = fitted.rates_hz[group], 0, fitted.columns.get(group, 0)
    values: tuple[float, ...] = ()
    if group not in PORTS.get(KIND[kind], (group,)):
        return Verdict(UNSUPPORTED, f"failure type {kind} of {group}: it has no tube or port that could")
    if not 0 <= channel <= columns:
        return Verdict(DENIED, f"channel {channel}: allowed 1 to {columns} of {group}, 0 = all")
    if kind in SIZES or kind == SCALE:
        values = default(group, kind)
        if len(values) != columns or not columns or (kind == SCALE and group not in SCALED):
            return Verdict(UNSUPPORTED, f"failure type {kind} of {group}: its reading is not of that kind")
        if value and not channel and kind != SCALE and len(set(values)) > 1:
            return Verdict(DENIED, f"value {value:g} without a channel: columns of {group} have different units")
        if kind == GARBAGE and value < 0.0:
            return Verdict(DENIED, f"value {value:g}: garbage needs more than 0")
        values = tuple(value or x for x in values)
        if channel:
            nothing = 1.0 if kind == SCALE else 0.0
            values = tuple(x if c == channel else nothing for c, x in enumerate(values, 1))
    elif channel:
        return Verdict(DENIED, f"channel {channel}: {group} fails as a whole by type {kind}")
    elif kind == STAMP:
        if group not in STAMPED:
            return Verdict(UNSUPPORTED, f"failure type {kind} of {group}: its samples carry no time of their own")
        values = (value or STAMP_S,)
    elif kind == DELAYED:
        samples = round((value or DELAY_S) * rate)
        if not 1 <= samples <= 10000:
            return Verdict(DENIED, f"delay {value:g} s: allowed {1.0 / rate:g} to {10000.0 / rate:g} s")
    elif kind == INTERMITTENT:
        if not 0.0 <= value < 1.0:
            return Verdict(DENIED, f"share {value:g}: allowed above 0 and below 1")
        values = (float(value or SHARE),)
    event = Event(0.0, KIND[kind], aircraft, for_s, group, value=values, samples=samples)
    which = f" column {channel}" if channel else ""
    return Verdict(ACCEPTED, f"{group}{which}: {KIND[kind]}{_lasts(for_s)}", event)


def judge_part(
    unit: int, kind: int, instance: int, value: float, for_s: float, aircraft: str, fitted: Fitted
) -> Verdict:
    """A surface, an engine, the fuel or the radio."""
    if unit == UNIT_MOTOR:
        word, known, names = "an engine", ENGINE, tuple(f"engine {k}" for k in range(1, fitted.engines + 1))
    elif unit == UNIT_FUEL:
        word, known, names = "the fuel", FUEL, ()
    elif unit == UNIT_LINK:
        word, known, names = "the radio", RADIO, ()
    else:
        word, known, names = "a surface", SURFACE, fitted.surfaces
    if kind not in known:
        allowed = ", ".join(f"{k} {w}" for k, w in WORDS.items() if k in known)
        return Verdict(UNSUPPORTED, f"failure type {kind} of {word}: allowed {allowed}")
    surface = known is SURFACE
    if not surface <= instance <= len(names):
        have = ", ".join(f"{k} {s}" for k, s in enumerate(names, 1)) or "no instances: 0"
        return Verdict(DENIED, f"instance {instance}: {aircraft} has {have}")
    what = known[kind]
    if instance and what in ("throttle_stuck", "clear_engine"):
        return Verdict(DENIED, f"instance {instance}: type {kind} is of all engines, 0")
    values: tuple[float, ...] = ()
    if value and (kind == OK or what in NO_VALUE):
        return Verdict(DENIED, f"value {value:g}: type {kind} of {word} takes none")
    if what in ("thrust_loss", "link_poor", "leak"):
        values = (value or {"leak": LEAK_KGPS}.get(what, SHARE),)
    elif value:
        values = (value,)
    if what == "link_poor" and not 0.0 < values[0] < 1.0:
        return Verdict(DENIED, f"share {value:g}: allowed above 0 and below 1")
    if values and what in RANGES:
        low, high, words = RANGES[what]
        if not low <= values[0] <= high or (what == "hardover" and abs(values[0]) != 1.0):
            return Verdict(DENIED, f"value {value:g}: {what} takes {words}")
    name = names[instance - 1] if instance else {UNIT_MOTOR: "engines", UNIT_FUEL: "fuel", UNIT_LINK: "radio"}[unit]
    event = Event(
        0.0, what, aircraft, for_s, surface=name if surface else "", index=-1 if surface else instance - 1, value=values
    )
    size = "".join(f" {v:g}" for v in values)
    return Verdict(ACCEPTED, f"{name}: {what.partition('_')[0] if kind == OK else what}{size}{_lasts(for_s)}", event)


WORDS = {
    OK: "ok", OFF: "off", STUCK: "stuck", WRONG: "wrong", SLOW: "slow", INTERMITTENT: "intermittent", HARDOVER: "hardover",
    FLOAT: "float", PLAY: "play",
}  # fmt: skip
