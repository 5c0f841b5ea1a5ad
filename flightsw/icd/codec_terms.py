"""Control laws' records to CONTROL_TERMS: one packet for each law."""

from __future__ import annotations

from flightsw.icd.dialect import ENUMS, HOUSE
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.strict import ConfigError, near
from flightsw.terms import Laws, LawTerms

OUTPUTS, CONTROLLED, SCHEDULED, LAW = 5, 4, 3, 16  # entries of the message, bytes of a law's name
ENUM = "WKF_QUANTITY"
_SPEC = BY_NAME["CONTROL_TERMS"]
_NUMBER = {word: v for v, word in HOUSE.words(ENUM).items()}
# where each of its fields begins
(
    _TIME, _PROPORTIONAL, _INTEGRAL, _FEEDFORWARD, _CUT, _ERROR, _ERROR_INTEGRAL, _SCHEDULE, _OUTPUT, _OUTPUT_LIMIT,
    _CONTROLLED, _CONTROLLED_LIMIT, _SCHEDULED, _SCHEDULE_LIMIT, _PLACE, _CLOSED, _LAW,
) = [
    _SPEC.slots[name][0]
    for name in (
        "time_usec", "proportional", "integral", "feedforward", "cut", "error", "error_integral", "schedule", "output",
        "output_limit", "controlled", "controlled_limit", "scheduled", "schedule_limit", "place", "closed", "law",
    )
]  # fmt: skip


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


def _packet(send: Sender, t_us: int, place: int, t: LawTerms) -> bytes:
    row = _SPEC.blank.copy()  # entries the law does not have stay 0
    for i, o in enumerate(t.outputs):
        row[_PROPORTIONAL + i], row[_INTEGRAL + i], row[_FEEDFORWARD + i] = o.proportional, o.integral, o.feedforward
        row[_CUT + i], row[_OUTPUT + i], row[_OUTPUT_LIMIT + i] = o.cut, _NUMBER[o.name], o.limits
    for i, c in enumerate(t.controlled):
        row[_ERROR + i], row[_ERROR_INTEGRAL + i] = c.error, c.integral
        row[_CONTROLLED + i], row[_CONTROLLED_LIMIT + i] = _NUMBER[c.name], c.limits
    for i, s in enumerate(t.schedule):
        row[_SCHEDULE + i], row[_SCHEDULED + i], row[_SCHEDULE_LIMIT + i] = s.value, _NUMBER[s.name], s.limits
    row[_TIME], row[_PLACE], row[_CLOSED], row[_LAW] = t_us, place, 1 if t.closed else 0, t.law.encode()
    return send.pack(_SPEC, *row)
