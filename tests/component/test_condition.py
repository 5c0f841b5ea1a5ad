"""What the aircraft says of itself: navigation in doubt, a command at its limit, fuel. A flag rises, is told once, and goes."""

from __future__ import annotations

import pytest

from flightsw.condition import Condition, ConditionParams, refuse_without_tanks
from flightsw.strict import ConfigError
from flightsw.types import HF_FUEL, HF_NAV, HF_SAT, UPD_FUEL, NavState, SensorFrame

CAPACITY = 2900.0  # [kg]
STEP = 0.05  # [s]


def condition(**params: float) -> Condition:
    return Condition(ConditionParams(**params), CAPACITY)


def gauge(c: Condition, t_s: float, kg: float) -> SensorFrame:
    f = SensorFrame(t_us=round(t_s * 1e6), updated=UPD_FUEL, fuel_kg=kg)
    return c.intake(f)[0]


def fly(c: Condition, seconds: float, nav: NavState | None = None, saturated: bool = False) -> None:
    for _ in range(round(seconds / STEP)):
        c.step(nav or NavState(valid=True), saturated, STEP)


def said(c: Condition) -> list[str]:
    out = [t.text for t in c.texts]
    c.texts = []
    return out


def test_a_command_at_its_limit_counts_after_two_seconds_without_a_break() -> None:
    c = condition()
    for _ in range(5):  # an active law touches its limits
        fly(c, 1.5, saturated=True)
        fly(c, 0.1)
    assert not c.flags and not said(c)
    fly(c, 2.1, saturated=True)
    assert c.flags == HF_SAT and said(c) == ["a command has been at its limit for 2 s"]
    fly(c, 0.5)
    assert c.flags == HF_SAT
    fly(c, 0.6)
    assert not c.flags and not said(c)


def test_navigation_that_was_valid_and_is_not_any_more() -> None:
    c = condition()
    fly(c, 3.0, NavState(valid=False, reason="waiting"))
    assert not c.flags and not said(c)  # it has not begun yet
    fly(c, 1.0)
    fly(c, 0.2, NavState(valid=False, reason="estimate left its domain, restarting"))
    assert c.flags == HF_NAV
    assert said(c) == ["navigation: estimate left its domain, restarting"]
    fly(c, 0.9)
    assert c.flags == HF_NAV
    fly(c, 0.2)
    assert not c.flags and said(c) == ["navigation good again"]


def test_valid_navigation_in_doubt() -> None:
    c = condition()
    fly(c, 1.0, NavState(valid=True, trouble="wind sigma 9.1 m/s"))
    assert c.flags == HF_NAV and said(c) == ["navigation: wind sigma 9.1 m/s"]


def test_fuel_low_exhausted_and_good_again() -> None:
    c = condition()
    for t, kg in enumerate((305.0, 291.0, 289.0, 291.0, 289.0)):  # one noisy reading below is not yet low
        gauge(c, t + 1.0, kg)
        assert not c.flags
    gauge(c, 6.0, 285.0)
    assert c.flags == HF_FUEL and said(c) == ["fuel low: 285 kg"]
    for t, kg in enumerate((240.0, 190.0, 140.0, 90.0, 40.0, 34.0, 20.0)):
        gauge(c, t + 7.0, kg)
    assert said(c) == ["fuel exhausted"]
    for t, kg in enumerate((80.0, 150.0, 230.0, 300.0, 360.0)):  # at the boom
        gauge(c, t + 14.0, kg)
    assert said(c) == ["fuel low: 150 kg", "fuel good"]
    assert not c.flags


def test_one_wild_reading_of_the_gauge_is_not_believed_three_are() -> None:
    c = condition()
    gauge(c, 1.0, 1800.0)
    assert gauge(c, 2.0, 0.0).fuel_kg == 1800.0  # what navigation weighs the aircraft with
    assert gauge(c, 3.0, 1799.0).fuel_kg == 1799.0
    assert [gauge(c, 4.0 + k, 500.0).fuel_kg for k in range(3)] == [1799.0, 1799.0, 500.0]
    assert gauge(c, 8.0, 1e6).fuel_kg == 500.0
    assert not c.flags and not said(c)


def test_a_silent_gauge_is_lost() -> None:
    c = condition()
    c.intake(SensorFrame(t_us=60_000_000))  # an aircraft whose gauge never spoke
    assert not c.flags
    gauge(c, 61.0, 1800.0)
    c.intake(SensorFrame(t_us=65_900_000))
    assert not c.flags
    c.intake(SensorFrame(t_us=66_100_000))
    assert c.flags == HF_FUEL and said(c) == ["fuel gauge lost"]
    gauge(c, 67.0, 1790.0)
    assert not c.flags and said(c) == ["fuel good"]


@pytest.mark.parametrize("capacity", [0.0])
def test_an_aircraft_without_a_gauge_says_nothing_of_fuel(capacity: float) -> None:
    c = Condition(ConditionParams(), capacity)
    for t in range(20):
        assert gauge(c, float(t), 0.0).updated == UPD_FUEL
    assert not c.flags and not said(c)


def test_limits_of_a_gauge_are_refused_where_there_are_no_tanks() -> None:
    refuse_without_tanks(ConditionParams(saturated_s=3.0), 0.0)
    refuse_without_tanks(ConditionParams(fuel_low_frac=0.2), CAPACITY)
    with pytest.raises(
        ConfigError, match=r"condition\.fuel_low_frac = 0\.2: nothing obeys it on an aircraft without tanks"
    ):
        refuse_without_tanks(ConditionParams(fuel_low_frac=0.2), 0.0)
