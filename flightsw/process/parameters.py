"""Onboard parameters as a ground station sees them: every number of the records in force, under a name of at most 16 characters.

A name follows from the key by one rule (`wire_name`), so that it is the same in every mission and stays when keys are added:
the words of the key, without its unit, in capitals; long words by WORDS; what is still too long loses vowels, then letters,
of its longest words. NAMES has the few keys for which the rule gives a name that is taken.

On the wire every value is a REAL32: for a generic autopilot MAVProxy reads an integer in PARAM_VALUE as a number and
QGroundControl and MAVSDK as a bit pattern; a float all of them read alike. Whole numbers, switches (0, 1) and choices (the place
of the word in its list) are refused anything else.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, get_args

from flightsw.strict import IN_FLIGHT, Names, Range, bare, hints

LONGEST = 16  # [character]
GROUP = 4  # [character] of the first word
NOT_SET = -1.0  # value of a switch or number that is left out, and of a word that is in no list
# suffixes of keys and the units they stand for
UNITS = {
    "1prad": "1/rad", "1ps": "1/s", "F": "-", "N": "N", "deg": "deg", "degps": "deg/s", "degps2": "deg/s^2", "frac": "-",
    "hz": "Hz", "kN": "kN", "kg": "kg", "kgps": "kg/s", "m": "m", "m2": "m^2", "m2ps": "m^2/s", "m2ps3": "m^2/s^3", "mps": "m/s",
    "mps2": "m/s^2", "ms": "ms", "rad": "rad", "radpm": "rad/m", "ps": "1/s",
    "ps2": "1/s^2", "radps": "rad/s", "s": "s", "s2pm": "s^2/m",
    "ticks": "base ticks", "us": "us",
}  # fmt: skip
KEPT = frozenset({"F", "N"})  # units that say which of two keys it is
WORDS = {
    "accelerometer": "ACC", "adaptive": "ADPT", "airdata": "AIR", "alleviation": "ALLV", "altitude": "ALT", "approach": "APP",
    "attitude": "ATT", "breakaway": "BRK", "caution": "CAUT", "common": "COMN", "condition": "COND", "contact": "CONT",
    "correlated": "CORR", "elevator": "ELEV", "escape": "ESC", "estimator": "EST", "gate": "GT", "guidance": "GD",
    "handover": "HOVR", "hazard": "HAZ", "health": "HLTH", "join": "JN", "limit": "LIM", "monitor": "MON", "observation": "OBS",
    "origin": "ORIG", "pilot": "PLT", "position": "POS", "precontact": "PREC", "process": "PROC", "rotational": "ROT",
    "schedule": "SCH", "sensors": "SENS", "sequence": "SEQ", "sigma": "SIG", "track": "TRK", "turbulence": "TURB",
    "velocity": "VEL",
}  # fmt: skip
NAMES: dict[str, str] = {
    "airdata.position.restart_keep_s": "AIR_POS_RST_KP_S",
    "join.guid.v_max_mps": "JN_GUID_VREL_MAX",
    "nav.errors.airspeed_frac": "NAV_ERR_V_FRAC",
    "nav.errors.height_frac": "NAV_ERR_H_FRAC",
    "guid.engine_out.hold_mps": "GUID_ENG_HOLD_V",
    "nav.trust.nis_fast_s": "NAV_TRST_FAST_S",
    "nav.trust.radio_frac": "NAV_TRST_RA_FRAC",
    "nav.trust.nis_s": "NAV_TRUST_NIS_S",
}


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number: its key, its name and value on the wire, what is allowed, and whether it may be changed in flight.

    `kind`: float, int, bool or str (a choice of `words`).
    """

    key: str
    name: str
    kind: type
    value: float
    lo: float = -math.inf
    hi: float = math.inf
    words: tuple[str, ...] = ()
    in_flight: bool = False

    def plain(self, value: float) -> float | int | bool | str:
        """The value of the record for one on the wire. Raises ValueError that says what is allowed."""
        if not math.isfinite(value):
            raise ValueError(f"{self.name} = {value:g}: a finite number is needed")
        if self.kind is float:
            if not self.lo <= value <= self.hi:
                raise ValueError(f"{self.name} = {value:g}: allowed {self.lo:g} to {self.hi:g}")
            return shortest(value)
        if value != math.floor(value) or not self.lo <= value <= self.hi:
            raise ValueError(f"{self.name} = {value:g}: allowed {self._choices()}")
        if self.kind is str:
            return self.words[int(value)]
        return bool(value) if self.kind is bool else int(value)

    def _choices(self) -> str:
        if self.kind is str:
            return ", ".join(f"{i} {w}" for i, w in enumerate(self.words))
        return "0, 1" if self.kind is bool else f"whole numbers {self.lo:g} to {self.hi:g}"


