"""Control laws' records to CONTROL_TERMS: one packet for each law."""

from __future__ import annotations

from functools import lru_cache
from operator import attrgetter

from flightsw.icd.dialect import ENUMS, HOUSE
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.strict import ConfigError, near
from flightsw.terms import Laws, LawTerms

OUTPUTS, CONTROLLED, SCHEDULED, LAW = 5, 4, 3, 16  # entries of the message, bytes of a law's name
ENUM = "WKF_QUANTITY"
_SPEC = BY_NAME["CONTROL_TERMS"]
_NUMBER = {word: v for v, word in HOUSE.words(ENUM).items()}
_OUTPUT = attrgetter("proportional", "integral", "feedforward", "cut", "limits", "name")
_CONTROLLED = attrgetter("error", "integral", "limits", "name")
_SCHEDULED = attrgetter("value", "limits", "name")
# what stands in entries a law does not have
_NO_OUTPUT, _NO_CONTROLLED = ((0.0, 0.0, 0.0, 0.0, 0, ""),) * OUTPUTS, ((0.0, 0.0, 0, ""),) * CONTROLLED
_NO_SCHEDULED = ((0.0, 0, ""),) * SCHEDULED


def unit(quantity: int) -> str:
    """Unit of a WKF_QUANTITY, as its description begins: "[rad/s] ..."; "" where there is none, or no such quantity."""
    entry = ENUMS[ENUM].get(quantity)
    head, closed, _ = (entry.description if entry else "").partition("]")
    return head.removeprefix("[") if closed and head.startswith("[") and head != "[-" else ""


def refuse_unknown(laws: Laws) -> None:
    """Raises ConfigError naming law and quantity that the message cannot carry: a name or unit that is none of WKF_QUANTITY, more
    of them than there are entries, a law's name that is too long or there twice."""
    for t in laws:
        for what, parts, most in (
            ("outputs", t.outputs, OUTPUTS), ("controlled", t.controlled, CONTROLLED), ("schedule", t.schedule, SCHEDULED),
        ):  # fmt: skip
            if len(parts) > most:
                raise ConfigError(f"law {t.law!r}: {len(parts)} {what}: allowed at most {most}")
            for q in parts:
                if q.name not in _NUMBER:
                    known = f"a word of {ENUM}, which a dialect may add to{near(q.name, _NUMBER)}"
                    raise ConfigError(f"law {t.law!r}: {what}: {q.name!r}: allowed: {known}")
                if unit(_NUMBER[q.name]) != q.unit:
                    raise ConfigError(f"law {t.law!r}: {q.name} in {q.unit!r}: allowed: {unit(_NUMBER[q.name])!r}")
        if not 0 < len(t.law.encode()) <= LAW or sum(o.law == t.law for o in laws) > 1:
            raise ConfigError(f"law {t.law!r}: allowed: a name of 1 to {LAW} bytes, each once")


def control_terms(send: Sender, t_us: int, laws: Laws) -> bytes:
    """CONTROL_TERMS of every law at sample time `t_us` [us]."""
    return b"".join([_packet(send, t_us, k, t) for k, t in enumerate(laws)])


@lru_cache(maxsize=256)
def _numbers(names: tuple[str, ...]) -> list[int]:
    """WKF_QUANTITY of each name of a column, 0 of none: a law has the same ones all its life."""
    return [_NUMBER[n] if n else 0 for n in names]


def _packet(send: Sender, t_us: int, place: int, t: LawTerms) -> bytes:
    o, c, s = t.outputs, t.controlled, t.schedule
    # by columns
    proportional, integral, feedforward, cut, o_limits, o_names = zip(
        *map(_OUTPUT, o), *_NO_OUTPUT[len(o) :], strict=True
    )
    error, summed, c_limits, c_names = zip(*map(_CONTROLLED, c), *_NO_CONTROLLED[len(c) :], strict=True)
    value, s_limits, s_names = zip(*map(_SCHEDULED, s), *_NO_SCHEDULED[len(s) :], strict=True)
    return send.pack(
        _SPEC, t_us, *proportional, *integral, *feedforward, *cut, *error, *summed, *value,
        *_numbers(o_names), *o_limits, *_numbers(c_names), *c_limits, *_numbers(s_names), *s_limits, place,
        1 if t.closed else 0, t.law.encode(),
    )  # fmt: skip
