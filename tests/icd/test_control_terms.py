"""The record of a control law, its limits, and what of it the wire cannot carry."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw import terms
from flightsw.aircraft import load_aircraft
from flightsw.icd.codec_terms import control_terms, refuse_unknown
from flightsw.icd.dialect import HOUSE
from flightsw.icd.wire import Sender
from flightsw.sixdof.actuators import surface_limits
from flightsw.sixdof.command import ControlCore, ScheduleParams, lqr_terms
from flightsw.strict import ConfigError
from flightsw.terms import Controlled, LawTerms, Output, Scheduled
from ground.link.packets import decode


def test_limits_are_those_of_the_icd() -> None:
    assert {v: getattr(terms, word.upper()) for v, word in HOUSE.words("WKF_LIMIT").items()} == {
        1: terms.LOW, 2: terms.HIGH, 4: terms.RATE, 8: terms.INTEGRAL, 16: terms.HELD,
    }  # fmt: skip


def test_what_is_not_sent_is_cut_and_by_which_limit() -> None:
    o = Output("elevator", "rad")
    o.give(0.3, 0.1, -0.05, 0.25)
    assert (o.cut, o.limits, o.sent) == (pytest.approx(0.1), terms.HIGH, pytest.approx(0.25))
    o.give(-0.3, 0.0, 0.0, -0.25)
    assert (o.cut, o.limits) == (pytest.approx(-0.05), terms.LOW)
    o.give(0.1, 0.2, 0.0, 0.30000000000000004)  # the same sum
    assert (o.cut, o.limits) == (0.0, 0)
    assert Scheduled("airspeed", "m/s", 180.0, 200.0, 201.0).limits == terms.HIGH


def test_saturation_and_anti_windup_of_the_scheduled_laws_are_told() -> None:
    ac = load_aircraft("kc135r")
    law = lqr_terms("autopilot", (("airspeed", "m/s"), ("altitude", "m")), ScheduleParams())
    core = ControlCore(ac, law, np.array([1.0, 50.0]))
    core.integrate(np.array([30.0, 2.0]), 0.05)
    assert [(c.error, c.integral, c.limits) for c in law.controlled] == [
        (30.0, 1.0, terms.INTEGRAL), (2.0, pytest.approx(0.1), 0),
    ]  # fmt: skip
    parts = np.zeros((3, 4))
    parts[0], parts[2, 3] = (0.1, 9.0, 0.0, 0.0), 40e3
    u, _ = core.limit(parts.sum(axis=0), 7000.0, 195.0, parts)
    elevator = law.outputs[1]
    assert law.closed and core.saturated and (elevator.limits, elevator.proportional) == (terms.HIGH, 9.0)
    assert elevator.sent == pytest.approx(u[1]) and elevator.cut == pytest.approx(9.0 - surface_limits(ac)[1, 1])
    assert [o.limits for o in law.outputs] == [0, terms.HIGH, 0, 0]
    core.integrate(np.array([30.0, -2.0]), 0.05)
    assert [(c.integral, c.limits) for c in law.controlled] == [(1.0, terms.HELD), (pytest.approx(0.0), 0)]
    core.limit(np.array([0.0, 0.0, 0.0, 40e3]), 7000.0, 195.0)  # a trim
    assert not law.closed and law.outputs[3].feedforward == 40e3 and law.controlled[0].error == 0.0


def test_a_law_goes_over_the_wire() -> None:
    law = LawTerms(
        "autopilot", (Output("elevator", "rad", 0.5, 0.25, 1.0, 0.125, 3),), (Controlled("altitude", "m", -2.0),)
    )
    law.closed = True
    f = decode(control_terms(Sender(1, 1), 7_000_000, (law, LawTerms("other", ())))[: 12 + 175].rstrip(b"\0"))
    assert (f["time_usec"], f["law"], f["closed"], f["place"]) == (7_000_000, "autopilot", 1, 0)
    assert [f[k][0] for k in ("proportional", "integral", "feedforward", "cut")] == [0.5, 0.25, 1.0, 0.125]
    words = HOUSE.words("WKF_QUANTITY")
    assert (words[f["output"][0]], f["output_limit"][0], words[f["controlled"][0]]) == ("elevator", 3, "altitude")
    assert f["error"][0] == -2.0 and f["output"][1:] == [0, 0, 0, 0]


def test_every_entry_of_a_law_goes_into_its_field() -> None:
    number = {word: v for v, word in HOUSE.words("WKF_QUANTITY").items() if word}
    names = list(number)[1:13]
    outputs = tuple(Output(q, "", 1.0 + i, 2.0 + i, 3.0 + i, 4.0 + i, i) for i, q in enumerate(names[:5]))
    controlled = tuple(Controlled(q, "", 5.0 + i, 6.0 + i, i) for i, q in enumerate(names[5:9]))
    schedule = tuple(Scheduled(q, "", 0.0, 8.0, 7.0 + i) for i, q in enumerate(names[9:]))
    f = decode(control_terms(Sender(1, 1), 7_000_000, (LawTerms("full", outputs, controlled, schedule),)))
    for field, first, n in (
        ("proportional", 1, 5), ("integral", 2, 5), ("feedforward", 3, 5), ("cut", 4, 5), ("output_limit", 0, 5),
        ("error", 5, 4), ("error_integral", 6, 4), ("controlled_limit", 0, 4), ("schedule", 7, 3),
    ):  # fmt: skip
        assert f[field] == [first + i for i in range(n)], field
    assert [*f["output"], *f["controlled"], *f["scheduled"]] == [number[q] for q in names]
    assert (f["schedule_limit"], f["closed"], f["law"]) == ([0, 0, terms.HIGH], 0, "full")


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (LawTerms("a", (Output("elevater", "rad"),)), r"law 'a': outputs: 'elevater': .*did you mean 'elevator'"),
        (LawTerms("a", (Output("elevator", "deg"),)), r"law 'a': elevator in 'deg': allowed: 'rad'"),
        (LawTerms("a", tuple(Output("bank", "rad") for _ in range(6))), r"law 'a': 6 outputs: allowed at most 5"),
        (LawTerms("", ()), r"law '': allowed: a name of 1 to 16 bytes"),
    ],
)
def test_what_the_wire_cannot_carry_is_refused_by_name(law: LawTerms, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        refuse_unknown((law,))
    refuse_unknown((LawTerms("b", (Output("bank", "rad"),)), LawTerms("c", ())))
