"""Scripted events of a scenario: what may happen when, and the checks that need no aircraft."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.strict import ConfigError, OneOf, Range
from sim_plant.aircraft.kind import SURFACES
from sim_plant.sensors.config import NonNeg

SENSORS = ("imu", "baro", "mag", "gnss", "air", "att", "rel", "fuel", "boom", "tacan", "radalt")
# whose samples carry a time of their own on the wire
STAMPED = ("gnss", "air", "att", "rel", "fuel", "boom", "tacan", "radalt")
# whose readings are numbers, not an attitude or a reply
SCALED = ("air", "imu", "baro", "mag", "gnss", "rel", "fuel", "boom", "radalt")
_ACTION = "WKF_ACTION_"
ACTIONS: dict[str, int] = {e.name.removeprefix(_ACTION).lower(): v for v, e in ENUMS["WKF_ACTION"].items()}
CMD_REFUEL: int = VALUES["MAV_CMD_USER_1"]  # what an action is sent as
SENSOR_KINDS = (
    "dropout", "off", "bias", "drift", "garbage", "scale", "stuck", "delayed", "intermittent", "spike",
    "frozen", "stamp", "blocked", "iced",
)  # fmt: skip
PORTS = {"blocked": ("air", "baro"), "iced": ("air",)}  # faults of pitot tubes and static port, and of which sensor
ICE, ICE_MAX = 1.0 / 60.0, 100.0  # [1/s] share of the impact pressure an icing tube loses, and the most
BENDS = ("hardover", "float", "slow", "play")
SURFACE_KINDS = ("jam", *BENDS)
ENGINE_KINDS = ("engine_off", "thrust_loss")
KINDS = ("command", *SENSOR_KINDS, "link_loss", "link_poor", *SURFACE_KINDS, *ENGINE_KINDS, "throttle_stuck", "leak")
NEED_VALUE = ("bias", "drift", "garbage", "scale", "spike", "stamp", "thrust_loss", "leak", "link_poor")
_FAULT = ("for_s", "sensor", "index", "channel")
FIELDS = {  # what a kind takes besides t_s, kind, target
    "command": ("action", "command", "params"),
    **dict.fromkeys(("dropout", "off", "stuck"), _FAULT),
    **dict.fromkeys(("bias", "drift", "garbage", "scale", "intermittent"), (*_FAULT, "value")),
    "frozen": _FAULT,
    "blocked": ("for_s", "sensor", "index"),
    "iced": ("for_s", "sensor", "index", "value"),
    "stamp": ("for_s", "sensor", "value"),
    "delayed": (*_FAULT, "samples"),
    "spike": ("sensor", "index", "channel", "value"),
    "link_loss": ("for_s",),
    "link_poor": ("for_s", "value"),
    "jam": ("for_s", "surface"),
    **dict.fromkeys(BENDS, ("for_s", "surface", "value")),
    "engine_off": ("for_s", "index"),
    "thrust_loss": ("for_s", "index", "value"),
    "throttle_stuck": ("for_s",),
    "leak": ("for_s", "value"),
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
    0.5, outages independent); spike (value is added once); frozen (the truth stands still, the sensor's own errors go
    on: a vane frozen in its bearing); stamp (the time of the samples is off by value [s]). Air data: index = one probe,
    channel = V, alpha or beta only. blocked: of air a pitot tube and its drain (total pressure trapped: the airspeed rises
    in a climb), of baro the static port (barometer still, airspeeds wrong with height); iced: of air, the tube closes,
    value = share of the impact pressure lost per second, default 1/60.
    link_loss: the radio is dead; link_poor: intermittently, value = share of the time, mean outage [s]. Surfaces: jam
    (frozen); hardover (to the stop, value = 1 or -1: which); float (free in the flow, value = ratio); slow (value =
    rate [rad/s]); play (value = gap [rad]). Engines, index = which, -1 = all: engine_off; thrust_loss (value = share
    lost). throttle_stuck. leak (of fuel, value [kg/s]).
    """

    t_s: NonNeg
    kind: Annotated[str, OneOf(KINDS)]
    target: str
    for_s: NonNeg = 0.0
    sensor: Annotated[str, OneOf(("", *SENSORS))] = ""
    surface: Annotated[str, OneOf(("", *SURFACES))] = ""
    index: Annotated[int, Range(-1)] = -1  # air-data probe, engine; -1: all
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
    elif e.kind != "command":
        _check_part(at, e)


