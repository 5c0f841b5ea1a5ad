"""A law or a guidance named in the parameters: ours, somebody else's, or refused by the name of the key."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft, twinjet
from flightsw.app import FlightApp
from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.guidances import make_join_path, make_refuel_path, use_refuel_path
from flightsw.missions.receiver.joinup import JoinUpGuidance, JoinUpParams
from flightsw.missions.receiver.refuel import WAYPOINTS, RefuelGuidance, RefuelParams
from flightsw.missions.tanker.racetrack import PathGuidance, RacetrackGuidance, RacetrackParams, make_path
from flightsw.missions.windshear import path as shear
from flightsw.missions.windshear.control import NidParams, WindshearControl, make_law, use_law
from flightsw.missions.windshear.guidance import WindshearGuidance, WindshearGuidanceParams
from flightsw.plugins import EVERY_KEY, refuse_ignored
from flightsw.strict import ConfigError
from flightsw.types import GuidanceCmd, NavState, SensorFrame, Text, Vec3
from tests.keys.own import Path

HERE = __name__
AROUND = Surroundings(load_aircraft("kc135r"), load_aircraft("learjet24"))
SHEAR = WindshearGuidanceParams(path=f"{HERE}:Slope")
REFUEL = RefuelParams(path=f"{HERE}:Behind")
NID = NidParams(law=f"{HERE}:Stiff")


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
    obeys = EVERY_KEY

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
        (f"{HERE}:Silent", r"lacks obeys, texts of flightsw\.missions\.tanker\.racetrack\.PathGuidance"),
        (f"{HERE}:Short", r"step takes \(f: .*\).*: too many positional arguments"),
    ],
)
def test_what_cannot_be_flown_is_refused_by_the_name_of_the_key(path: str, words: str) -> None:
    with pytest.raises(ConfigError, match=f"guid.path = '{path}'.*{words}"):
        make_path(RacetrackParams(path=path))


@dataclass(frozen=True)
class Schedule:
    V_mps: float = 1.0
    h_m: float = 2.0


@dataclass(frozen=True)
class Table:
    law: str = "ours"
    gain: float = 3.0
    schedule: Schedule = Schedule()


@pytest.mark.parametrize(
    ("name", "obeys", "record", "refused"),
    [
        ("ours", (), Table(gain=4.0), ""),
        ("a:B", EVERY_KEY, Table(gain=4.0), ""),
        ("a:B", (), Table("a:B"), ""),
        ("a:B", ("gain",), Table(gain=4.0), ""),
        ("a:B", ("schedule",), Table(schedule=Schedule(h_m=5.0)), ""),
        ("a:B", ("schedule.h_m",), Table(schedule=Schedule(h_m=5.0)), ""),
        ("a:B", ("schedule.V_mps",), Table(schedule=Schedule(h_m=5.0)), r"ctrl\.schedule\.h_m = 5\.0"),
        ("a:B", ("schedule",), Table(gain=4.0), r"ctrl\.gain = 4\.0"),
    ],
)
def test_a_key_somebody_else_s_part_does_not_obey_is_refused(
    name: str, obeys: tuple[str, ...], record: Table, refused: str
) -> None:
    def check() -> None:
        refuse_ignored("ctrl.law", name, obeys, record, Table())

    if not refused:
        check()
        return
    with pytest.raises(ConfigError, match=f"{refused}: not obeyed by ctrl.law = 'a:B', which obeys {obeys[0]}"):
        check()


class Slope(WindshearGuidance):
    """Obeys one gain, and what the mission reads itself."""

    obeys = ("approach.gain_1ps",)


class Behind(RefuelGuidance):
    """Obeys its places only."""

    obeys = WAYPOINTS


class Straight(JoinUpGuidance):
    """Obeys nothing."""

    obeys = ()


class Stiff(WindshearControl):
    """Obeys one gain."""

    obeys = ("k_path_1ps",)


@pytest.mark.parametrize(
    ("make", "use", "good", "bad", "words"),
    [
        (shear.make_path, shear.use_path, SHEAR, replace(SHEAR, hazard=replace(SHEAR.hazard, gain_F=0.2)),
         r"guid\.hazard\.gain_F = 0\.2: not obeyed by guid\.path"),
        (lambda p: make_refuel_path(p, AROUND), use_refuel_path, REFUEL, replace(REFUEL, settle_s=3.0),
         r"guid\.settle_s = 3\.0: not obeyed by guid\.path"),
        (lambda p: make_law(p, twinjet()), use_law, NID, replace(NID, k_rate_1ps=5.0),
         r"ctrl\.k_rate_1ps = 5\.0: not obeyed by ctrl\.law"),
    ],
    ids=["windshear", "refuelling", "inversion"],
)  # fmt: skip
def test_at_the_start_and_in_flight(make: Any, use: Any, good: Any, bad: Any, words: str) -> None:
    part = make(good)
    use(part, good)
    for refused in (lambda: make(bad), lambda: use(part, bad)):
        with pytest.raises(ConfigError, match=words):
            refused()


def test_a_way_to_the_tanker_of_somebody_else() -> None:
    p = JoinUpParams(V_mps=190.0, path=f"{HERE}:Straight")  # the mission reads V_mps itself
    assert isinstance(make_join_path(p), Straight)
    with pytest.raises(ConfigError, match=r"join\.guid\.handover_m = 90\.0: not obeyed by join\.guid\.path"):
        make_join_path(replace(p, handover_m=90.0))
    with pytest.raises(
        ConfigError,
        match=r"join\.guid\.path = '.*:Mute': lacks .* of flightsw\.missions\.receiver\.guidances\.JoinPath",
    ):
        make_join_path(replace(p, path=f"{HERE}:Mute"))


@pytest.mark.parametrize(
    ("make", "contract"), [(shear.make_path, "ShearPath"), (lambda p: make_refuel_path(p, AROUND), "RefuelPath")]
)
def test_a_guidance_that_is_none(make: Any, contract: str) -> None:
    p = SHEAR if contract == "ShearPath" else REFUEL
    with pytest.raises(ConfigError, match=f"guid.path = 'tests.keys.own:Autopilot': lacks .* of .*{contract}"):
        make(replace(p, path="tests.keys.own:Autopilot"))


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
