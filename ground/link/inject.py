"""`ground send inject`: make a part of a simulated aircraft fail, MAV_CMD_INJECT_FAILURE to the plant's own port.

What the parameters mean is in the message ICD (MAV_CMD_INJECT_FAILURE, FAILURE_UNIT, FAILURE_TYPE): unit, type, probe,
channel, value (SI), duration.
"""

from __future__ import annotations

import math

from flightsw.icd.dialect import HOUSE
from ground.link.command import COMP_PLANT, CommandError, Order

CMD_INJECT = 420  # MAV_CMD_INJECT_FAILURE


UNITS = {word.removeprefix("sensor_"): v for v, word in HOUSE.words("FAILURE_UNIT").items()}
TYPES = {word: v for v, word in HOUSE.words("FAILURE_TYPE").items()}
USUAL = 2  # [-] system id that fails where none is named
ALIASES = {"bias": "wrong", "drift": "slow", "clear": "ok"}
PROBES = {"all": 0, "nose": 1, "left": 2, "right": 3}
CHANNELS = {"all": 0, "V": 1, "alpha": 2, "beta": 3}
NO_VALUE = ("ok", "off", "stuck", "frozen", "blocked")


def _choice(name: str, word: str, known: dict[str, int]) -> int:
    """Value of a word, or of its number. Raises CommandError listing the words."""
    for key, value in known.items():
        if word.lower() in (key.lower(), str(value)):
            return value
    raise CommandError(f"unknown {name} {word!r}; known: {', '.join(known)}")


def _place(name: str, word: str, known: dict[str, int]) -> int:
    """As `_choice`; also the number of an engine, surface or column, which the plant knows and judges."""
    return int(word) if word.isdecimal() and int(word) < 100 else _choice(name, word, known)


def inject(
    value: float | None,
    kind: str,
    unit: str = "airspeed",
    probe: str = "all",
    channel: str = "all",
    for_s: float = 0.0,
    to: int | None = None,
) -> Order:
    """The command: `value` in SI (m/s for V, rad for angles; meaning by `kind`; None: the plant's default), `for_s` [s],
    0 = until cleared.

    Words or numbers of the ICD for kind, unit, probe and channel. Raises CommandError naming what is wrong.
    """
    word = ALIASES.get(kind.lower(), kind)
    number = _choice("type", word, TYPES)
    word = next(k for k, v in TYPES.items() if v == number)
    if value is not None and word in NO_VALUE:
        raise CommandError(f"type {kind!r} takes no value, got {value:g}")
    for name, number_ in (("value", value or 0.0), ("--for", for_s)):
        if not math.isfinite(number_):
            raise CommandError(f"{name} {number_!r} is not a finite number")
    if for_s < 0.0:
        raise CommandError(f"--for {for_s:g} s: 0 (until cleared) or more")
    where = (_place("probe", probe, PROBES), _place("channel", channel, CHANNELS))
    params = (float(_choice("unit", unit, UNITS)), float(number), *map(float, where), value or 0.0, for_s, 0.0)
    text = f"inject {word} into {unit} probe {probe} channel {channel}"
    text += "" if value is None else f", value {value:g}"
    text += f", for {for_s:g} s" if for_s else ""
    return Order(USUAL if to is None else to, CMD_INJECT, params, text, COMP_PLANT)