RANGES = {  # of the value of a fault that is in no sensor: least, most, in words
    "hardover": (-1.0, 1.0, "1 or -1"),
    "float": (0.0, 2.0, "a ratio of 0 to 2"),
    "slow": (1e-4, 10.0, "a rate of 0.0001 to 10 rad/s"),
    "play": (0.0, 1.0, "a gap of 0 to 1 rad"),
    "thrust_loss": (0.0, 1.0, "a share of 0 to 1"),
    "leak": (0.0, 1000.0, "0 to 1000 kg/s"),
}


def _check_part(at: str, e: Event) -> None:
    """A fault of a surface, an engine, the fuel or the radio."""
    if e.kind in SURFACE_KINDS and not e.surface:
        raise ConfigError(f"{at}: a {e.kind} event needs surface, one of {', '.join(SURFACES)}")
    if e.kind in NEED_VALUE and not e.value:
        raise ConfigError(f"{at}: a {e.kind} event needs value")
    if e.kind == "link_poor":
        if not _is_pattern(e.value):
            raise ConfigError(f"{at}.value = {list(e.value)}: {PATTERN.format(e.kind)}")
    elif e.value:
        low, high, words = RANGES[e.kind]
        if len(e.value) != 1 or not low <= e.value[0] <= high or (e.kind == "hardover" and abs(e.value[0]) != 1.0):
            raise ConfigError(f"{at}.value = {list(e.value)}: a {e.kind} event takes {words}")


def _check_fault(at: str, e: Event) -> None:
    if not e.sensor:
        raise ConfigError(f"{at}: a {e.kind} event needs sensor, one of {', '.join(SENSORS)}")
    if e.sensor != "air":
        if e.channel or e.index >= 0:
            key, got = ("channel", repr(e.channel)) if e.channel else ("index", str(e.index))
            raise ConfigError(f"{at}.{key} = {got}: only sensor = 'air' has probes and channels, got {e.sensor!r}")
        if e.kind == "scale" and e.sensor not in SCALED:
            raise ConfigError(f"{at}.kind = 'scale': allowed with sensor = {', '.join(SCALED)}, got {e.sensor!r}")
    if e.sensor not in PORTS.get(e.kind, (e.sensor,)):
        raise ConfigError(f"{at}.sensor = {e.sensor!r}: {e.kind} is of sensor = {' or '.join(PORTS[e.kind])}")
    if e.kind in NEED_VALUE and not e.value:
        raise ConfigError(f"{at}: a {e.kind} event needs value")
    if e.kind == "iced" and e.value and not (len(e.value) == 1 and 0.0 < e.value[0] <= ICE_MAX):
        raise ConfigError(
            f"{at}.value = {list(e.value)}: an iced event takes one rate above 0, up to {ICE_MAX:g} per s"
        )
    if e.kind == "garbage" and min(e.value) < 0.0:
        raise ConfigError(f"{at}.value = {list(e.value)}: a garbage event needs half widths of 0 or more")
    if e.kind == "delayed" and e.samples < 1:
        raise ConfigError(f"{at}.samples = {e.samples}: a delayed event needs 1 or more")
    if e.kind == "intermittent" and e.value and not _is_pattern(e.value):
        raise ConfigError(f"{at}.value = {list(e.value)}: {PATTERN.format(e.kind)}")
    if e.kind == "stamp":
        if e.sensor not in STAMPED:
            raise ConfigError(
                f"{at}.sensor = {e.sensor!r}: its samples carry no time of their own; allowed: {', '.join(STAMPED)}"
            )
        if len(e.value) != 1:
            raise ConfigError(f"{at}.value = {list(e.value)}: a stamp event takes one time in s")


PATTERN = "a {} event takes the share lost (between 0 and 1) and a mean outage in s (more than 0)"


def _is_pattern(value: tuple[float, ...]) -> bool:
    return 0.0 < value[0] < 1.0 and (len(value) == 1 or (len(value) == 2 and value[1] > 0.0))
