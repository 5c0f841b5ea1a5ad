"""A law or a guidance named in the parameters: ours, somebody else's, or refused by the name of the key."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flightsw.app import FlightApp
from flightsw.missions.tanker.racetrack import PathGuidance, RacetrackGuidance, RacetrackParams, make_path
from flightsw.strict import ConfigError
from flightsw.types import GuidanceCmd, NavState, SensorFrame, Text, Vec3
from tests.keys.own import Path

HERE = __name__


class Mute:
    """Lacks what it takes."""

    def __init__(self, p: RacetrackParams) -> None:
        self.V = p.V_mps

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        return GuidanceCmd()


class Silent(Mute):
    """Has no texts."""

    def set_speed(self, V: float, lo: float, hi: float) -> tuple[bool, str]:
        return True, ""

    def take_over(self, psi: float, V: float, psi_dot: float) -> None:
        return

    def use(self, p: RacetrackParams) -> None:
        return

    def route(self) -> tuple[Vec3, ...]:
        return ()


class Short(Silent):
    """A step that takes other things."""

    texts: tuple[Text, ...] = ()

    def step(self, f: SensorFrame) -> GuidanceCmd:  # type: ignore[override]
        return GuidanceCmd()


class TwoTables(Silent):
    """Made from more than it is given."""

    def __init__(self, p: RacetrackParams, q: RacetrackParams) -> None:
        super().__init__(p)


def test_ours_and_anybody_s_are_made_of_the_same_things() -> None:
    p = RacetrackParams()
    assert type(make_path(p)) is RacetrackGuidance
    other = make_path(RacetrackParams(path="tests.keys.own:Path"))
    assert isinstance(other, Path) and isinstance(other, PathGuidance) and p.V_mps - 5.0 == other.V


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("racetrac", r"allowed: racetrack, or package\.module:Class; did you mean 'racetrack'"),
        ("no.such.module:Path", "cannot be imported: No module named 'no'"),
        ("tests.keys.own:Nobody", "cannot be imported: .*has no attribute 'Nobody'"),
        (":Path", "cannot be imported"),
        ("math:pi", "is 3.14.*; allowed: a class that is a PathGuidance"),
        (f"{HERE}:TwoTables", r"takes \(p: .*, q: .*\).*: missing a required argument: 'q'"),
        (
            f"{HERE}:Mute",
            r"lacks route, set_speed, take_over, use of flightsw\.missions\.tanker\.racetrack\.PathGuidance",
        ),
        (f"{HERE}:Silent", r"lacks texts of flightsw\.missions\.tanker\.racetrack\.PathGuidance"),
        (f"{HERE}:Short", r"step takes \(f: .*\).*: too many positional arguments"),
    ],
)
def test_what_cannot_be_flown_is_refused_by_the_name_of_the_key(path: str, words: str) -> None:
    with pytest.raises(ConfigError, match=f"guid.path = '{path}'.*{words}"):
        make_path(RacetrackParams(path=path))


def test_the_application_says_whose_configuration_it_was() -> None:
    def build(law: str) -> Callable[[], FlightApp]:
        return lambda: FlightApp(
            "windshear", "twinjet", {"ctrl": {"law": law}}, base_rate_hz=50, mission_rate_hz=50, where="the file"
        )

    with pytest.raises(
        ConfigError, match=r"the file: ctrl\.law = 'inversoin': allowed: inversion; did you mean 'inversion'"
    ):
        build("inversoin")()
    with pytest.raises(ConfigError, match=r"the file: ctrl\.law = 'math:tau': is 6\.28"):
        build("math:tau")()
    assert [t.law for t in build("inversion")().laws] == ["inversion"]


def test_a_gust_law_of_somebody_else_takes_its_turn_with_ours() -> None:
    from flightsw.missions.gust.laws import LAWS, OTHER, GustCtrlTable, GustLaws
    from flightsw.missions.gust.model import Turbulence, published
    from flightsw.missions.gust.servos import GustServos

    laws = GustLaws(GustCtrlTable(law="tests.keys.own:Feedback"), published(), Turbulence(), 0.02, 1)
    servos, x, y = GustServos(), np.full(9, 0.01), np.zeros(7)
    assert (laws.law, laws.words) == (OTHER, (*LAWS, "less_flap"))
    flaps = []
    for law in (OTHER, LAWS.index("alleviation")):
        laws.select(law)
        flaps.append(float(laws.step(x, y, servos)[2]))
        assert [t.closed for t in laws.terms] == [k == law for k in range(4)]
    assert 0.0 < abs(flaps[0]) < abs(flaps[1])
    with pytest.raises(ValueError, match="law 3: allowed 0 to 2"):
        GustLaws(GustCtrlTable(), published(), Turbulence(), 0.02, 1).select(OTHER)
