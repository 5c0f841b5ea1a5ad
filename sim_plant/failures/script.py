"""Scripted events of a scenario: what may happen when, and the checks that need no aircraft."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.strict import ConfigError, OneOf, Range
from sim_plant.aircraft.kind import SURFACES
from sim_plant.sensors.config import NonNeg

SENSORS = ("imu", "baro", "mag", "gnss", "air", "att", "rel", "fuel", "boom", "tacan")
_ACTION = "WKF_ACTION_"
ACTIONS: dict[str, int] = {e.name.removeprefix(_ACTION).lower(): v for v, e in ENUMS["WKF_ACTION"].items()}
CMD_REFUEL: int = VALUES["MAV_CMD_USER_1"]  # what an action is sent as
SENSOR_KINDS = (
    "dropout", "off", "bias", "drift", "garbage", "scale", "stuck", "delayed", "intermittent", "spike",
)  # fmt: skip
KINDS = ("command", *SENSOR_KINDS, "link_loss", "jam")
NEED_VALUE = ("bias", "drift", "garbage", "scale", "spike")
_FAULT = ("for_s", "sensor", "index", "channel")
FIELDS = {  # what a kind takes besides t_s, kind, target
    "command": ("action", "command", "params"),
    **dict.fromkeys(("dropout", "off", "stuck"), _FAULT),
    **dict.fromkeys(("bias", "drift", "garbage", "scale", "intermittent"), (*_FAULT, "value")),
    "delayed": (*_FAULT, "samples"),
    "spike": ("sensor", "index", "channel", "value"),
    "link_loss": ("for_s",),
    "jam": ("for_s", "surface"),
}
CHANNELS = ("V", "alpha", "beta")  # of a probe, in the order of the plant's error rows
CMD_INJECT_FAILURE = 420  # MAV_CMD, the one command the plant itself takes
PLANT = "plant"  # target of a command to the plant: "plant" (every aircraft) or "plant.<aircraft>"


@dataclass(frozen=True)
class Event:
    """One scripted event; for_s = 0 lasts to the end of the run.

    command: action (of the refuelling), or command + params; to an aircraft, or to the plant (target "plant.<aircraft>",
    command 420, params as in `inject`). Faults of a sensor, value in the unit of the reading (SI, radians), one for all columns
    concerned or one each: off, dropout (no more samples); bias (value is added); drift (value per second is added); garbage
    (uniform within +-value is added, fresh each sample); scale (reading times value); stuck (last value, fresh stamps);
    delayed (`samples` samples late, fresh stamps); intermittent (value = share of the samples lost, mean outage [s]; default
    0.5, outages independent); spike (value is added once). Air data: index = one probe, channel = V, alpha or beta only.
    link_loss: the radio is dead. jam: surface frozen.
    """

    t_s: NonNeg
    kind: Annotated[str, OneOf(KINDS)]
    target: str
    for_s: NonNeg = 0.0
    sensor: Annotated[str, OneOf(("", *SENSORS))] = ""
    surface: Annotated[str, OneOf(("", *SURFACES))] = ""
    index: Annotated[int, Range(-1)] = -1  # air-data probe; -1: the whole group
    channel: Annotated[str, OneOf(("", *CHANNELS))] = ""  # of the probe(s); empty: all three
    value: tuple[float, ...] = ()
    samples: Annotated[int, Range(0, 10000)] = 0  # delayed: by how many
    action: Annotated[str, OneOf(("", *ACTIONS))] = ""
    command: Annotated[int, Range(0, 65535)] = 0  # MAV_CMD where action does not serve
    params: tuple[float, ...] = ()


def plant_targets(target: str, names: list[str]) -> list[str]:
    """Aircraft a command to the plant concerns; empty if `target` is not the plant."""
    if target == PLANT:
        return list(names)
    head, _, name = target.partition(".")
    return [name] if head == PLANT and name in names else []


def check_event(at: str, e: Event, names: list[str]) -> None:
    """Raise ConfigError naming `at` and what is allowed if the event's fields do not fit together."""
    for f in fields(e):
        if f.name in ("t_s", "kind", "target", *FIELDS[e.kind]) or getattr(e, f.name) == f.default:
            continue
        raise ConfigError(
            f"{at}.{f.name} = {getattr(e, f.name)!r}: a {e.kind} event has none; it takes {', '.join(FIELDS[e.kind])}"
        )
    to_plant = bool(plant_targets(e.target, names))
    if e.target not in names and not (to_plant and e.kind == "command"):
        also = f", {PLANT}, " + ", ".join(f"{PLANT}.{n}" for n in names) if e.kind == "command" else ""
        raise ConfigError(f"{at}.target = {e.target!r}: allowed: {', '.join(names)}{also}")
    if len(e.params) > 7:
        raise ConfigError(f"{at}.params: at most 7 values, got {len(e.params)}")
    if e.kind == "command":
        if to_plant and (e.action or e.command != CMD_INJECT_FAILURE):
            got = f"action = {e.action!r}" if e.action else f"command = {e.command}"
            raise ConfigError(f"{at}: {got}: the plant takes command = {CMD_INJECT_FAILURE} (inject failure) only")
        if bool(e.action) == bool(e.command):
            raise ConfigError(
                f"{at}: a command event needs action (one of {', '.join(ACTIONS)}) or command, one of the two"
            )
        if e.action and e.params[:1] not in ((), (float(ACTIONS[e.action]),)):
            raise ConfigError(
                f"{at}.params[0] = {e.params[0]:g}: action = {e.action!r} is {ACTIONS[e.action]}; allowed: that, or no params"
            )
    if e.kind in SENSOR_KINDS:
        _check_fault(at, e)
    if e.kind == "jam" and not e.surface:
        raise ConfigError(f"{at}: a jam event needs surface, one of {', '.join(SURFACES)}")


def _check_fault(at: str, e: Event) -> None:
    if not e.sensor:
        raise ConfigError(f"{at}: a {e.kind} event needs sensor, one of {', '.join(SENSORS)}")
    if e.sensor != "air":
        if e.channel or e.index >= 0:
            key, got = ("channel", repr(e.channel)) if e.channel else ("index", str(e.index))
            raise ConfigError(f"{at}.{key} = {got}: only sensor = 'air' has probes and channels, got {e.sensor!r}")
        if e.kind == "scale":
            raise ConfigError(f"{at}.kind = 'scale': only sensor = 'air' can be scaled, got {e.sensor!r}")
    if e.kind in NEED_VALUE and not e.value:
        raise ConfigError(f"{at}: a {e.kind} event needs value")
    if e.kind == "garbage" and min(e.value) < 0.0:
        raise ConfigError(f"{at}.value = {list(e.value)}: a garbage event needs half widths of 0 or more")
    if e.kind == "delayed" and e.samples < 1:
        raise ConfigError(f"{at}.samples = {e.samples}: a delayed event needs 1 or more")
    if e.kind == "intermittent" and e.value and not _is_pattern(e.value):
        raise ConfigError(
            f"{at}.value = {list(e.value)}: an intermittent event takes the share of samples lost (between 0 and 1) "
            "and a mean outage in s (more than 0)"
        )


def _is_pattern(value: tuple[float, ...]) -> bool:
    return 0.0 < value[0] < 1.0 and (len(value) == 1 or (len(value) == 2 and value[1] > 0.0))