def shortest(value: float) -> float:
    """The number somebody typed, of the 32 bits that came: 0.05, not 0.05000000074505806."""
    return float(f"{value:.7g}")


@cache
def wire_name(key: str) -> str:
    """Name on the wire of a dotted key."""
    if key in NAMES:
        return NAMES[key]
    words = []
    for part in key.split("."):
        of_part = part.split("_")
        if len(of_part) > 1 and of_part[-1] in UNITS and of_part[-1] not in KEPT:
            of_part.pop()
        words += [WORDS.get(w, w.upper()) for w in of_part if w]
    return "_".join(_shortened(words))


def _shortened(words: list[str]) -> list[str]:
    """The same words, cut down until they fit: the longest first, the first of equals. The first word is the group under which
    a ground station shows it: GROUP characters at most, and cut no further."""
    first, *rest = words
    while len(first) > GROUP:
        first = _cut(first)
    while len(first) + sum(len(w) + 1 for w in rest) > LONGEST:
        k = max(range(len(rest)), key=lambda i: len(rest[i]))
        if len(rest[k]) == 1:
            rest.pop(k)
        else:
            rest[k] = _cut(rest[k])
    return [first, *rest]


def _cut(word: str) -> str:
    """A word without its last vowel that is not its first letter; without its last letter where there is none."""
    at = next((i for i in range(len(word) - 1, 0, -1) if word[i] in "AEIOU"), len(word) - 1)
    return word[:at] + word[at + 1 :]


def parameters(records: Iterable[tuple[str, object]]) -> list[Parameter]:
    """Every number of records (name of their table, "" at the top), in order of the fields. A name that is taken, as may be in
    somebody's own mission, gets a number."""
    out: list[Parameter] = []
    taken: set[str] = set()
    for table, record in records:
        for p in _of(record, table):
            name, n = p.name, 1
            while name in taken:
                n += 1
                name = f"{p.name[: LONGEST - 1 - len(str(n))]}~{n}"
            taken.add(name)
            out.append(p if name == p.name else dataclasses.replace(p, name=name))
    return out


def _of(record: object, table: str) -> Iterator[Parameter]:
    if not dataclasses.is_dataclass(record):
        return
    types_ = hints(record.__class__)
    for f in dataclasses.fields(record):
        if f.init:
            key = f"{table}.{f.name}" if table else f.name
            yield from _value(getattr(record, f.name), types_[f.name], key)


def _value(v: Any, tp: Any, key: str) -> Iterator[Parameter]:
    base, marks = bare(tp)
    if dataclasses.is_dataclass(v):
        yield from _of(v, key)
    elif isinstance(v, (tuple, list)):
        args = get_args(base)
        for i, x in enumerate(v):
            of = args[0] if not args or args[-1] is Ellipsis or len(args) != len(v) else args[i]
            inner, more = bare(of)
            yield from _value(x, Annotated[inner, *marks, *more, None], f"{key}.{i}")
    elif isinstance(v, dict):
        for k, x in v.items():
            if dataclasses.is_dataclass(x):
                yield from _of(x, f"{key}.{k}")
    else:
        yield from _number(v, base, marks, key)


def _number(v: Any, base: Any, marks: list[Any], key: str) -> Iterator[Parameter]:
    limit = next((m for m in marks if isinstance(m, Range)), Range())
    choice = next((m for m in marks if isinstance(m, Names)), None)
    free, name = IN_FLIGHT in marks, wire_name(key)
    if base is str:
        if choice is not None:
            words = choice.allowed
            at = float(words.index(v)) if v in words else NOT_SET
            yield Parameter(key, name, str, at, 0.0, len(words) - 1.0, words, free)
    elif base is bool:
        yield Parameter(key, name, bool, NOT_SET if v is None else float(v), 0.0, 1.0, (), free)
    elif base in (int, float):
        yield Parameter(key, name, base, NOT_SET if v is None else float(v), limit.lo, limit.hi, (), free)
