"""A table that sets some keys of a record leaves the rest as that record's own default has them, not as its class has."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from flightsw.missions.gust.laws import GustCtrlTable
from flightsw.missions.receiver.en_route import JoinTable
from flightsw.strict import ConfigError, convert
from sim_plant.aircraft.alexis.member import AlexisTable


@dataclass(frozen=True)
class Inner:
    """Two keys."""

    a: float = 1.0
    b: float = 2.0


@dataclass(frozen=True)
class Outer:
    """A record whose default differs from that of its class, and one that must be given."""

    must: Inner
    own: Inner = field(default_factory=lambda: Inner(10.0, 20.0))
    deep: dict[str, Inner] = field(default_factory=dict)


def test_partial_tables_change_the_records_own_default() -> None:
    got = convert({"must": {"b": 5}, "own": {"a": 11}, "deep": {"x": {"a": 3}}}, Outer, "t")
    assert got == Outer(Inner(1.0, 5.0), Inner(11.0, 20.0), {"x": Inner(3.0, 2.0)})
    with pytest.raises(ConfigError, match=r"t: must: missing key"):
        convert({"own": {"a": 1.0}}, Outer, "t")


def test_one_key_of_a_law_or_a_table_leaves_its_others_alone() -> None:
    """A single override must not bring back the defaults of another aircraft or law."""
    plain = JoinTable()
    assert convert({"ctrl": {"w_alt_m": 6.0}}, JoinTable, "t").ctrl.w_input == plain.ctrl.w_input
    assert convert({"ctrl": {"schedule": {"h_m": 6900.0}}}, JoinTable, "t").ctrl.schedule.V_mps == (185.0, 215.0)
    law = convert({"elevator": {"H": 40.0}}, GustCtrlTable, "t").elevator
    assert (law.H, law.V_K, law.use_flap) == (40.0, 50.0, False)
    assert convert({"wind": {"L_u_m": 90.0}}, AlexisTable, "t").wind.sigma_w_mps == 0.0  # calm unless it says otherwise


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"alleviation": {"late_steps": 2}}, r"ctrl\.alleviation\.late_steps = 2: given by link\.delay_ticks"),
        ({"elevator": {"use_flap": True}}, r"ctrl\.elevator\.use_flap, flap: this law has no flap"),
        ({"elevator": {"flap": 0.5}}, r"ctrl\.elevator\.use_flap, flap: this law has no flap"),
    ],
)
def test_weights_a_law_has_no_use_for_are_refused(table: dict[str, object], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        convert(table, GustCtrlTable, "t")
